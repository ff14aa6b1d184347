//! Borůvka's minimum spanning forest, in parallel, straight on the rows of the graph.
//!
//! Components are the trees of a union-find forest over the points. In each round every component finds its lightest
//! edge to another one; those edges are all in the minimum spanning forest, because the order of edges is total. The
//! minima are atomic, so the result does not depend on the number of threads.

use std::sync::atomic::{AtomicU32, AtomicU64, Ordering::Relaxed};

use rayon::prelude::*;

use super::TreeEdge;
use crate::riemannian_graph::HalfEdge;
use crate::{Cancelled, Progress, RiemannianGraph};

/// No edge: heavier than any.
const NO_WEIGHT: u32 = u32::MAX;
const NO_EDGE: u64 = u64::MAX;

/// Points that one task handles at a time.
const POINTS: usize = 8192;

/// The edges of the minimum spanning forest in the total order (weight, smaller id, larger id); `n − components` of them.
pub(super) fn minimum_spanning_forest(
    graph: &RiemannianGraph,
    progress: &dyn Progress,
) -> Result<Vec<TreeEdge>, Cancelled> {
    let n_points = graph.n_points();
    let forest = Components::new(n_points);
    let lightest_weights: Vec<AtomicU32> = (0..n_points).map(|_| AtomicU32::new(NO_WEIGHT)).collect();
    let lightest_edges: Vec<AtomicU64> = (0..n_points).map(|_| AtomicU64::new(NO_EDGE)).collect();
    let mut components: Vec<u32> = (0..n_points as u32).collect();
    // Points with an edge in their row that may still lead out of their component.
    let mut active: Vec<u32> = components.clone();
    let mut edges = Vec::with_capacity(n_points.saturating_sub(1));

    loop {
        progress.report(edges.len() as f32 / n_points.max(1) as f32)?;
        // The weights first, then among the edges of that weight the ids: 96 bits do not fit into one atomic.
        active = active
            .par_chunks(POINTS)
            .map(|points| {
                progress.report(edges.len() as f32 / n_points as f32)?;
                let mut still_active = Vec::with_capacity(points.len());
                for &point in points {
                    let mut leads_out = false;
                    for_each_edge_out(graph, &forest, point, |edge, ends| {
                        leads_out = true;
                        for component in ends {
                            fetch_min_u32(&lightest_weights[component as usize], edge.weight_bits());
                        }
                    });
                    if leads_out {
                        still_active.push(point);
                    }
                }
                Ok(still_active)
            })
            .collect::<Result<Vec<_>, Cancelled>>()?
            .concat();
        active.par_chunks(POINTS).try_for_each(|points| {
            for &point in points {
                for_each_edge_out(graph, &forest, point, |edge, ends| {
                    for component in ends {
                        let component = component as usize;
                        if lightest_weights[component].load(Relaxed) == edge.weight_bits() {
                            fetch_min_u64(&lightest_edges[component], pack(point, edge.neighbor));
                        }
                    }
                });
            }
            progress.report(edges.len() as f32 / n_points as f32)
        })?;

        // Who joins whom. Two components that chose the same edge join once, into the one with the smaller id.
        let joins: Vec<Join> = components
            .par_iter()
            .filter_map(|&component| {
                let edge = lightest_edges[component as usize].load(Relaxed);
                if edge == NO_EDGE {
                    return None;
                }
                let (a, b) = unpack(edge);
                let (root_a, root_b) = (forest.find(a), forest.find(b));
                let other = if root_a == component { root_b } else { root_a };
                let mutual = lightest_edges[other as usize].load(Relaxed) == edge;
                (!mutual || other < component).then_some(Join { component, other, edge })
            })
            .collect();
        if joins.is_empty() {
            break;
        }
        joins
            .par_iter()
            .for_each(|join| forest.hook(join.component, join.other));
        forest.shorten(&joins);
        components.par_iter().for_each(|&component| {
            lightest_weights[component as usize].store(NO_WEIGHT, Relaxed);
            lightest_edges[component as usize].store(NO_EDGE, Relaxed);
        });
        components = components
            .into_par_iter()
            .filter(|&component| forest.is_root(component))
            .collect();
        edges.extend(joins.iter().map(|join| join.edge));
    }

    Ok(edges
        .into_par_iter()
        .filter_map(|edge| {
            let (a, b) = unpack(edge);
            // Each edge comes from a row, so `edge` finds it.
            let half = graph.edge(a, b)?;
            Some(TreeEdge {
                a,
                b,
                weight: half.weight(),
                disagree: half.disagree(),
            })
        })
        .collect())
}

