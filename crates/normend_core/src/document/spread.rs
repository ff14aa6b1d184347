//! Signs that spread into a set of points from those beside it.
//!
//! It is MMST (Liu et al., Algorithm 1) on a part of the tree: the points outside are sources, and each point inside follows the
//! one that it reaches over the lightest edges.

use crate::{Orientation, SpanningTree};

/// Whether a point inside has its own say.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Anchor {
    /// Its normal is turned or not, whatever is around it.
    Holds(bool),
    /// It follows others.
    Follows,
}

/// The end of an edge that is not the inner point.
#[derive(Clone, Copy)]
enum End {
    /// Another point inside, by its place in the list.
    Inside(u32),
    /// A point outside: whether its sign is the opposite of phi.
    Outside(bool),
}

/// The signs of the points at `positions` (ascending) as they follow from `anchors` among them and from the present signs of the
/// points beside them in the tree. A part that touches neither keeps its signs. Returns each position with whether it is turned.
///
/// O(m log m) for m points and the tree edges at them.
pub(super) fn inside(
    tree: &SpanningTree,
    positions: &[u32],
    present: &Orientation,
    anchors: impl Fn(u32) -> Anchor,
) -> Vec<(u32, bool)> {
    let place = |position: u32| positions.binary_search(&position).ok().map(|place| place as u32);
    let is_opposite = |position: u32| present.is_turned(position) != tree.phi(position);
    // Each edge is named by the position whose parent edge it is.
    let mut edges: Vec<(u32, u32, End)> = Vec::new();
    for (own, &position) in positions.iter().enumerate() {
        let own = own as u32;
        if let Some(parent) = tree.parent(position) {
            let end = place(parent).map_or_else(|| End::Outside(is_opposite(parent)), End::Inside);
            edges.push((position, own, end));
        }
        for child in tree.children(position) {
            if place(child).is_none() {
                edges.push((child, own, End::Outside(is_opposite(child))));
            }
        }
    }
    edges.sort_unstable_by(|a, b| tree.compare_edges(a.0, b.0));
    let mut groups = Groups {
        parents: (0..positions.len() as u32).collect(),
        opposite: positions
            .iter()
            .map(|&position| match anchors(position) {
                Anchor::Holds(turned) => Some(turned != tree.phi(position)),
                Anchor::Follows => None,
            })
            .collect(),
    };
    for (_, own, end) in edges {
        let own = groups.find(own);
        match end {
            End::Outside(opposite) => {
                groups.opposite[own as usize].get_or_insert(opposite);
            }
            End::Inside(other) => {
                let other = groups.find(other);
                let (a, b) = (groups.opposite[own as usize], groups.opposite[other as usize]);
                if own != other && (a.is_none() || b.is_none()) {
                    groups.parents[other as usize] = own;
                    groups.opposite[own as usize] = a.or(b);
                }
            }
        }
    }
    (positions.iter().enumerate())
        .map(|(own, &position)| {
            let group = groups.find(own as u32);
            let turned = groups.opposite[group as usize]
                .map_or(present.is_turned(position), |opposite| tree.phi(position) != opposite);
            (position, turned)
        })
        .collect()
}

/// Points that got the same say, as a forest.
struct Groups {
    parents: Vec<u32>,
    /// By the first of a group: whether its signs are the opposites of phi; `None` while nobody says.
    opposite: Vec<Option<bool>>,
}

impl Groups {
    fn find(&mut self, mut place: u32) -> u32 {
        while self.parents[place as usize] != place {
            let parent = self.parents[place as usize];
            self.parents[place as usize] = self.parents[parent as usize];
            place = parent;
        }
        place
    }
}
