//! The side of each component, where a rule says more than the default sources do.

use rayon::prelude::*;

use crate::SpanningTree;
use crate::side_rule::{Clues, Side, SideRule, decide_side};

/// The side of each component of `tree`, in the order of its roots: whether it must turn when its root has the stored normal and
/// signs travel along the tree.
pub(super) fn sides(tree: &SpanningTree, rule: SideRule, clues: &Clues<'_>) -> Vec<Side> {
    (tree.roots().par_iter())
        .map(|&root| {
            let component = tree.subtree(root);
            let points = &tree.order()[component.start as usize..component.end as usize];
            decide_side(points, |point| tree.phi(tree.position(point)), rule, clues)
        })
        .collect()
}
