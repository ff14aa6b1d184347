//! Signed agglomeration: clusters that are surest to belong together are joined first, turned over where that fits.
//!
//! The sign of one edge across a thin wall says little, the sum over a seam says much: so couplings are added up while clusters
//! grow (greedy additive contraction of a signed graph). Rounds instead of one merge at a time: in each round every cluster
//! takes its strongest coupling, and those that chose each other are joined, in parallel.
//!
//! Invariants: every cluster is connected in the graph; its points' signs relative to each other are those that were chosen when it
//! was joined; results do not depend on the number of threads.

use fixedbitset::FixedBitSet;
use rayon::prelude::*;

use super::cluster_graph::ClusterGraph;
use crate::Cancelled;
use crate::progress::Progress;

/// One level of the agglomeration: clusters, their couplings, and what becomes of them.
#[derive(Debug)]
pub(super) struct Level {
    pub graph: ClusterGraph,
    /// The cluster of the next level that each becomes part of.
    pub parents: Vec<u32>,
    /// Clusters that are turned over when they are joined.
    pub turned: FixedBitSet,
}

/// All levels: the points first, then clusters up to the connected components.
#[derive(Debug)]
pub(super) struct Agglomeration {
    pub levels: Vec<Level>,
    /// The components.
    pub components: ClusterGraph,
}

/// A round that joins fewer clusters than this share is followed by one that joins all with their strongest neighbor: chains of
/// unequal clusters would take a round for each otherwise.
const LEAST_JOINED: f64 = 0.15;

/// Clusters that one task handles at a time.
const CLUSTERS: usize = 4096;

/// The strongest coupling of a cluster.
#[derive(Clone, Copy, Debug)]
struct Best {
    /// [`NOBODY`] for a cluster without neighbors.
    neighbor: u32,
    coupling: i64,
    /// Whether it is at least half of all couplings together: then nothing that happens to the others can outweigh it.
    outweighs: bool,
}

const NOBODY: u32 = u32::MAX;

/// Joins clusters, the points of `graph` first, until only components are left.
///
/// # Errors
/// [`Cancelled`] when `progress` asks to stop; nothing else.
pub(super) fn agglomerate(mut graph: ClusterGraph, progress: &dyn Progress) -> Result<Agglomeration, Cancelled> {
    let all = graph.n_edge_ends().max(1) as f32;
    let mut levels = Vec::new();
    while graph.n_edge_ends() > 0 {
        progress.report(1.0 - graph.n_edge_ends() as f32 / all)?;
        let best = strongest_couplings(&graph);
        let (parents, n_parents, turned) = join(&best);
        let next = graph.contract(&parents, n_parents, &turned);
        levels.push(Level { graph, parents, turned });
        graph = next;
    }
    Ok(Agglomeration {
        levels,
        components: graph,
    })
}

/// The coupling with what is known of both clusters' sides: evidence acts in series, through the outside that both are pulled to or
/// away from, so it is as strong as the weaker of the two.
fn with_evidence(coupling: i32, a: i64, b: i64) -> i64 {
    let series = a.abs().min(b.abs());
    i64::from(coupling) + if (a < 0) == (b < 0) { series } else { -series }
}

fn strongest_couplings(graph: &ClusterGraph) -> Vec<Best> {
    let pulls: Vec<i64> = graph.pulls().par_iter().map(|pull| pull.strength()).collect();
    (0..graph.n_clusters())
        .into_par_iter()
        .with_min_len(CLUSTERS)
        .map(|cluster| {
            let mut best = Best {
                neighbor: NOBODY,
                coupling: 0,
                outweighs: false,
            };
            let mut rank = (0, (0, 0));
            let mut sum = 0;
            for (neighbor, coupling) in graph.row(cluster) {
                let coupling = with_evidence(coupling, pulls[cluster], pulls[neighbor as usize]);
                sum += coupling.abs();
                let its_rank = (coupling.abs(), tie(cluster as u32, neighbor));
                if best.neighbor == NOBODY || its_rank > rank {
                    rank = its_rank;
                    (best.neighbor, best.coupling) = (neighbor, coupling);
                }
            }
            best.outweighs = best.neighbor != NOBODY && 2 * best.coupling.abs() >= sum;
            best
        })
        .collect()
}

/// Breaks ties between couplings, the same from both ends: then the strongest of all couplings is chosen from both.
fn tie(a: u32, b: u32) -> (u32, u32) {
    let (a, b) = (a.min(b), a.max(b));
    // Mixed, so that on a lattice of equal couplings not everyone chooses the neighbor on the same side.
    let mixed = (a.wrapping_mul(0x9E37_79B1) ^ b.wrapping_mul(0x85EB_CA77)).wrapping_mul(0xC2B2_AE3D);
    (mixed, a)
}

/// Who is joined with whom: the parent of each cluster, the number of parents, and who is turned over.
fn join(best: &[Best]) -> (Vec<u32>, usize, FixedBitSet) {
    let mutual = |cluster: usize| {
        let other = best[cluster].neighbor;
        other != NOBODY && best[other as usize].neighbor == cluster as u32
    };
    let follows = |cluster: usize, all: bool| {
        let choice = best[cluster];
        let leads = mutual(cluster) && (cluster as u32) < choice.neighbor;
        choice.neighbor != NOBODY && !leads && (all || choice.outweighs || mutual(cluster))
    };
    let n_joined = (0..best.len())
        .into_par_iter()
        .filter(|&cluster| follows(cluster, false))
        .count();
    let all = (n_joined as f64) < LEAST_JOINED * best.len() as f64;

    // Each follows its choice up to one that follows nobody. Choices form no rings but pairs, as both ends rank couplings alike.
    let mut parents = vec![NOBODY; best.len()];
    let mut turned = FixedBitSet::with_capacity(best.len());
    let mut n_parents = 0;
    let mut path = Vec::new();
    for cluster in 0..best.len() {
        let mut at = cluster;
        while parents[at] == NOBODY && follows(at, all) {
            path.push(at);
            at = best[at].neighbor as usize;
        }
        if parents[at] == NOBODY {
            parents[at] = n_parents;
            n_parents += 1;
        }
        while let Some(follower) = path.pop() {
            parents[follower] = parents[at];
            turned.set(follower, turned.contains(at) ^ (best[follower].coupling < 0));
            at = follower;
        }
    }
    (parents, n_parents as usize, turned)
}