/// A component gives up its own root for that of another one.
struct Join {
    component: u32,
    other: u32,
    edge: u64,
}

/// Calls `visit(edge, components of its ends)` for the edges stored at `point` that lead out of its component.
#[inline]
fn for_each_edge_out(
    graph: &RiemannianGraph,
    forest: &Components,
    point: u32,
    mut visit: impl FnMut(HalfEdge, [u32; 2]),
) {
    let row = graph.row(point as usize);
    if row.is_empty() {
        return;
    }
    let own = forest.find(point);
    for &edge in row {
        let other = forest.find(edge.neighbor);
        if other != own {
            visit(edge, [own, other]);
        }
    }
}

/// The components as trees of points; the root of each tree names the component.
struct Components {
    parents: Vec<AtomicU32>,
}

impl Components {
    fn new(n_points: usize) -> Self {
        Self {
            parents: (0..n_points as u32).map(AtomicU32::new).collect(),
        }
    }

    /// The root above `point`. Roots change only between the parallel passes; within one, every store is an ancestor,
    /// so all threads find the same root.
    #[inline]
    fn find(&self, point: u32) -> u32 {
        let mut at = point;
        loop {
            let parent = self.parents[at as usize].load(Relaxed);
            if parent == at {
                break;
            }
            at = parent;
        }
        let root = at;
        let mut at = point;
        while at != root {
            let parent = self.parents[at as usize].load(Relaxed);
            if parent != root {
                self.parents[at as usize].store(root, Relaxed);
            }
            at = parent;
        }
        root
    }

    fn is_root(&self, point: u32) -> bool {
        self.parents[point as usize].load(Relaxed) == point
    }

    fn hook(&self, component: u32, other: u32) {
        self.parents[component as usize].store(other, Relaxed);
    }

    /// Halves the paths of joined components until each points at its root: chains of joins can be as long as there
    /// are components, and nobody should climb them link by link.
    fn shorten(&self, joins: &[Join]) {
        let mut changed = true;
        while changed {
            changed = joins
                .par_iter()
                .map(|join| {
                    let parent = self.parents[join.component as usize].load(Relaxed);
                    let above = self.parents[parent as usize].load(Relaxed);
                    self.parents[join.component as usize].store(above, Relaxed);
                    parent != above
                })
                .reduce(|| false, |a, b| a | b);
        }
    }
}

/// `fetch_min` that only writes when there is something to write: most calls change nothing.
#[inline]
fn fetch_min_u32(minimum: &AtomicU32, value: u32) {
    if value < minimum.load(Relaxed) {
        minimum.fetch_min(value, Relaxed);
    }
}

#[inline]
fn fetch_min_u64(minimum: &AtomicU64, value: u64) {
    if value < minimum.load(Relaxed) {
        minimum.fetch_min(value, Relaxed);
    }
}

/// Both ends of an edge in one word that compares as (smaller id, larger id).
#[inline]
fn pack(a: u32, b: u32) -> u64 {
    u64::from(a.min(b)) << 32 | u64::from(a.max(b))
}

fn unpack(edge: u64) -> (u32, u32) {
    ((edge >> 32) as u32, edge as u32)
}
