//! The Riemannian graph: symmetric union of the k-neighborhoods, with a weight and a sign for each edge.

use glam::{DVec3, Vec3};
use rayon::prelude::*;

use crate::progress::Steps;
use crate::{Cancelled, Neighbors, PointCloud, Progress};

/// How two neighbors' normals are compared across an edge.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum EdgeRule {
    /// The paper's: weight `1 − |n_i·n_j|`, the neighbor turns when `n_i·n_j < 0`.
    #[default]
    Dot,
    /// The neighbor as a mirror image across the edge `u`: `r = n_i·n_j − 2 (n_i·u)(n_j·u)` in place of the dot product.
    Reflection,
}

impl EdgeRule {
    /// All rules, in the order of menus.
    pub const ALL: [Self; 2] = [Self::Dot, Self::Reflection];

    /// The name on the command line and in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Dot => "dot",
            Self::Reflection => "reflection",
        }
    }

    /// The name in menus.
    pub fn label(self) -> &'static str {
        match self {
            Self::Dot => "Dot product",
            Self::Reflection => "Reflection",
        }
    }
}

/// One end's view of an undirected edge, 8 bytes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct HalfEdge {
    /// The other end.
    pub neighbor: u32,
    /// Bits of the weight, which is never negative, with "disagree" in the place of its sign.
    bits: u32,
}

const DISAGREE: u32 = 1 << 31;

impl HalfEdge {
    fn new(neighbor: u32, weight: f32, disagree: bool) -> Self {
        let sign = if disagree { DISAGREE } else { 0 };
        // NaN and -0 become 0 too, so that bits compare as weights do.
        let weight = if weight > 0.0 { weight } else { 0.0 };
        Self {
            neighbor,
            bits: weight.to_bits() | sign,
        }
    }

    /// Bits of the weight; they compare as the weights do.
    #[inline]
    pub fn weight_bits(self) -> u32 {
        self.bits & !DISAGREE
    }

    /// The weight.
    #[inline]
    pub fn weight(self) -> f32 {
        f32::from_bits(self.weight_bits())
    }

    /// Whether the normals of the ends disagree.
    #[inline]
    pub fn disagree(self) -> bool {
        self.bits & DISAGREE != 0
    }
}

/// An undirected graph over the points; each edge has a weight and says whether its ends' normals disagree.
///
/// Edges are in a total order (weight, smaller id, larger id), which makes the minimum spanning tree unique. Each edge
/// is stored once, in the row of one of its ends: 8 bytes an edge and 8 bytes a point.
#[derive(Clone, Debug)]
pub struct RiemannianGraph {
    /// `n + 1` offsets into `half_edges`.
    row_starts: Vec<usize>,
    half_edges: Vec<HalfEdge>,
}

impl RiemannianGraph {
    /// The union of the first `k` neighbors of each point, weighted by `rule` on `normals` (`n` unit vectors).
    ///
    /// The weight `1 − |c|` is computed as `|n_i ∓ n_j|² / 2`, which is the same for unit vectors and keeps its precision
    /// where normals are nearly parallel. O(n k²) time, parallel over points.
    ///
    /// # Errors
    /// [`Cancelled`] when `progress` asks to stop; nothing else.
    pub fn new(
        cloud: &PointCloud,
        neighbors: &Neighbors,
        k: usize,
        normals: &[Vec3],
        rule: EdgeRule,
        progress: &dyn Progress,
    ) -> Result<Self, Cancelled> {
        let n_points = cloud.n_points();
        let k = k.min(neighbors.k());
        let row = |point: usize| &neighbors.of(point)[..k];
        // An edge that both rows hold is stored at the smaller id.
        let stored = |point: usize, neighbor: u32| {
            point < neighbor as usize || !row(neighbor as usize).contains(&(point as u32))
        };
        let steps = Steps::new(progress, 2 * n_points);

        let mut row_starts = vec![0_usize; n_points + 1];
        row_starts[1..]
            .par_chunks_mut(ROWS)
            .enumerate()
            .try_for_each(|(chunk, lengths)| {
                for (i, length) in lengths.iter_mut().enumerate() {
                    let point = chunk * ROWS + i;
                    *length = row(point).iter().filter(|&&neighbor| stored(point, neighbor)).count();
                }
                steps.advance(lengths.len())
            })?;
        for i in 1..row_starts.len() {
            row_starts[i] += row_starts[i - 1];
        }

        let mut half_edges = vec![HalfEdge::default(); row_starts[n_points]];
        let chunks = split_at_rows(&mut half_edges, &row_starts);
        chunks.into_par_iter().try_for_each(|(first, chunk)| {
            let mut free = chunk.iter_mut();
            let last = (first + ROWS).min(n_points);
            for point in first..last {
                let kept = row(point).iter().filter(|&&neighbor| stored(point, neighbor));
                // The row comes first in the zip: it must not take a place of the next row when it ends.
                for (&neighbor, half_edge) in kept.zip(&mut free) {
                    let other = neighbor as usize;
                    let edge = cloud.offset(point, other);
                    let agreement = Agreement::between(rule, edge, normals[point], normals[other]);
                    *half_edge = HalfEdge::new(neighbor, agreement.weight, agreement.disagree);
                }
            }
            steps.advance(last - first)
        })?;
        Ok(Self { row_starts, half_edges })
    }

