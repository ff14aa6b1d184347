//! Which side of every sheet is outward, hidden ones too: a line from outside enters a closed body at the first sheet that
//! it crosses, leaves it at the second, and so on.
//!
//! Lines are the pixels of a parallel projection. Discs are drawn into a picture that keeps all of them, band of rows by band
//! of rows ([`bands`]); at each pixel they are grouped into sheets, which vote ([`sheets`]).

mod bands;
mod sheets;
#[cfg(test)]
mod tests;

use std::sync::atomic::{AtomicI64, AtomicUsize, Ordering::Relaxed};

use glam::Vec3;
use rayon::prelude::*;

use self::bands::Bands;
use self::sheets::{Lines, TOLERANCES};
use super::outside_views::{View, Weights, axes};
use super::scene::{MAX_LOOKS, Scene};
use super::{Evidence, Origin, Vote};
use crate::progress::{Part, Steps};
use crate::{Cancelled, Neighbors, PointCloud, Progress};

/// Side of a pixel in median spacings. Discs are two and a half spacings wide, so a sheet is hit by several of them on each
/// line, and a hole in it is rare; finer pixels cost more and vote the same.
const PIXEL: f32 = 1.0;

/// Votes of a neighborhood that a tolerance gets some trust from, and all: `|signed| / weight`. Random votes of a few
/// lines have about a half, and where one line in ten goes wrong four fifths are left.
const TRUST: [f32; 2] = [0.5, 0.8];

/// Neighbors that vouch for a tolerance at most: more cost time, and reach over to the next sheet.
const MOST_NEIGHBORS: usize = 32;

/// The most axes, for clouds where time does not matter.
const MOST_AXES: usize = MAX_LOOKS;

/// How many axes are worth their time for a cloud of `n_points`: 32 up to 200 000 points, then as many as draw no more discs
/// than that, but never fewer than 8.
///
/// Fewer axes leave more points without a line that is steep enough to count: with 8, one point in twenty of an exact surface
/// and one in four of a noisy one. In large clouds there are more points on each patch of a surface that make up for it.
pub fn crossing_axes(n_points: usize) -> usize {
    (MOST_AXES * 200_000 / n_points.max(1)).clamp(8, MOST_AXES)
}

/// Counts along lines through the cloud how many sheets come before and after each point: the outward side of the first, third,
/// fifth … sheet faces the line's start.
///
/// * `neighbors` – of each point; smooths which tolerance is believed
/// * `radii` – `n` distances to about the sixth neighbor, by point, positive and in the cloud's unit
/// * `normals` – `n` unit normals of any sign; votes are for these
/// * `n_axes` – directions of lines, from 1 to 32; see [`crossing_axes`]
///
/// Each point is a disc across its normal. Discs on a line are one sheet while the steps between them are less than a tolerance.
/// A line votes when it crosses an even number of sheets, up to 12: then both ends are outside of closed bodies, and an open
/// sheet alone says nothing. Its votes weigh less where a sheet on the way to the nearer end of the line is steep or thicker
/// than one sheet should be, and with the angle between normal and line as [`outside_views`](super::outside_views) do. All
/// lines of an axis that meet a disc share one vote.
///
/// Tolerances are several: thin bodies need a tight one, noise a loose one. Each point takes the tightest that its
/// neighborhood is unanimous at.
///
/// Directions are spread evenly in the frame of the cloud's principal axes, so results turn with the cloud. O(n · axes) time,
/// in parallel; about 80 bytes a point while it works.
///
/// # Errors
/// [`Cancelled`] when `progress` asks to stop; nothing else.
pub fn crossings(
    cloud: &PointCloud,
    neighbors: &Neighbors,
    radii: &[f32],
    normals: &[Vec3],
    n_axes: usize,
    progress: &dyn Progress,
) -> Result<Evidence, Cancelled> {
    if cloud.n_points() == 0 {
        return Ok(Evidence::new(Origin::Crossings, Vec::new()));
    }
    let scene = Scene::new(cloud, normals, radii);
    progress.report(0.1)?;
    let tallies = count(&scene, n_axes.clamp(1, MOST_AXES), &Part::new(progress, 0.1..0.9))?;
    let order = scene.into_ids();
    let mut by_point = vec![[Vote::default(); TOLERANCES.len()]; order.len()];
    for (&id, tallies) in order.iter().zip(tallies) {
        by_point[id as usize] = tallies.map(Tally::into_vote);
    }
    progress.report(0.93)?;
    Ok(Evidence::new(Origin::Crossings, mix(&by_point, &order, neighbors)))
}

