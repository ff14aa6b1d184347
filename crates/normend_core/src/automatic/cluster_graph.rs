//! The signed graph of clusters: how strongly each two neighboring clusters belong together as they are, or with one turned.

use std::sync::atomic::AtomicU32;
use std::sync::atomic::Ordering::Relaxed;

use fixedbitset::FixedBitSet;
use rayon::prelude::*;

use crate::evidence::UNIT;

/// A coupling of one: an edge whose ends certainly belong together. The same unit as that of evidence, so that both add up.
pub(super) const COUPLING_UNIT: i32 = UNIT;

/// What is known of a cluster's side besides its neighbors, summed over its points, in units of 1/[`UNIT`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Pull {
    /// For the present side, minus those against it.
    pub signed: i64,
    /// Of all points together: at most one each.
    pub visible: i64,
}

impl Pull {
    /// How strongly the cluster wants to be as it is (positive) or turned: the signed sum, weakened by the square of how far its
    /// points agree. So a sheet that is seen from both sides pulls nowhere.
    pub fn strength(self) -> i64 {
        if self.visible == 0 {
            return 0;
        }
        let agreement = self.signed as f64 / self.visible as f64;
        (self.signed as f64 * agreement * agreement).round() as i64
    }
}

/// Clusters with their couplings to neighbors, each edge in the rows of both ends. 8 bytes for each end of an edge, 20 for
/// each cluster.
#[derive(Clone, Debug)]
pub(super) struct ClusterGraph {
    starts: Vec<u32>,
    neighbors: Vec<u32>,
    couplings: Vec<i32>,
    pulls: Vec<Pull>,
}

/// Rows that one task handles at a time.
const ROWS: usize = 4096;

impl ClusterGraph {
    /// The graph of points: `n` rows of neighbors, at most `k` each, [`u32::MAX`] where a row is shorter; two points are coupled when
    /// one is in the other's row. `coupling` must not depend on the order of its ends and is never 0.
    pub fn of_points(rows: &[u32], k: usize, pulls: Vec<Pull>, coupling: impl Fn(u32, u32) -> i32 + Sync) -> Self {
        let n_points = pulls.len();
        let row = |point: usize| {
            rows[point * k..(point + 1) * k]
                .iter()
                .copied()
                .filter(|&other| other != u32::MAX)
        };
        let one_sided = |point: usize, other: u32| !row(other as usize).any(|back| back == point as u32);
        // Who names this point without being named: found from the other end, so counted and filled in no fixed order, then sorted.
        let named = counters(n_points);
        (0..n_points).into_par_iter().for_each(|point| {
            for other in row(point).filter(|&other| one_sided(point, other)) {
                named[other as usize].fetch_add(1, Relaxed);
            }
        });
        let mut starts = vec![0_u32; n_points + 1];
        for point in 0..n_points {
            let own = row(point).count() as u32;
            starts[point + 1] = starts[point] + own + named[point].load(Relaxed);
            named[point].store(starts[point] + own, Relaxed);
        }
        let filled = counters(starts[n_points] as usize);
        (0..n_points).into_par_iter().for_each(|point| {
            for (place, other) in (starts[point]..).zip(row(point)) {
                filled[place as usize].store(other, Relaxed);
                if one_sided(point, other) {
                    let place = named[other as usize].fetch_add(1, Relaxed);
                    filled[place as usize].store(point as u32, Relaxed);
                }
            }
        });
        drop(named);
        let mut neighbors: Vec<u32> = filled.into_iter().map(AtomicU32::into_inner).collect();
        let mut couplings = vec![0_i32; neighbors.len()];
        let parts = split_rows(&starts, &mut neighbors, &mut couplings);
        parts.into_par_iter().for_each(|(first, neighbors, couplings)| {
            let base = starts[first] as usize;
            for point in first..(first + ROWS).min(n_points) {
                let range = starts[point] as usize - base..starts[point + 1] as usize - base;
                neighbors[range.clone()].sort_unstable();
                for place in range {
                    couplings[place] = coupling(point as u32, neighbors[place]);
                }
            }
        });
        Self {
            starts,
            neighbors,
            couplings,
            pulls,
        }
    }

    /// Number of clusters.
    pub fn n_clusters(&self) -> usize {
        self.pulls.len()
    }

    /// Number of edges, each counted from both ends.
    pub fn n_edge_ends(&self) -> usize {
        self.neighbors.len()
    }

    /// The neighbors of a cluster with their couplings, ascending by neighbor.
    #[inline]
    pub fn row(&self, cluster: usize) -> impl Iterator<Item = (u32, i32)> {
        let range = self.starts[cluster] as usize..self.starts[cluster + 1] as usize;
        self.neighbors[range.clone()]
            .iter()
            .copied()
            .zip(self.couplings[range].iter().copied())
    }

