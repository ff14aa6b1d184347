//! Signs from an agglomeration, refined from coarse to fine: single clusters turn where that fits couplings and evidence better.

use fixedbitset::FixedBitSet;
use rayon::prelude::*;

use super::agglomeration::Agglomeration;
use super::cluster_graph::ClusterGraph;
use crate::Cancelled;
use crate::progress::Progress;

/// Sweeps over one level. Almost all that turn do so in the first; a chain of turns may take some more.
const SWEEPS: usize = 10;

/// The points that must turn, each component with the side that its evidence asks for.
///
/// Lowers the energy `−Σ J s s − Σ u s` of couplings J and pulls u over the clusters of each level, coarse to fine.
///
/// # Errors
/// [`Cancelled`] when `progress` asks to stop; nothing else.
pub(super) fn refined_signs(agglomeration: &Agglomeration, progress: &dyn Progress) -> Result<FixedBitSet, Cancelled> {
    let components = &agglomeration.components;
    let mut turned = FixedBitSet::with_capacity(components.n_clusters());
    for (component, pull) in components.pulls().iter().enumerate() {
        turned.set(component, pull.signed < 0);
    }
    let n_levels = agglomeration.levels.len();
    for (index, level) in agglomeration.levels.iter().enumerate().rev() {
        progress.report(1.0 - index as f32 / n_levels as f32)?;
        let mut finer = level.turned.clone();
        for (cluster, &parent) in level.parents.iter().enumerate() {
            if turned.contains(parent as usize) {
                finer.toggle(cluster);
            }
        }
        refine(&level.graph, &mut finer);
        turned = finer;
    }
    Ok(turned)
}

/// Turns clusters that fit better on their other side, each time those that gain more than all their neighbors that would turn
/// too, so no two turn against each other and the order of clusters does not matter.
fn refine(graph: &ClusterGraph, turned: &mut FixedBitSet) {
    let gain = |cluster: u32, turned: &FixedBitSet| -> i64 {
        let field: i64 = graph
            .row(cluster as usize)
            .map(|(neighbor, coupling)| {
                let coupling = i64::from(coupling);
                if turned.contains(neighbor as usize) {
                    -coupling
                } else {
                    coupling
                }
            })
            .sum();
        let field = field + graph.pulls()[cluster as usize].strength();
        if turned.contains(cluster as usize) {
            field
        } else {
            -field
        }
    };
    let mut touched: Vec<u32> = (0..graph.n_clusters() as u32).collect();
    let mut gains = vec![0_i64; graph.n_clusters()];
    let mut candidates: Vec<u32> = Vec::new();
    for _ in 0..SWEEPS {
        let fresh: Vec<i64> = touched
            .par_iter()
            .with_min_len(1024)
            .map(|&cluster| gain(cluster, turned))
            .collect();
        for (&cluster, gain) in touched.iter().zip(fresh) {
            gains[cluster as usize] = gain.max(0);
        }
        candidates.append(&mut touched);
        candidates.retain(|&cluster| gains[cluster as usize] > 0);
        candidates.par_sort_unstable();
        candidates.dedup();
        let turning: Vec<u32> = candidates
            .par_iter()
            .copied()
            .filter(|&cluster| {
                let own = (gains[cluster as usize], cluster);
                graph
                    .row(cluster as usize)
                    .all(|(other, _)| (gains[other as usize], other) < own)
            })
            .collect();
        if turning.is_empty() {
            return;
        }
        for &cluster in &turning {
            turned.toggle(cluster as usize);
            touched.push(cluster);
            touched.extend(graph.row(cluster as usize).map(|(other, _)| other));
        }
        touched.par_sort_unstable();
        touched.dedup();
    }
}
