//! The automatic method: signs by signed agglomeration with evidence, and the tree that they can be mended on.
//!
//! 1. Normals that keep to one sheet ([`sheet_normals`]).
//! 2. Evidence: views from outside, sheets counted along lines, scanner places, given normals ([`crate::evidence`]).
//! 3. Couplings of neighbors, learned from the evidence ([`edge_model`]).
//! 4. Agglomeration in parallel rounds, evidence taking part ([`agglomeration`]), refined coarse to fine ([`refinement`]).
//! 5. A second look with same-side neighbors ([`same_side`]), and 3 and 4 once more.
//!
//! The merges make the spanning tree: an edge's weight is the level at which its ends came together, so every cluster is a connected
//! part of the tree, and the heaviest edge on a path is the merge that was made last.
//!
//! Invariants: results do not depend on the number of threads, nor on the order of points but for ties.
//! Not here: which side of a component is the right one, see [`crate::side_rule`].

mod agglomeration;
mod cluster_graph;
mod edge_model;
mod refinement;
mod same_side;
mod sheet_normals;

#[cfg(test)]
mod tests;

use std::sync::atomic::AtomicI64;
use std::sync::atomic::Ordering::Relaxed;

use fixedbitset::FixedBitSet;
use glam::Vec3;
use rayon::prelude::*;

use self::agglomeration::{Agglomeration, agglomerate};
use self::cluster_graph::{COUPLING_UNIT, ClusterGraph, Pull};
use self::edge_model::{EdgeModel, Surface};
use self::refinement::refined_signs;
use self::same_side::{K_ROW, SecondLook, second_look};
use self::sheet_normals::{K_NOISY, SheetNormals, sheet_normals};
use crate::evidence::{self, Evidence, Known};
use crate::patches::Level;
use crate::progress::Part;
use crate::{Cancelled, Neighbors, Patches, PointCloud, Progress, RiemannianGraph, SpanningTree};

/// Neighbors that the method looks at.
pub(crate) const K: usize = K_NOISY;

/// Neighbors of each point in the first graph: more link the two sides of thin walls, fewer leave noise undecided.
const K_FIRST: usize = 8;

/// What the automatic method finds.
pub(crate) struct Automatic {
    /// `n` unit normals by point, oriented relative to each other within a component, each component as its evidence says.
    pub normals: Vec<Vec3>,
    /// What is known of their sides.
    pub evidence: Evidence,
    /// The tree of the merges; no sign turns along it.
    pub tree: SpanningTree,
    /// The clusters on the way.
    pub patches: Patches,
}

/// Estimates normals for [`orient`].
///
/// # Errors
/// [`Cancelled`] when `progress` asks to stop; nothing else.
pub(crate) fn estimate_normals(
    cloud: &PointCloud,
    neighbors: &Neighbors,
    radii: &[f32],
    progress: &dyn Progress,
) -> Result<Unoriented, Cancelled> {
    let SheetNormals { normals, noisy } = sheet_normals(cloud, neighbors, radii, progress)?;
    Ok(Unoriented { normals, noisy })
}

/// Normals of any sign, and which of them are noisy.
pub(crate) struct Unoriented {
    pub normals: Vec<Vec3>,
    noisy: Vec<bool>,
}

/// Gathers what is known of the sides of `normals`: sheets counted along lines, scanner places, and views from outside where
/// the lines say little, as of open surfaces. Given normals in `known` count as one
/// look each.
///
/// # Errors
/// [`Cancelled`] when `progress` asks to stop; nothing else.
pub(crate) fn gather_evidence(
    cloud: &PointCloud,
    neighbors: &Neighbors,
    radii: &[f32],
    normals: &[Vec3],
    known: &Known<'_>,
    progress: &dyn Progress,
) -> Result<Evidence, Cancelled> {
    let seen = known.has_scanner().then(|| evidence::scanner(cloud, normals, known));
    // The side that was seen is the right one of what was seen; lines and views from elsewhere meet others and would contradict.
    let seen = match seen {
        Some(seen) if seen.share_cast() >= MOSTLY_SEEN => return Ok(seen),
        seen => seen,
    };
    let n_axes = evidence::crossing_axes(cloud.n_points());
    let mut evidence = evidence::crossings(cloud, neighbors, radii, normals, n_axes, &Part::new(progress, 0.0..0.5))?;
    if cloud.n_points() <= FEW_POINTS || evidence.share_known() < MOSTLY_KNOWN {
        let part = Part::new(progress, 0.5..1.0);
        evidence.add(&evidence::outside_views(cloud, radii, normals, N_VIEWS, &part)?);
    }
    if let Some(seen) = &seen {
        evidence.add(seen);
    }
    if let Some(given) = known.given {
        // One look each: where they are wrong, what is seen outweighs them.
        evidence.add(&evidence::given(normals, given, 1.0));
    }
    Ok(evidence)
}

