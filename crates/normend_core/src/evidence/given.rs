//! Sides that came with the file as normals.

use glam::Vec3;
use rayon::prelude::*;

use super::{Evidence, Origin, UNIT, Vote};

/// Votes for the side that the `given` normals point to.
///
/// * `normals` – `n` unit normals of any sign; votes are for these
/// * `given` – `n` vectors of any length; zero or not finite where a point has none, which then gets no vote
/// * `trust` – looks that a given normal is worth where both are parallel, in 0..=1000
///
/// A vote falls with the cosine between both, as perpendicular normals say nothing about each other's side. O(n).
pub fn given(normals: &[Vec3], given: &[Vec3], trust: f32) -> Evidence {
    let trust = f64::from(trust.clamp(0.0, 1000.0));
    let votes = (normals, given)
        .into_par_iter()
        .map(|(normal, given)| {
            let mut vote = Vote::default();
            if let Some(given) = given.as_dvec3().try_normalize() {
                let cosine = normal.as_dvec3().dot(given).clamp(-1.0, 1.0);
                vote.cast((cosine * trust * f64::from(UNIT)).round() as i32);
            }
            vote
        })
        .collect();
    Evidence::new(Origin::Given, votes)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn check(normal: Vec3, from_file: Vec3, trust: f32, expect: f32) {
        let vote = given(&[normal], &[from_file], trust).votes()[0];
        assert!((vote.signed as f32 / UNIT as f32 - expect).abs() < 1e-3, "{vote:?}");
        assert_eq!(vote.weight, vote.signed.abs());
    }

    #[test]
    fn votes_for_the_given_side() {
        check(Vec3::Z, Vec3::Z * 1e-30, 1.0, 1.0);
        check(Vec3::Z, Vec3::new(0.0, 3e30, -4e30), 2.0, -1.6);
        check(Vec3::Z, Vec3::X, 1.0, 0.0);
    }

    #[test]
    fn no_normal_no_vote() {
        for missing in [Vec3::ZERO, Vec3::NAN, Vec3::new(f32::INFINITY, 0.0, 0.0)] {
            check(Vec3::Z, missing, 1.0, 0.0);
        }
    }

    #[test]
    fn trust_has_bounds() {
        check(Vec3::Z, Vec3::Z, f32::INFINITY, 1000.0);
        check(Vec3::Z, Vec3::Z, -1.0, 0.0);
    }
}
