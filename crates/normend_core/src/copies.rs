//! Points that stand in one place: all but the first of them are copies.
//!
//! Copies say nothing of the surface, and a place has one normal: so a cloud with copies is oriented without them, and they take
//! normal, sign, votes and patch from the first point of their place. The result is that of the cloud without copies, however many
//! there are.
//!
//! Invariant: in the tree a copy is a leaf below the first point of its place, over an edge of weight 0, so no source elsewhere ever
//! tells them apart.
//! Not here: how a propagation takes the copies in, see `propagation/expanded.rs`.

use glam::Vec3;
use rayon::prelude::*;

use crate::PointCloud;
use crate::evidence::{Station, Track};

/// The places of a cloud in which several points stand, and the others.
pub(crate) struct Copies {
    /// The first point of each place, in the order of the cloud.
    pub distinct: PointCloud,
    pub places: Members,
}

/// Which points stand in which place.
pub(crate) struct Members {
    /// Point ids, place by place, ascending in each; places in the order of their first points.
    ids: Vec<u32>,
    /// Offsets into `ids`, one for each place and one more.
    starts: Vec<u32>,
}

impl Members {
    /// Number of places.
    pub fn n_places(&self) -> usize {
        self.starts.len() - 1
    }

    /// Number of points.
    pub fn n_points(&self) -> usize {
        self.ids.len()
    }

    /// The points of a place, ascending; at least one.
    #[inline]
    pub fn of(&self, place: usize) -> &[u32] {
        &self.ids[self.starts[place] as usize..self.starts[place + 1] as usize]
    }

    /// The first point of a place.
    #[inline]
    pub fn first(&self, place: u32) -> u32 {
        self.ids[self.starts[place as usize] as usize]
    }

    /// The copies of the first point of a place.
    #[inline]
    pub fn copies(&self, place: u32) -> &[u32] {
        &self.of(place as usize)[1..]
    }

    /// Values by point from values by place. O(n).
    pub fn by_point<T: Copy + Default>(&self, by_place: &[T]) -> Vec<T> {
        let mut values = vec![T::default(); self.n_points()];
        for (place, &value) in by_place.iter().enumerate() {
            for &point in self.of(place) {
                values[point as usize] = value;
            }
        }
        values
    }
}

impl Copies {
    /// Looks for points in one place; `None` where there are none, which takes a sort of 8 bytes a point. O(n log n), in parallel.
    pub fn find(cloud: &PointCloud) -> Option<Self> {
        let n_points = cloud.n_points();
        let mut keys: Vec<u64> = (0..n_points)
            .into_par_iter()
            .map(|point| cloud.place_key(point))
            .collect();
        keys.par_sort_unstable();
        if !keys.par_windows(2).any(|pair| pair[0] == pair[1]) {
            return None;
        }
        drop(keys);
        let mut keyed: Vec<(u64, u32)> = (0..n_points as u32)
            .into_par_iter()
            .map(|point| (cloud.place_key(point as usize), point))
            .collect();
        keyed.par_sort_unstable();
        // Points of one key are in one place, or as good as never in several.
        let mut firsts: Vec<u32> = (0..n_points as u32).collect();
        let mut of_key: Vec<u32> = Vec::new();
        for same in keyed.chunk_by(|a, b| a.0 == b.0) {
            of_key.clear();
            for &(_, point) in same {
                let place = cloud.relative(point as usize);
                let first = of_key
                    .iter()
                    .copied()
                    .find(|&first| cloud.relative(first as usize) == place);
                match first {
                    Some(first) => firsts[point as usize] = first,
                    None => of_key.push(point),
                }
            }
        }
        drop(keyed);
        let distinct: Vec<u32> = (0..)
            .zip(&firsts)
            .filter(|&(point, &first)| point == first)
            .map(|(point, _)| point)
            .collect();
        if distinct.len() == n_points {
            return None;
        }
        // First the number of the place by its first point, then by each.
        let mut places = firsts;
        let mut starts = vec![0_u32; distinct.len() + 1];
        let mut n_places = 0;
        for point in 0..n_points {
            // The first point of a place comes before its copies, so its own entry is a place already.
            let is_first = places[point] as usize == point;
            places[point] = if is_first {
                n_places
            } else {
                places[places[point] as usize]
            };
            n_places += u32::from(is_first);
            starts[places[point] as usize + 1] += 1;
        }
        for place in 0..distinct.len() {
            starts[place + 1] += starts[place];
        }
        let mut free = starts.clone();
        let mut ids = vec![0_u32; n_points];
        for (point, &place) in (0..).zip(&places) {
            ids[free[place as usize] as usize] = point;
            free[place as usize] += 1;
        }
        Some(Self {
            distinct: cloud.subset(&distinct),
            places: Members { ids, starts },
        })
    }

