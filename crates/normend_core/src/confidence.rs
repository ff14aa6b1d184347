//! How sure the automatic method is of each point's side, as a share: of points at confidence c about a share c is right.
//!
//! Where wrong points are left, it is at weak boundaries and where votes say the opposite. So a score is made of three things
//! that the method leaves behind: the point's own vote, how well its own couplings are satisfied, and the weakest boundary of a
//! patch that holds it. A table says how many of the points with that score are right; it was counted on generated clouds
//! (`normend bench clouds`) and holds on others (`normend bench suspects` prints both). Which side a whole component shows is a
//! question of its own: what its votes say of it limits the confidence of all its points.
//!
//! Confidence is kept in one byte, in units of 1/255.
//!
//! Invariant: the same for any number of threads, and under permutation, rotation and scale as far as the signs are.
//! Not here: what sources and clicks add; confidence is of the signs before any.

use rayon::prelude::*;

use crate::side_rule::Side;
use crate::{Patches, Propagation};

/// What a unanimous vote for the sign adds to the score.
const VOTE_FOR: f32 = 2.0;
/// What a unanimous vote against it takes away: more, because the sign was chosen against it for want of anything better.
const VOTE_AGAINST: f32 = 3.5;
/// The weight of the weakest boundary in the score, which takes its closeness to 1 by the logarithm: of boundaries of .9 and of
/// .99 the second is ten times less often wrong.
const BOUNDARY: f32 = 1.3;
/// The weight of the point's own couplings, by the same measure; less, because a patch that is wrong as a whole satisfies them.
const OWN: f32 = 0.9;
/// Keeps the logarithm finite where all is satisfied: strengths are not known to more than a few hundredths.
const LEAST_DOUBT: f32 = 0.02;

/// Scores and the share of points that are right there, as log odds, in between them linear. Fitted by maximum likelihood to 1.3
/// million points of generated clouds. It does not reach down to 0: points that seem to be wrong were turned by the method itself,
/// so what is left is undecided.
const CALIBRATION: [(f32, f32); 11] = [
    (-3.0, -0.53),
    (0.0, -0.30),
    (2.0, 0.39),
    (3.0, 0.91),
    (4.0, 1.41),
    (5.0, 2.20),
    (6.0, 3.22),
    (7.0, 4.26),
    (8.0, 5.34),
    (9.0, 7.67),
    (10.0, 9.19),
];

/// The agreement of a component's votes from which on its side is sure. No component of the measured clouds that agreed by half
/// was inside out; below are open sheets, whose side is a matter of convention, and rooms.
const SURE_AGREEMENT: f32 = 0.5;

/// Confidence of a point that is as likely wrong as right, or less, in units of 1/255, where a half rounds up; the sign of such a
/// point is undecided.
pub const UNDECIDED: u8 = 128;

/// Confidence by point, in units of 1/255, that the sign which `propagation` starts with is right, the side of its component
/// included; see [`of_points`] and [`of_side`]. `None` where the method leaves no patches and evidence behind: it is known for
/// the automatic method only. O(n), 8 bytes a patch while it works.
pub fn confidence(propagation: &Propagation) -> Option<Vec<u8>> {
    let mut confidence = of_points(propagation)?;
    let tree = &propagation.tree;
    for (&root, side) in tree.roots().iter().zip(&propagation.sides) {
        let side = of_side(side);
        let component = tree.subtree(root);
        for &point in &tree.order()[component.start as usize..component.end as usize] {
            let c = &mut confidence[point as usize];
            let local = f32::from(*c) / 255.0;
            // Right on the right side, or wrong on the wrong one.
            *c = in_bytes(local * side + (1.0 - local) * (1.0 - side));
        }
    }
    Some(confidence)
}

/// Whether [`confidence`] is known of this propagation, without computing it.
pub fn is_known(propagation: &Propagation) -> bool {
    propagation.patches.is_some() && propagation.evidence.is_some()
}

/// How many points are undecided: [`confidence`] of at most [`UNDECIDED`].
pub fn n_undecided(confidence: &[u8]) -> usize {
    confidence.iter().filter(|&&c| c <= UNDECIDED).count()
}

/// Confidence by point, in units of 1/255, that its sign is right if its component shows the right side. As [`confidence`]
/// otherwise.
pub fn of_points(propagation: &Propagation) -> Option<Vec<u8>> {
    let (patches, evidence) = (propagation.patches.as_ref()?, propagation.evidence.as_ref()?);
    let weakest = weakest_boundaries(patches);
    let votes = evidence.votes();
    let own: Vec<f32> = patches
        .all()
        .take(votes.len())
        .map(|(patch, _)| patch.strength())
        .collect();
    Some(
        (votes.par_iter().zip(own).zip(weakest))
            .map(|((vote, own), weakest)| in_bytes(calibrated(score(vote.pull(), own, weakest))))
            .collect(),
    )
}