/// A sum of votes that many threads add to: the signed sum in the upper half, that of weights in the lower, which never
/// overflows into the upper one as 32 whole votes are far less than `i32::MAX`.
#[derive(Default)]
struct Tally(AtomicI64);

impl Tally {
    fn packed(signed: i32, weight: i32) -> i64 {
        (i64::from(signed) << 32) + i64::from(weight)
    }

    fn add(&self, packed: i64) {
        self.0.fetch_add(packed, Relaxed);
    }

    fn into_vote(self) -> Vote {
        let packed = self.0.into_inner();
        Vote {
            signed: (packed >> 32) as i32,
            weight: packed as i32,
        }
    }
}

/// Votes of the lines along all axes, by splat and tolerance.
fn count(scene: &Scene, n_axes: usize, progress: &dyn Progress) -> Result<Vec<[Tally; TOLERANCES.len()]>, Cancelled> {
    let mut tallies = Vec::new();
    tallies.resize_with(scene.splats.len(), <[Tally; TOLERANCES.len()]>::default);
    let weights = Weights::new();
    let views: Vec<View> = (axes(n_axes).par_iter())
        .map(|&axis| View::along(scene, axis, PIXEL))
        .collect();
    let steps = Steps::new(progress, views.len() * scene.splats.len());
    let mut bands = Bands::default();
    let mut lanes: Vec<Lines> = (0..rayon::current_num_threads()).map(|_| Lines::default()).collect();
    for view in &views {
        bands.sort(scene, view);
        let next = AtomicUsize::new(0);
        lanes.par_iter_mut().with_max_len(1).try_for_each(|lines| {
            loop {
                let band = next.fetch_add(1, Relaxed);
                if band >= bands.n_bands() {
                    return Ok(());
                }
                let splats = bands.of(band);
                lines.draw(scene, view, bands.rows(band), splats, &weights);
                lines.vote();
                for (splat, votes) in lines.votes() {
                    for (tally, vote) in tallies[splat as usize].iter().zip(votes) {
                        if vote != 0 {
                            tally.add(vote);
                        }
                    }
                }
                steps.advance(splats.len())?;
            }
        })?;
    }
    Ok(tallies)
}

/// By point the votes of the tightest tolerance that the neighborhood is unanimous at; in between, some of each.
///
/// `order` are the points along a curve, which is kind to caches.
fn mix(by_point: &[[Vote; TOLERANCES.len()]], order: &[u32], neighbors: &Neighbors) -> Vec<Vote> {
    let k = neighbors.k().min(MOST_NEIGHBORS);
    let mixed: Vec<Vote> = (order.par_iter())
        .map(|&point| {
            let own = &by_point[point as usize];
            let row = &neighbors.of(point as usize)[..k];
            let mut sums = own.map(|vote| [i64::from(vote.signed.abs()), i64::from(vote.weight)]);
            for &neighbor in row {
                for ([agreed, weight], vote) in sums.iter_mut().zip(&by_point[neighbor as usize]) {
                    *agreed += i64::from(vote.signed.abs());
                    *weight += i64::from(vote.weight);
                }
            }
            let mut left = 1.0;
            let (mut signed, mut weight) = (0.0, 0.0);
            for ([agreed, total], vote) in sums.into_iter().zip(own) {
                let share = left * smoothstep(agreed as f32 / total.max(1) as f32, TRUST[0], TRUST[1]);
                signed += share * vote.signed as f32;
                weight += share * vote.weight as f32;
                left -= share;
            }
            let signed = signed.round() as i32;
            Vote {
                signed,
                weight: (weight.round() as i32).max(signed.abs()),
            }
        })
        .collect();
    let mut votes = vec![Vote::default(); order.len()];
    for (&point, vote) in order.iter().zip(mixed) {
        votes[point as usize] = vote;
    }
    votes
}

/// 0 up to `low`, 1 from `high`, smooth in between.
fn smoothstep(value: f32, low: f32, high: f32) -> f32 {
    let share = ((value - low) / (high - low)).clamp(0.0, 1.0);
    share * share * (3.0 - 2.0 * share)
}
