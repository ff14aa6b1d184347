//! How far oriented normals face the places that they were measured from.

use glam::{DVec3, Vec3};
use rayon::prelude::*;

use super::scanner::look;
use super::{Station, Track, UNIT};
use crate::PointCloud;

/// What a scanner's place says of the points that it measured.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Tally {
    /// Points whose side it saw for sure or nearly so: those with at least a whole look.
    pub n_votes: u64,
    /// Those of them whose normal faces away from it.
    pub n_against: u64,
}

/// Counts what each station, and at the end the track if there is one, says of oriented normals.
///
/// `normal` gives the unit normal of each point. Grazed points are not counted: noise turns them. Ranges that reach beyond the cloud
/// are cut. O(n + points of all stations), in parallel.
pub fn tallies(
    cloud: &PointCloud,
    normal: impl Fn(usize) -> Vec3 + Sync,
    stations: &[Station],
    track: Option<&Track>,
) -> Vec<Tally> {
    let count = |points: std::ops::Range<usize>, place: &(dyn Fn(usize) -> Option<DVec3> + Sync)| {
        let tally = |point: usize| {
            let vote = place(point).map_or(0, |place| {
                look(place - cloud.origin(), cloud.positions()[point], normal(point))
            });
            Tally {
                n_votes: u64::from(vote.abs() >= UNIT),
                n_against: u64::from(vote <= -UNIT),
            }
        };
        let add = |a: Tally, b: Tally| Tally {
            n_votes: a.n_votes + b.n_votes,
            n_against: a.n_against + b.n_against,
        };
        points.into_par_iter().map(tally).reduce(Tally::default, add)
    };
    let of_stations = stations.iter().map(|station| {
        let end = (station.points.end as usize).min(cloud.n_points());
        count((station.points.start as usize).min(end)..end, &|_| {
            Some(station.position)
        })
    });
    let of_track = track.map(|track| count(0..cloud.n_points(), &|point| track.place(point)));
    of_stations.chain(of_track).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_faces_away_is_against() {
        let origin = DVec3::new(5e5, 4e6, 100.0);
        let cloud = PointCloud::new(origin, vec![Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::ONE]).unwrap();
        let normals = [Vec3::Z, Vec3::NEG_Z, Vec3::X, Vec3::Z];
        let above = Station {
            points: 0..3,
            position: origin + DVec3::new(0.0, 0.0, 50.0),
        };
        let below = Station {
            points: 3..90,
            position: origin - DVec3::new(0.0, 0.0, 50.0),
        };
        let track = Track::new(vec![above.position], 4, |point| (point > 1).then_some(0.0));
        let found = tallies(&cloud, |point| normals[point], &[above, below], Some(&track));
        let tally = |n_votes, n_against| Tally { n_votes, n_against };
        // The third is grazed.
        assert_eq!(found, [tally(2, 1), tally(1, 1), tally(1, 0)]);
    }
}