/// Confidence in 0.5..=1 that a component shows its right side: a coin's where nothing tells.
pub fn of_side(side: &Side) -> f32 {
    match side.rule {
        None => 0.5,
        Some(_) => 0.5 + 0.5 * (side.agreement / SURE_AGREEMENT).min(1.0),
    }
}

/// What `pull` of the point's vote, the strength of its `own` couplings, and the `weakest` boundary around it add up to.
fn score(pull: f32, own: f32, weakest: f32) -> f32 {
    let vote = pull * if pull > 0.0 { VOTE_FOR } else { VOTE_AGAINST };
    let sureness = |strength: f32| -(1.0 + LEAST_DOUBT - strength).ln();
    vote + BOUNDARY * sureness(weakest) + OWN * sureness(own)
}

/// The share of points with this score that are right, by [`CALIBRATION`].
fn calibrated(score: f32) -> f32 {
    let after = CALIBRATION.partition_point(|&(at, _)| at <= score);
    let log_odds = match (
        after.checked_sub(1).map(|before| CALIBRATION[before]),
        CALIBRATION.get(after),
    ) {
        (Some((_, last)), None) => last,
        (None, Some(&(_, first))) => first,
        (Some((at, low)), Some(&(next, high))) => low + (high - low) * (score - at) / (next - at),
        (None, None) => 0.0,
    };
    1.0 / (1.0 + (-log_odds).exp())
}

/// A share as a byte.
fn in_bytes(share: f32) -> u8 {
    (share * 255.0).round() as u8
}

/// By patch, the points first, the weakest boundary of the patches around it that have at most half of the component: of two parts the smaller one
/// is in question.
fn weakest_boundaries(patches: &Patches) -> Vec<f32> {
    let all: Vec<_> = patches.all().collect();
    let mut weakest = vec![1.0_f32; all.len()];
    let mut n_component = vec![0_u32; all.len()];
    for (node, &(patch, parent)) in all.iter().enumerate().rev() {
        let parent = parent as usize;
        if parent == node {
            n_component[node] = patch.n_points;
            continue;
        }
        n_component[node] = n_component[parent];
        weakest[node] = weakest[parent];
        if patch.n_points <= n_component[node] / 2 {
            weakest[node] = weakest[node].min(patch.strength());
        }
    }
    weakest
}

#[cfg(test)]
mod tests {
    use glam::DVec3;
    use proptest::prelude::*;

    use super::*;
    use crate::shapes::ShapeKind;
    use crate::{PointCloud, Preset, SideRule, Silent};

    fn propagation(preset: Preset) -> Propagation {
        let cloud = PointCloud::new(DVec3::ZERO, ShapeKind::Torus.generate(3000).positions).unwrap();
        Propagation::new(&cloud, None, preset.parameters(), &Silent).unwrap()
    }

    #[test]
    fn a_plain_body_is_sure() {
        let propagation = propagation(Preset::Auto);
        let confidence = confidence(&propagation).unwrap();
        assert_eq!(n_undecided(&confidence), 0);
        assert!(confidence.iter().filter(|&&c| c > 250).count() > 2900);
    }

    #[test]
    fn only_the_automatic_method_knows() {
        assert_eq!(confidence(&propagation(Preset::Tree)), None);
    }

    #[test]
    fn a_side_that_nothing_tells_is_a_coin() {
        let mut propagation = propagation(Preset::Auto);
        for side in &mut propagation.sides {
            side.rule = None;
        }
        let confidence = confidence(&propagation).unwrap();
        assert!(confidence.iter().all(|&c| (127..=128).contains(&c)), "{confidence:?}");
        assert_eq!(n_undecided(&confidence), confidence.len());
        let check = |rule: Option<SideRule>, agreement: f32, expect: f32| {
            let side = Side {
                turned: false,
                rule,
                agreement,
                seen: 1.0,
            };
            assert!((of_side(&side) - expect).abs() < 1e-6);
        };
        check(None, 0.0, 0.5);
        check(Some(SideRule::Outward), 0.25, 0.75);
        check(Some(SideRule::Up), 0.9, 1.0);
    }

    proptest! {
        #[test]
        fn more_of_anything_is_surer(pull in -1.0_f32..0.9, own in -1.0_f32..0.9, weakest in -1.0_f32..0.9, more in 0.0_f32..0.1) {
            let of = |a, b, c| calibrated(score(a, b, c));
            let base = of(pull, own, weakest);
            prop_assert!((0.3..=1.0).contains(&base));
            prop_assert!(of(pull + more, own, weakest) >= base);
            prop_assert!(of(pull, own + more, weakest) >= base);
            prop_assert!(of(pull, own, weakest + more) >= base);
        }
    }
}