    /// What is known of each cluster's side.
    pub fn pulls(&self) -> &[Pull] {
        &self.pulls
    }

    /// Joins clusters: `parents` names the joined one of each, of `n_parents`; those in `turned` are turned over before. Couplings
    /// between the same two joined clusters add up. O(edges log row), in parallel.
    pub fn contract(&self, parents: &[u32], n_parents: usize, turned: &FixedBitSet) -> Self {
        let mut member_starts = vec![0_u32; n_parents + 1];
        for &parent in parents {
            member_starts[parent as usize + 1] += 1;
        }
        for parent in 0..n_parents {
            member_starts[parent + 1] += member_starts[parent];
        }
        let mut free = member_starts.clone();
        let mut members = vec![0_u32; parents.len()];
        for (cluster, &parent) in (0_u32..).zip(parents) {
            members[free[parent as usize] as usize] = cluster;
            free[parent as usize] += 1;
        }
        drop(free);
        let sign = |cluster: usize| if turned.contains(cluster) { -1_i64 } else { 1 };
        let joined: Vec<JoinedRows> = (0..n_parents.div_ceil(ROWS))
            .into_par_iter()
            .map(|task| {
                let mut rows = JoinedRows::default();
                let mut gathered: Vec<(u32, i64)> = Vec::new();
                for parent in task * ROWS..((task + 1) * ROWS).min(n_parents) {
                    gathered.clear();
                    let mut pull = Pull::default();
                    for &member in &members[member_starts[parent] as usize..member_starts[parent + 1] as usize] {
                        let member = member as usize;
                        pull.signed += sign(member) * self.pulls[member].signed;
                        pull.visible += self.pulls[member].visible;
                        for (neighbor, coupling) in self.row(member) {
                            let other = parents[neighbor as usize];
                            if other as usize != parent {
                                let sign = sign(member) * sign(neighbor as usize);
                                gathered.push((other, sign * i64::from(coupling)));
                            }
                        }
                    }
                    gathered.sort_unstable_by_key(|&(other, _)| other);
                    let mut length = 0;
                    for same in gathered.chunk_by(|a, b| a.0 == b.0) {
                        let sum: i64 = same.iter().map(|&(_, coupling)| coupling).sum();
                        rows.neighbors.push(same[0].0);
                        rows.couplings
                            .push(sum.clamp(-i64::from(i32::MAX), i64::from(i32::MAX)) as i32);
                        length += 1;
                    }
                    rows.lengths.push(length);
                    rows.pulls.push(pull);
                }
                rows
            })
            .collect();
        let mut graph = Self {
            starts: Vec::with_capacity(n_parents + 1),
            neighbors: Vec::with_capacity(joined.iter().map(|rows| rows.neighbors.len()).sum()),
            couplings: Vec::with_capacity(joined.iter().map(|rows| rows.neighbors.len()).sum()),
            pulls: Vec::with_capacity(n_parents),
        };
        graph.starts.push(0);
        let mut end = 0;
        for rows in joined {
            for length in rows.lengths {
                end += length;
                graph.starts.push(end);
            }
            graph.neighbors.extend(rows.neighbors);
            graph.couplings.extend(rows.couplings);
            graph.pulls.extend(rows.pulls);
        }
        graph
    }
}

/// What one task of [`ClusterGraph::contract`] makes.
#[derive(Default)]
struct JoinedRows {
    lengths: Vec<u32>,
    neighbors: Vec<u32>,
    couplings: Vec<i32>,
    pulls: Vec<Pull>,
}

fn counters(length: usize) -> Vec<AtomicU32> {
    (0..length).map(|_| AtomicU32::new(0)).collect()
}

/// Splits two arrays of row entries every [`ROWS`] rows; each part comes with its first row.
fn split_rows<'a>(
    starts: &[u32],
    mut neighbors: &'a mut [u32],
    mut couplings: &'a mut [i32],
) -> Vec<(usize, &'a mut [u32], &'a mut [i32])> {
    let n_rows = starts.len() - 1;
    let mut parts = Vec::with_capacity(n_rows.div_ceil(ROWS));
    for first in (0..n_rows).step_by(ROWS) {
        let length = (starts[(first + ROWS).min(n_rows)] - starts[first]) as usize;
        let (a, rest_a) = neighbors.split_at_mut(length);
        let (b, rest_b) = couplings.split_at_mut(length);
        parts.push((first, a, b));
        (neighbors, couplings) = (rest_a, rest_b);
    }
    parts
}