    /// The file's normals by place: of each the first that can be used.
    pub fn given(&self, given: &[Vec3]) -> Vec<Vec3> {
        let is_usable = |normal: &Vec3| normal.is_finite() && *normal != Vec3::ZERO;
        (0..self.places.n_places())
            .into_par_iter()
            .map(|place| {
                let mut normals = self.places.of(place).iter().map(|&point| given[point as usize]);
                normals.find(is_usable).unwrap_or(Vec3::ZERO)
            })
            .collect()
    }

    /// Where a moving scanner measured the places: where it did the first point of each.
    pub fn track(&self, track: &Track) -> Track {
        track.of((0..self.places.n_places() as u32).map(|place| self.places.first(place)))
    }

    /// The places that each scanner measured: those whose first point it did.
    pub fn stations(&self, stations: &[Station]) -> Vec<Station> {
        let place = |point: u32| {
            let (mut low, mut high) = (0, self.places.n_places() as u32);
            while low < high {
                let middle = low + (high - low) / 2;
                if self.places.first(middle) < point {
                    low = middle + 1;
                } else {
                    high = middle;
                }
            }
            low
        };
        let of_places = |station: &Station| Station {
            points: place(station.points.start)..place(station.points.end),
            position: station.position,
        };
        stations.iter().map(of_places).collect()
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;
    use proptest::prelude::*;

    use super::*;

    fn cloud(positions: &[Vec3]) -> PointCloud {
        PointCloud::new(DVec3::ZERO, positions.to_vec()).unwrap()
    }

    proptest! {
        #[test]
        fn places_are_found_in_the_order_of_their_first_points(
            corners in prop::collection::vec((-1_i8..2, -1_i8..2, -1_i8..2), 0..60),
        ) {
            let zero = |value: i8| if value == 0 { -0.0 } else { f32::from(value) };
            let positions: Vec<Vec3> = corners.iter().enumerate().map(|(i, &(x, y, z))| {
                let place = Vec3::new(x.into(), y.into(), z.into());
                // Both zeros are one place.
                if i % 2 == 0 { place } else { Vec3::new(zero(x), zero(y), zero(z)) }
            }).collect();
            let mut expect: Vec<Vec<u32>> = Vec::new();
            for (point, position) in (0..).zip(&positions) {
                match expect.iter_mut().find(|place| positions[place[0] as usize] == *position) {
                    Some(place) => place.push(point),
                    None => expect.push(vec![point]),
                }
            }
            match Copies::find(&cloud(&positions)) {
                None => prop_assert_eq!(expect.len(), positions.len()),
                Some(copies) => {
                    prop_assert!(expect.len() < positions.len());
                    let found: Vec<Vec<u32>> =
                        (0..copies.places.n_places()).map(|place| copies.places.of(place).to_vec()).collect();
                    prop_assert_eq!(copies.distinct.n_points(), found.len());
                    prop_assert_eq!(found, expect);
                }
            }
        }
    }

    #[test]
    fn scanners_measured_the_places_whose_first_points_they_did() {
        let positions = [Vec3::X, Vec3::X, Vec3::Y, Vec3::Z, Vec3::Y, Vec3::NEG_X];
        let copies = Copies::find(&cloud(&positions)).unwrap();
        let stations = [0..2, 2..5, 5..6, 6..90].map(|points| Station {
            points,
            position: DVec3::ONE,
        });
        let of_places = copies.stations(&stations).into_iter().map(|station| station.points);
        assert_eq!(of_places.collect::<Vec<_>>(), [0..1, 1..3, 3..4, 4..4]);
        let mut given = [Vec3::ZERO, Vec3::NAN, Vec3::ZERO, Vec3::Z, Vec3::Y, Vec3::ZERO];
        assert_eq!(copies.given(&given), [Vec3::ZERO, Vec3::Y, Vec3::Z, Vec3::ZERO]);
        given[1] = Vec3::X;
        assert_eq!(copies.given(&given)[0], Vec3::X);
    }
}