    /// A graph from explicit edges `(a, b, weight, disagree)`; for tests and other graphs than neighborhoods.
    ///
    /// Ends are less than `n_points`; an edge from a point to itself is left out. A weight that is negative or NaN counts as
    /// 0. Of several edges between the same two points the lightest counts, among equal ones an agreeing one.
    ///
    /// # Panics
    /// When an end is not less than `n_points`.
    pub fn from_edges(n_points: usize, edges: &[(u32, u32, f32, bool)]) -> Self {
        let mut sorted: Vec<(u32, HalfEdge)> = edges
            .iter()
            .filter(|(a, b, ..)| a != b)
            .map(|&(a, b, weight, disagree)| (a.min(b), HalfEdge::new(a.max(b), weight, disagree)))
            .collect();
        sorted.par_sort_unstable_by_key(|&(a, edge)| (a, edge.neighbor, edge.weight_bits(), edge.disagree()));
        sorted.dedup_by_key(|(a, edge)| (*a, edge.neighbor));
        assert!(
            sorted.iter().all(|(_, edge)| (edge.neighbor as usize) < n_points),
            "an edge ends past the last point"
        );
        let mut row_starts = vec![0_usize; n_points + 1];
        for &(a, _) in &sorted {
            row_starts[a as usize + 1] += 1;
        }
        for i in 1..row_starts.len() {
            row_starts[i] += row_starts[i - 1];
        }
        let half_edges = sorted.into_iter().map(|(_, edge)| edge).collect();
        Self { row_starts, half_edges }
    }

    /// Number of points.
    pub fn n_points(&self) -> usize {
        self.row_starts.len() - 1
    }

    /// Number of undirected edges.
    pub fn n_edges(&self) -> usize {
        self.half_edges.len()
    }

    /// All edges as `(a, b, weight, disagree)`, each once, in no particular order of its ends.
    pub fn edges(&self) -> impl Iterator<Item = (u32, u32, f32, bool)> {
        (0..self.n_points()).flat_map(move |point| {
            let row = self.row(point);
            row.iter()
                .map(move |edge| (point as u32, edge.neighbor, edge.weight(), edge.disagree()))
        })
    }

    /// The edges stored at `point`: each edge of the graph is in one row only.
    #[inline]
    pub(crate) fn row(&self, point: usize) -> &[HalfEdge] {
        &self.half_edges[self.row_starts[point]..self.row_starts[point + 1]]
    }

    /// The edge between `a` and `b` as either of them stores it.
    pub(crate) fn edge(&self, a: u32, b: u32) -> Option<HalfEdge> {
        let find = |from: u32, to: u32| self.row(from as usize).iter().find(|edge| edge.neighbor == to).copied();
        find(a, b).or_else(|| find(b, a))
    }
}

/// Rows that one task handles at a time.
const ROWS: usize = 4096;

/// Splits the flat `half_edges` every [`ROWS`] rows; each part comes with the point of its first row.
fn split_at_rows<'a>(mut half_edges: &'a mut [HalfEdge], row_starts: &[usize]) -> Vec<(usize, &'a mut [HalfEdge])> {
    let n_points = row_starts.len() - 1;
    let mut parts = Vec::with_capacity(n_points.div_ceil(ROWS));
    for first in (0..n_points).step_by(ROWS) {
        let last = (first + ROWS).min(n_points);
        let (part, rest) = half_edges.split_at_mut(row_starts[last] - row_starts[first]);
        parts.push((first, part));
        half_edges = rest;
    }
    parts
}

/// How two normals of arbitrary sign compare.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Agreement {
    /// `1 − |c|`, never negative.
    weight: f32,
    /// `c < 0`.
    disagree: bool,
}