/// Share of points that scanners saw from known places from which on nothing else is asked: the rest follows its neighbors.
const MOSTLY_SEEN: f64 = 0.9;

/// Points up to which views from outside take no time to speak of; they mend single points of sparse clouds.
const FEW_POINTS: usize = 200_000;

/// Share of points with a vote from which on views from outside add nothing to dense clouds: the nearest sheet on each line is what they see.
const MOSTLY_KNOWN: f64 = 0.8;

/// Views from outside where they are needed. Beside crossings, 64 and 14 of them left as many normals wrong.
const N_VIEWS: usize = 26;

/// Finds the signs of `unoriented` normals and the tree of the merges.
///
/// # Errors
/// [`Cancelled`] when `progress` asks to stop; nothing else.
pub(crate) fn orient(
    cloud: &PointCloud,
    neighbors: Neighbors,
    radii: &[f32],
    unoriented: Unoriented,
    evidence: Evidence,
    progress: &dyn Progress,
) -> Result<Automatic, Cancelled> {
    let k_first = K_FIRST.min(neighbors.k());
    let first_rows: Vec<u32> = (0..cloud.n_points())
        .into_par_iter()
        .flat_map_iter(|point| neighbors.of(point)[..k_first].iter().copied())
        .collect();
    let surface = Surface {
        cloud,
        normals: &unoriented.normals,
        radii,
    };
    let first = solve(surface, &first_rows, k_first, &evidence, &Part::new(progress, 0.0..0.4))?;
    drop(first_rows);
    let turned = first.turned;
    drop(first.agglomeration);
    let SecondLook { normals, rows } = second_look(cloud, &neighbors, &unoriented.normals, &unoriented.noisy, &turned);
    drop(neighbors);
    drop(unoriented);
    let surface = Surface {
        cloud,
        normals: &normals,
        radii,
    };
    let second = solve(surface, &rows, K_ROW, &evidence, &Part::new(progress, 0.4..0.8))?;
    drop(rows);
    let Solution { agglomeration, turned } = second;
    let (tree, patches) = tree_of_merges(agglomeration, &turned, &Part::new(progress, 0.8..1.0))?;

    let mut normals = normals;
    let mut evidence = evidence;
    for point in turned.ones() {
        normals[point] = -normals[point];
    }
    evidence.turn(&turned);
    Ok(Automatic {
        normals,
        evidence,
        tree,
        patches,
    })
}

/// The merges, and which points turn.
struct Solution {
    agglomeration: Agglomeration,
    turned: FixedBitSet,
}

/// Couples neighbors, agglomerates and refines.
fn solve(
    surface: Surface<'_>,
    rows: &[u32],
    k: usize,
    evidence: &Evidence,
    progress: &dyn Progress,
) -> Result<Solution, Cancelled> {
    let model = EdgeModel::learn(surface, rows, k, evidence);
    progress.report(0.1)?;
    let pulls = evidence
        .votes()
        .par_iter()
        .map(|vote| Pull {
            signed: i64::from(vote.pull_in_units()),
            visible: i64::from(vote.weight.min(evidence::UNIT)),
        })
        .collect();
    let graph = ClusterGraph::of_points(rows, k, pulls, |a, b| model.coupling(surface, a, b));
    progress.report(0.3)?;
    let agglomeration = agglomerate(graph, &Part::new(progress, 0.3..0.8))?;
    let turned = refined_signs(&agglomeration, &Part::new(progress, 0.8..1.0))?;
    Ok(Solution { agglomeration, turned })
}

