//! Sides known from where the scanner stood: it saw every point that it measured.

use std::ops::Range;

use glam::{DVec3, Vec3};
use rayon::prelude::*;

use super::{Evidence, Known, Origin, UNIT, Vote};
use crate::PointCloud;

/// A place that a scanner measured points from.
#[derive(Clone, Debug, PartialEq)]
pub struct Station {
    /// The points it measured.
    pub points: Range<u32>,
    /// Where it stood, in the file's coordinates.
    pub position: DVec3,
}

/// Cosine of the angle between normal and ray, 60°, from which on a scanner's vote is a whole one. Fitted normals near edges
/// and in noise are off by up to about 30°, so rays more grazing than 60° may come to the wrong side of one.
pub(super) const SURE_COSINE: f64 = 0.5;

/// How many looks a scanner's vote is worth: about as many as a point gets from all views that see it from outside, each of
/// which may err, while the scanner did see the point.
const LOOKS: f64 = 4.0;

/// Votes for the side of each point that its scanner stood on.
///
/// `normals` are `n` unit normals of any sign; votes are for these. A vote fades from 60° between normal and ray to zero at
/// 90°. Points of no station get no vote, points of several get one from each, and one from the track. Ranges that reach beyond
/// the cloud are cut.
/// O(n + points of all stations), in parallel.
pub fn scanner(cloud: &PointCloud, normals: &[Vec3], known: &Known<'_>) -> Evidence {
    let mut votes = vec![Vote::default(); cloud.n_points()];
    for station in known.stations {
        // Both may be far from zero: the difference is taken before f32 rounds.
        let position = station.position - cloud.origin();
        let end = (station.points.end as usize).min(votes.len());
        let points = (station.points.start as usize).min(end)..end;
        let measured = &cloud.positions()[points.clone()];
        (&mut votes[points.clone()], measured, &normals[points])
            .into_par_iter()
            .for_each(|(vote, point, normal)| vote.cast(look(position, *point, *normal)));
    }
    if let Some(track) = known.track {
        let points = (&mut votes, cloud.positions(), normals).into_par_iter().enumerate();
        points.for_each(|(point, (vote, position, normal))| {
            if let Some(place) = track.place(point) {
                vote.cast(look(place - cloud.origin(), *position, *normal));
            }
        });
    }
    Evidence::new(Origin::Scanner, votes)
}

/// What a scanner at `place` says of the side of a normal, in units of 1/[`UNIT`]; both places in the cloud's own space.
pub(super) fn look(place: DVec3, point: Vec3, normal: Vec3) -> i32 {
    let ray = (place - point.as_dvec3()).normalize_or_zero();
    let share = (normal.as_dvec3().dot(ray) / SURE_COSINE).clamp(-1.0, 1.0);
    (share * LOOKS * f64::from(UNIT)).round() as i32
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::evidence::Track;

    fn from(stations: &[Station]) -> Known<'_> {
        Known {
            stations,
            ..Known::default()
        }
    }

    #[test]
    fn a_moving_scanner_votes_from_where_it_was() {
        let cloud = PointCloud::new(DVec3::ZERO, vec![Vec3::ZERO, Vec3::X, Vec3::Y]).unwrap();
        let corners = vec![DVec3::new(0.0, 0.0, 5.0), DVec3::new(0.0, 0.0, -5.0)];
        let along = [Some(0.25), Some(1.0), None];
        let track = Track::new(corners, 3, |point| along[point]);
        let known = Known {
            track: Some(&track),
            ..Known::default()
        };
        let evidence = scanner(&cloud, &[Vec3::Z; 3], &known);
        let signed: Vec<i32> = evidence.votes().iter().map(|vote| vote.signed / UNIT).collect();
        assert_eq!(signed, [4, -4, 0]);
        assert!(known.has_scanner());
        assert_eq!(known.places(), track.corners());
    }

    /// A point at the file's `point` with the normal +z, and a scanner at `station`: the signed vote in looks.
    fn check(point: DVec3, station: DVec3, expect: f32) {
        let far = point + DVec3::X;
        let cloud = PointCloud::from_f64(&[point, far]).unwrap();
        let station = Station {
            points: 0..1,
            position: station,
        };
        let evidence = scanner(&cloud, &[Vec3::Z; 2], &from(&[station]));
        let looks = evidence.votes()[0].signed as f32 / UNIT as f32;
        assert!((looks - expect).abs() < 1e-3, "{looks}");
        assert_eq!(evidence.votes()[0].weight, evidence.votes()[0].signed.abs());
        assert_eq!(evidence.votes()[1], Vote::default());
    }

    #[test]
    fn votes_for_the_scanners_side() {
        check(DVec3::ZERO, DVec3::Z, 4.0);
        check(DVec3::ZERO, -7.0 * DVec3::Z, -4.0);
        check(DVec3::ZERO, DVec3::new(4.0, 0.0, 3.0), 4.0);
    }

    #[test]
    fn a_grazing_ray_is_not_sure() {
        check(DVec3::ZERO, DVec3::X, 0.0);
        check(DVec3::ZERO, DVec3::new(4.0, 0.0, -1.0), -4.0 * 2.0 / 17.0_f32.sqrt());
    }

    #[test]
    fn a_scanner_on_the_point_says_nothing() {
        check(DVec3::ONE, DVec3::ONE, 0.0);
    }

    #[test]
    fn places_on_the_globe_are_exact() {
        let globe = DVec3::new(512_345.25, 5_412_345.5, 123.0);
        check(globe, globe + DVec3::new(0.0, 0.0, 0.01), 4.0);
        check(globe, globe - DVec3::new(0.0, 0.0, 0.01), -4.0);
    }

    #[test]
    fn ranges_are_cut_to_the_cloud_and_add_up() {
        let cloud = PointCloud::new(DVec3::ZERO, vec![Vec3::ZERO, Vec3::X, Vec3::Y]).unwrap();
        let station = |points: Range<u32>, z: f64| Station {
            points,
            position: DVec3::new(0.0, 0.0, z),
        };
        let stations = [
            station(0..2, 9.0),
            station(1..70, 9.0),
            station(80..90, 9.0),
            station(0..1, -9.0),
        ];
        let evidence = scanner(&cloud, &[Vec3::Z; 3], &from(&stations));
        let signed: Vec<i32> = evidence.votes().iter().map(|vote| vote.signed / UNIT).collect();
        assert_eq!(signed, [0, 8, 4]);
        assert_eq!(evidence.votes()[0].weight, 8 * UNIT);
    }
}
