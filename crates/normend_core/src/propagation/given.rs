//! Starting from normals that came with the file.

use fixedbitset::FixedBitSet;
use glam::Vec3;
use rayon::prelude::*;

use crate::{PointCloud, SpanningTree};

/// The file's normals, made unit, and the points without one.
pub(super) struct GivenNormals {
    /// `n` unit normals by point, with the file's signs; zero where missing.
    pub normals: Vec<Vec3>,
    /// By point: no usable normal was given.
    pub missing: FixedBitSet,
}

impl GivenNormals {
    /// Takes `given`, `n` vectors by point. Vectors that are unit within 1e-3 of their squared length stay as they are, bit for
    /// bit; others are normalized; zero and not finite ones are missing.
    pub fn new(given: &[Vec3]) -> Self {
        let normals: Vec<Vec3> = given
            .par_iter()
            .map(|&normal| {
                if (normal.length_squared() - 1.0).abs() <= 1e-3 {
                    normal
                } else {
                    // In f64, where no finite f32 vector but zero has a length that is zero or infinite.
                    normal
                        .as_dvec3()
                        .try_normalize()
                        .map_or(Vec3::ZERO, |unit| unit.as_vec3())
                }
            })
            .collect();
        let mut missing = FixedBitSet::with_capacity(given.len());
        for (point, normal) in normals.iter().enumerate() {
            missing.set(point, *normal == Vec3::ZERO);
        }
        Self { normals, missing }
    }

    /// The given normals, and those of `estimated` where one is missing.
    pub fn filled_with(&self, estimated: &[Vec3]) -> Vec<Vec3> {
        let mut normals = self.normals.clone();
        for point in self.missing.ones() {
            normals[point] = estimated[point];
        }
        normals
    }

    /// Cuts `tree` (on the filled normals) so that signs can travel in each part without turning a given normal, and says
    /// how each part starts; parts without a given normal stay as they are in `initially_turned`.
    ///
    /// An edge between two given normals is cut when it says "turn". A point without one takes the sign that reaches it
    /// along the lightest edges, as Algorithm 1 does with the given normals as sources; where two signs meet, the heaviest
    /// edge between them is cut. O(n + m log m) time for m points without a normal.
    pub fn cut_disagreements(
        &self,
        tree: &SpanningTree,
        initial_cuts: &mut FixedBitSet,
        initially_turned: &mut FixedBitSet,
    ) {
        let is_missing = |position: u32| self.missing.contains(tree.order()[position as usize] as usize);
        let mut to_missing = Vec::new();
        for position in 0..tree.n_points() as u32 {
            if let Some(parent) = tree.parent(position) {
                if is_missing(position) || is_missing(parent) {
                    to_missing.push(position);
                } else if tree.phi(position) != tree.phi(parent) {
                    initial_cuts.insert(position as usize);
                }
            }
        }
        // Kruskal's algorithm with all given normals as one node, the ground, that never turns.
        to_missing.par_sort_unstable_by(|&a, &b| tree.compare_edges(a, b));
        let mut parts = SignedParts::new(tree.n_points());
        let ground = tree.n_points() as u32;
        let node = |position: u32| if is_missing(position) { position } else { ground };
        for &position in &to_missing {
            // The list holds no roots.
            let parent = tree.parent(position).unwrap_or(position);
            let turn = tree.phi(position) != tree.phi(parent);
            if !parts.join(node(position), node(parent), turn) {
                initial_cuts.insert(position as usize);
            }
        }
        for top in tree
            .roots()
            .iter()
            .copied()
            .chain(initial_cuts.ones().map(|position| position as u32))
        {
            if let Some(turned) = parts.relation(node(top), ground) {
                initially_turned.set(top as usize, turned);
            }
        }
    }
}

/// The default source of each component of `tree` that is cut at `cuts`, in the order of its roots: of the largest region, which is
/// right if most is, the point farthest along +z; of several regions or points the first in the tree. O(n).
pub(super) fn default_sources(cloud: &PointCloud, tree: &SpanningTree, cuts: &FixedBitSet) -> Vec<u32> {
    let mut tops: Vec<u32> = (0..tree.n_points() as u32).collect();
    let mut sizes = vec![0_u32; tree.n_points()];
    for position in 0..tree.n_points() {
        // Parents come before their children.
        if let Some(parent) = tree.parent(position as u32).filter(|_| !cuts.contains(position)) {
            tops[position] = tops[parent as usize];
        }
        sizes[tops[position] as usize] += 1;
    }
    let point = |position: u32| tree.order()[position as usize];
    let height = |position: u32| cloud.positions()[point(position) as usize].z;
    (tree.roots().par_iter())
        .map(|&root| {
            let largest = (tree.subtree(root)).fold(root, |largest, top| {
                if sizes[top as usize] > sizes[largest as usize] {
                    top
                } else {
                    largest
                }
            });
            let highest = (tree.subtree(root))
                .filter(|&position| tops[position as usize] == largest)
                .fold(largest, |highest, position| {
                    if height(position) > height(highest) {
                        position
                    } else {
                        highest
                    }
                });
            point(highest)
        })
        .collect()
}

/// Union-find over positions and the ground; each node knows whether its sign differs from that of the node above.
struct SignedParts {
    /// The node above, shifted up by one bit, and in the lowest bit whether the signs differ. A top is above itself.
    above: Vec<u64>,
}

impl SignedParts {
    fn new(n_points: usize) -> Self {
        Self {
            above: (0..=n_points as u64).map(|node| node << 1).collect(),
        }
    }

    /// The top of the part of `node`, and whether their signs differ.
    fn find(&mut self, node: u32) -> (u32, bool) {
        let mut top = node;
        let mut differs = 0;
        while self.above[top as usize] >> 1 != u64::from(top) {
            differs ^= self.above[top as usize] & 1;
            top = (self.above[top as usize] >> 1) as u32;
        }
        // Everything on the way now points at the top itself.
        let (mut at, mut left) = (node, differs);
        while at != top {
            let entry = self.above[at as usize];
            self.above[at as usize] = u64::from(top) << 1 | left;
            left ^= entry & 1;
            at = (entry >> 1) as u32;
        }
        (top, differs == 1)
    }

    /// Joins the parts of `a` and `b`, whose signs differ when `turn`; false when they are joined and it is the other way.
    fn join(&mut self, a: u32, b: u32, turn: bool) -> bool {
        let ((top_a, differs_a), (top_b, differs_b)) = (self.find(a), self.find(b));
        let differs = differs_a ^ differs_b ^ turn;
        if top_a == top_b {
            return !differs;
        }
        // The ground has the largest number and stays on top.
        let (low, high) = (top_a.min(top_b), top_a.max(top_b));
        self.above[low as usize] = u64::from(high) << 1 | u64::from(differs);
        true
    }

    /// Whether the signs of `a` and `b` differ; `None` when they are in different parts.
    fn relation(&mut self, a: u32, b: u32) -> Option<bool> {
        let ((top_a, differs_a), (top_b, differs_b)) = (self.find(a), self.find(b));
        (top_a == top_b).then_some(differs_a ^ differs_b)
    }
}