/// The spanning tree and the patches of an agglomeration whose `turned` points turn. O(edges · levels) at most, in parallel.
fn tree_of_merges(
    agglomeration: Agglomeration,
    turned: &FixedBitSet,
    progress: &dyn Progress,
) -> Result<(SpanningTree, Patches), Cancelled> {
    let Agglomeration { levels, components } = agglomeration;
    // Who became part of whom is all that is needed of the levels past the points.
    let mut sizes: Vec<usize> = levels.iter().map(|level| level.graph.n_clusters()).collect();
    sizes.push(components.n_clusters());
    drop(components);
    let mut points = None;
    let mut parents: Vec<Vec<u32>> = Vec::with_capacity(sizes.len());
    for level in levels {
        points.get_or_insert(level.graph);
        parents.push(level.parents);
    }
    // A satisfied and a whole sum by cluster and level: first of what became inner at the level, then of the boundary.
    let sums = |n_clusters: &usize| {
        (0..*n_clusters)
            .map(|_| [AtomicI64::new(0), AtomicI64::new(0)])
            .collect()
    };
    let boundaries: Vec<Vec<[AtomicI64; 2]>> = sizes.iter().map(sums).collect();
    let join = |point: usize, other: u32, coupling: i32| {
        let all = i64::from(coupling).abs();
        let agrees = (coupling > 0) == (turned.contains(point) == turned.contains(other as usize));
        let satisfied = if agrees { all } else { -all };
        let own = &boundaries[0][point];
        own[0].fetch_add(satisfied, Relaxed);
        own[1].fetch_add(all, Relaxed);
        if other < point as u32 {
            return None;
        }
        let (mut a, mut b, mut level) = (point as u32, other, 0);
        while a != b {
            (a, b) = (parents[level][a as usize], parents[level][b as usize]);
            level += 1;
        }
        let inner = &boundaries[level][a as usize];
        inner[0].fetch_sub(2 * satisfied, Relaxed);
        inner[1].fetch_sub(2 * all, Relaxed);
        // Within a level the edges that are satisfied best make the tree.
        let doubt = 0.5 - satisfied as f32 / (4 * COUPLING_UNIT) as f32;
        Some((point as u32, other, level as f32 + doubt.clamp(0.0, 0.99), false))
    };
    let edges: Vec<(u32, u32, f32, bool)> = match &points {
        None => Vec::new(),
        Some(points) => {
            let join = &join;
            (0..turned.len())
                .into_par_iter()
                .with_min_len(4096)
                .flat_map_iter(|point| {
                    let row = points.row(point);
                    row.filter_map(move |(other, coupling)| join(point, other, coupling))
                })
                .collect()
        }
    };
    drop(points);
    progress.report(0.3)?;
    // A boundary is that of the parts, without both sides of what became inner.
    for (level, parents) in parents.iter().enumerate() {
        for (cluster, &parent) in parents.iter().enumerate() {
            let sums = boundaries[level][cluster].iter().map(|sum| sum.load(Relaxed));
            for (sum, part) in boundaries[level + 1][parent as usize].iter().zip(sums) {
                sum.fetch_add(part, Relaxed);
            }
        }
    }
    let strength = |[satisfied, all]: &[AtomicI64; 2]| match all.load(Relaxed) {
        0 => 1.0,
        all => (satisfied.load(Relaxed) as f64 / all as f64) as f32,
    };
    let strengths: Vec<Vec<f32>> = (boundaries.iter())
        .map(|sums| sums.iter().map(strength).collect())
        .collect();
    drop(boundaries);
    let graph = RiemannianGraph::from_edges(turned.len(), &edges);
    drop(edges);
    let tree = SpanningTree::new(&graph, &Part::new(progress, 0.4..0.8))?;
    drop(graph);
    // The last level, the components, has no parents; when no points were joined, it is no level of its own.
    parents.push(Vec::new());
    let levels = parents.iter().zip(&strengths);
    let levels: Vec<Level<'_>> = levels
        .map(|(parents, strengths)| Level { parents, strengths })
        .collect();
    let patches = Patches::new(&tree, if levels.len() > 1 { &levels } else { &[] });
    Ok((tree, patches))
}
