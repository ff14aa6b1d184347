//! The splats of a picture by bands of rows, which are drawn one by one so that little memory is needed.

use std::ops::Range;
use std::sync::atomic::{AtomicU32, Ordering::Relaxed};

use rayon::prelude::*;

use super::super::outside_views::View;
use super::super::scene::Scene;

/// Splats of a band, about. What a band needs while it is worked at, 100 bytes a splat, stays in a core's own cache; narrower
/// bands share more of their discs with the next one.
const BAND: usize = 1 << 14;

/// Splats that a task sorts at least.
const LEAST_CHUNK: usize = 1 << 14;

/// Tasks at most, so that their counts stay small beside the splats.
const MOST_CHUNKS: usize = 256;

/// For each band of a picture the splats whose discs touch it; ascending, so neighbors in space are near in memory.
#[derive(Default)]
pub(super) struct Bands {
    /// Rows of the picture and of a band.
    height: usize,
    n_rows: usize,
    starts: Vec<usize>,
    /// Written by many tasks, each in places of its own.
    splats: Vec<AtomicU32>,
}

impl Bands {
    /// Sorts the splats into bands of the view's picture. Room is kept from one picture to the next. O(n), in parallel.
    pub fn sort(&mut self, scene: &Scene, view: &View) {
        let splats = &scene.splats;
        self.height = view.height;
        self.n_rows = view.height.div_ceil(splats.len().div_ceil(BAND));
        let n_bands = self.height.div_ceil(self.n_rows);
        let chunk = splats.len().div_ceil(MOST_CHUNKS).max(LEAST_CHUNK);
        let bands_of = |splat| {
            let (first, last) = view.rows(splat);
            first / self.n_rows..=last / self.n_rows
        };
        let mut places: Vec<Vec<usize>> = splats
            .par_chunks(chunk)
            .map(|splats| {
                let mut counts = vec![0; n_bands];
                for splat in splats {
                    for band in bands_of(splat) {
                        counts[band] += 1;
                    }
                }
                counts
            })
            .collect();
        self.starts.clear();
        let mut place = 0;
        for band in 0..n_bands {
            self.starts.push(place);
            for counts in &mut places {
                let count = counts[band];
                counts[band] = place;
                place += count;
            }
        }
        self.starts.push(place);
        if self.splats.len() < place {
            self.splats.resize_with(place, AtomicU32::default);
        }
        let sorted = &self.splats;
        (splats.par_chunks(chunk).zip(places))
            .enumerate()
            .for_each(|(index, (splats, mut places))| {
                for (id, splat) in (index * chunk..).zip(splats) {
                    for band in bands_of(splat) {
                        sorted[places[band]].store(id as u32, Relaxed);
                        places[band] += 1;
                    }
                }
            });
    }

    pub fn n_bands(&self) -> usize {
        self.starts.len() - 1
    }

    /// The rows of a band.
    pub fn rows(&self, band: usize) -> Range<usize> {
        let first = band * self.n_rows;
        first..(first + self.n_rows).min(self.height)
    }

    /// The splats whose discs touch a band.
    pub fn of(&self, band: usize) -> &[AtomicU32] {
        &self.splats[self.starts[band]..self.starts[band + 1]]
    }
}