impl Agreement {
    /// Compares the normals at the ends of an edge. Exchanging the ends gives the same.
    fn between(rule: EdgeRule, edge: DVec3, normal_a: Vec3, normal_b: Vec3) -> Self {
        let (normal_a, normal_b) = (normal_a.as_dvec3(), normal_b.as_dvec3());
        let expected = match rule {
            EdgeRule::Dot => normal_b,
            EdgeRule::Reflection => {
                // Two points in one place have no edge direction, and nothing to be mirrored in.
                let direction = edge.try_normalize().unwrap_or(DVec3::ZERO);
                normal_b - 2.0 * normal_b.dot(direction) * direction
            }
        };
        let disagree = normal_a.dot(expected) < 0.0;
        let chord = if disagree {
            normal_a + expected
        } else {
            normal_a - expected
        };
        Self {
            weight: (0.5 * chord.length_squared()) as f32,
            disagree,
        }
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use proptest::prelude::*;

    use super::*;

    /// Compares the normals at the ends `(position, normal)` of an edge.
    fn agreement(rule: EdgeRule, a: (Vec3, Vec3), b: (Vec3, Vec3)) -> Agreement {
        Agreement::between(rule, b.0.as_dvec3() - a.0.as_dvec3(), a.1, b.1)
    }
    use crate::Silent;

    fn any_vector() -> impl Strategy<Value = Vec3> {
        (-1.0_f32..1.0, -1.0_f32..1.0, -1.0_f32..1.0).prop_map(Vec3::from)
    }

    /// Positions with unit normals.
    fn any_cloud() -> impl Strategy<Value = Vec<(Vec3, Vec3)>> {
        let normal = any_vector().prop_filter_map("too short", |normal| normal.try_normalize());
        prop::collection::vec((any_vector(), normal), 2..60)
    }

    fn graph(points: &[(Vec3, Vec3)], k: usize, rule: EdgeRule) -> (Neighbors, RiemannianGraph) {
        let (positions, normals): (Vec<Vec3>, Vec<Vec3>) = points.iter().copied().unzip();
        let cloud = PointCloud::new(DVec3::ZERO, positions).unwrap();
        let neighbors = Neighbors::find(&cloud, 12, &Silent).unwrap();
        let graph = RiemannianGraph::new(&cloud, &neighbors, k, &normals, rule, &Silent).unwrap();
        (neighbors, graph)
    }

    proptest! {
        #[test]
        fn is_the_union_of_the_neighborhoods(points in any_cloud(), k in 1_usize..10) {
            let (neighbors, graph) = graph(&points, k, EdgeRule::Dot);
            let mut expect = BTreeMap::new();
            for point in 0..points.len() {
                for &neighbor in neighbors.of(point).iter().take(k) {
                    let ends = (neighbor.min(point as u32), neighbor.max(point as u32));
                    expect.insert(ends, points[point].1.dot(points[neighbor as usize].1));
                }
            }
            prop_assert_eq!(graph.n_edges(), expect.len());
            for (a, b, weight, disagree) in graph.edges() {
                let dot = expect.remove(&(a.min(b), a.max(b)));
                prop_assert!(dot.is_some());
                let dot = dot.unwrap();
                prop_assert!((weight - (1.0 - dot.abs())).abs() < 1e-6);
                prop_assert!(disagree == (dot < 0.0) || dot.abs() < 1e-6);
                prop_assert_eq!(graph.edge(a, b), graph.edge(b, a).map(|edge| HalfEdge { neighbor: b, ..edge }));
            }
        }

        #[test]
        fn reflection_mirrors_across_the_edge(points in any_cloud()) {
            let (_, graph) = graph(&points, 5, EdgeRule::Reflection);
            for (a, b, weight, disagree) in graph.edges() {
                let ((p, n), (q, m)) = (points[a as usize], points[b as usize]);
                let direction = (q - p).normalize_or_zero();
                let r = n.dot(m) - 2.0 * n.dot(direction) * m.dot(direction);
                prop_assert!((weight - (1.0 - r.abs())).abs() < 1e-5);
                prop_assert!(disagree == (r < 0.0) || r.abs() < 1e-5);
            }
        }

        #[test]
        fn an_edge_is_the_same_from_both_ends(a in any_cloud(), b in any_cloud()) {
            for rule in EdgeRule::ALL {
                let (there, back) = (agreement(rule, a[0], b[0]), agreement(rule, b[0], a[0]));
                prop_assert_eq!(there.disagree, back.disagree);
                prop_assert!((there.weight - back.weight).abs() <= 1e-6 * there.weight);
            }
        }
    }

    #[test]
    fn nearly_parallel_normals_keep_their_order() {
        // 1 − |c| rounds to the same f32 for both angles.
        let at = |angle: f32| (Vec3::X * angle, Vec3::new(angle.sin(), 0.0, angle.cos()));
        let weight = |angle: f32| agreement(EdgeRule::Dot, at(0.0), at(angle)).weight;
        assert!(weight(1e-5) < weight(2e-5));
        assert!((weight(1e-3) / 5e-7 - 1.0).abs() < 1e-3);
    }

    #[test]
    fn points_in_one_place_compare_by_the_dot_product() {
        let (a, b) = ((Vec3::ONE, Vec3::Z), (Vec3::ONE, Vec3::NEG_Z));
        let expect = Agreement {
            weight: 0.0,
            disagree: true,
        };
        assert_eq!(agreement(EdgeRule::Reflection, a, b), expect);
        // Across a thin wall the mirror image agrees.
        let b = (Vec3::new(1.0, 1.0, 0.9), Vec3::NEG_Z);
        let expect = Agreement {
            weight: 0.0,
            disagree: false,
        };
        assert_eq!(agreement(EdgeRule::Reflection, a, b), expect);
    }

    #[test]
    fn explicit_edges_are_cleaned() {
        let edges = [
            (2, 1, 0.5, false),
            (1, 2, 0.25, true),
            (1, 2, 0.25, false),
            (0, 0, 0.0, false),
            (0, 2, f32::NAN, true),
            (1, 0, -3.0, false),
        ];
        let graph = RiemannianGraph::from_edges(3, &edges);
        let found: Vec<_> = graph.edges().collect();
        assert_eq!(found, [(0, 1, 0.0, false), (0, 2, 0.0, true), (1, 2, 0.25, false)]);
    }
}
