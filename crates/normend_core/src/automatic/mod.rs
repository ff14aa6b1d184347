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

/// Gathers what is known of the sides of `normals`.
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
    let n_axes = evidence::crossing_axes(cloud.n_points());
    let mut evidence = evidence::crossings(cloud, neighbors, radii, normals, n_axes, &Part::new(progress, 0.0..0.5))?;
    let part = Part::new(progress, 0.5..1.0);
    evidence.add(&evidence::outside_views(
        cloud,
        radii,
        normals,
        n_views(cloud.n_points()),
        &part,
    )?);
    if !known.stations.is_empty() {
        evidence.add(&evidence::scanner(cloud, normals, known.stations));
    }
    Ok(evidence)
}

/// Views from outside. Large clouds have many points for each part of the surface, whose votes add up, so fewer views do.
fn n_views(n_points: usize) -> usize {
    if n_points > 300_000 { 14 } else { 26 }
}

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
    let (tree, patches) = tree_of_merges(&second, &Part::new(progress, 0.8..1.0))?;
    let Solution { turned, .. } = second;

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

/// The spanning tree and the patches of a solution. O(edges · levels) at most, in parallel.
fn tree_of_merges(solution: &Solution, progress: &dyn Progress) -> Result<(SpanningTree, Patches), Cancelled> {
    let Solution { agglomeration, turned } = solution;
    let levels = &agglomeration.levels;
    let n_points = turned.len();
    let Some(points) = levels.first() else {
        let tree = SpanningTree::new(&RiemannianGraph::from_edges(n_points, &[]), progress)?;
        let patches = Patches::new(&tree, &[]);
        return Ok((tree, patches));
    };
    // How well the boundary of each cluster is satisfied: what its parts have, without twice what became inner at its level.
    let sums = |clusters: usize| -> Vec<[AtomicI64; 2]> {
        (0..clusters).map(|_| [AtomicI64::new(0), AtomicI64::new(0)]).collect()
    };
    let n_clusters = |level: usize| {
        levels
            .get(level)
            .map_or(agglomeration.components.n_clusters(), |l| l.graph.n_clusters())
    };
    let boundaries: Vec<Vec<[AtomicI64; 2]>> = (0..=levels.len()).map(|level| sums(n_clusters(level))).collect();
    let edges: Vec<(u32, u32, f32, bool)> = (0..n_points)
        .into_par_iter()
        .with_min_len(4096)
        .flat_map_iter(|point| {
            let boundaries = &boundaries;
            points.graph.row(point).filter_map(move |(other, coupling)| {
                let coupling = i64::from(coupling);
                let satisfied = if turned.contains(point) == turned.contains(other as usize) {
                    coupling
                } else {
                    -coupling
                };
                let own = &boundaries[0][point];
                own[0].fetch_add(satisfied, Relaxed);
                own[1].fetch_add(coupling.abs(), Relaxed);
                if other < point as u32 {
                    return None;
                }
                let (mut a, mut b, mut level) = (point as u32, other, 0);
                while a != b {
                    a = levels[level].parents[a as usize];
                    b = levels[level].parents[b as usize];
                    level += 1;
                }
                let inner = &boundaries[level][a as usize];
                inner[0].fetch_sub(2 * satisfied, Relaxed);
                inner[1].fetch_sub(2 * coupling.abs(), Relaxed);
                // Within a level the best satisfied edges make the tree.
                let doubt = 0.5 - satisfied as f32 / (4 * COUPLING_UNIT) as f32;
                Some((point as u32, other, level as f32 + doubt.clamp(0.0, 0.99), false))
            })
        })
        .collect();
    progress.report(0.3)?;
    let mut strengths: Vec<Vec<f32>> = Vec::with_capacity(levels.len() + 1);
    for level in 0..=levels.len() {
        if level > 0 {
            for (cluster, &parent) in levels[level - 1].parents.iter().enumerate() {
                for part in 0..2 {
                    let sum = boundaries[level - 1][cluster][part].load(Relaxed);
                    boundaries[level][parent as usize][part].fetch_add(sum, Relaxed);
                }
            }
        }
        let strength = |[satisfied, all]: &[AtomicI64; 2]| match all.load(Relaxed) {
            0 => 1.0,
            all => (satisfied.load(Relaxed) as f64 / all as f64) as f32,
        };
        strengths.push(boundaries[level].iter().map(strength).collect());
    }
    drop(boundaries);
    let graph = RiemannianGraph::from_edges(n_points, &edges);
    drop(edges);
    let tree = SpanningTree::new(&graph, &Part::new(progress, 0.4..0.8))?;
    drop(graph);
    let none = Vec::new();
    let patch_levels: Vec<Level<'_>> = strengths
        .iter()
        .enumerate()
        .map(|(level, strengths)| Level {
            parents: levels.get(level).map_or(&none, |level| &level.parents),
            strengths,
        })
        .collect();
    let patches = Patches::new(&tree, &patch_levels);
    Ok((tree, patches))
}
