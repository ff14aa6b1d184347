//! The sheets that lines cross within one band of a picture, and their votes.

use std::ops::Range;
use std::sync::atomic::{AtomicU32, Ordering::Relaxed};

use super::super::outside_views::{LEAST_COSINE, View, Weights};
use super::super::scene::Scene;
use super::{Tally, smoothstep};

/// Steps between discs from which on they are of two sheets, in spacings of the sparser one. The tight one sees both sides of a
/// body just over half a spacing thick, where its points are exact; the loose one takes noise of a spacing for one sheet.
pub(super) const TOLERANCES: [f32; 3] = [0.55, 1.1, 1.95];

/// Thickness of a sheet up to which it is surely one, in tolerances; twice that is surely more. Within one sheet, discs of
/// different tilt spread over somewhat more than one step.
const THICK: f32 = 1.5;

/// Mean cosines between line and normals of a sheet: at 78° it may be any number of sheets, from 53° on it is one.
const STEEP: [f32; 2] = [0.2, 0.6];

/// Most sheets of a line that votes. Every sheet may be missed or seen twice, so the parity of many is a guess.
const MOST_SHEETS: usize = 12;

/// Votes smaller than this are not worth their time: less than a thousandth.
const LEAST_QUALITY: f32 = 0.001;

/// Cosine between line and normal up to which a disc counts as its middle only: its plane would reach far along the line.
const LEAST_DRAWN: f32 = 0.05;

/// A disc as its lines see it.
struct Seen {
    splat: u32,
    spacing: f32,
    /// Of the angle between the axis and its normal.
    cosine: f32,
    /// What it votes on each of its lines, in units of 1/[`UNIT`].
    weight: f32,
}

/// Where a line meets a disc.
#[derive(Clone, Copy)]
struct Hit {
    height: f32,
    seen: u32,
    spacing: f32,
    cosine: f32,
}

/// The hits of one sheet: those from the end of the sheet below.
#[derive(Clone, Copy, Default)]
struct Sheet {
    end: usize,
    quality: f32,
    /// Product of the qualities of the sheets before it, which are farther down.
    before: f32,
}

/// The lines through one band: what they hit, and what that says of the discs. Reused from band to band.
#[derive(Default)]
pub(super) struct Lines {
    discs: Vec<Seen>,
    votes: Vec<[i64; TOLERANCES.len()]>,
    /// Pixel and key of each hit, as drawn.
    drawn: Vec<(u32, u64)>,
    /// The same by pixel: the bits of the height, which is not negative, above the index of the disc.
    keys: Vec<u64>,
    /// Where the hits of each pixel end.
    ends: Vec<u32>,
    hits: Vec<Hit>,
}

impl Lines {
    /// Draws the discs of `splats` into `rows` of the view's picture.
    pub fn draw(&mut self, scene: &Scene, view: &View, rows: Range<usize>, splats: &[AtomicU32], weights: &Weights) {
        self.discs.clear();
        self.drawn.clear();
        self.ends.clear();
        self.ends.resize(rows.len() * view.width + 1, 0);
        for splat in splats {
            let id = splat.load(Relaxed);
            let splat = &scene.splats[id as usize];
            let (disc, cosine) = view.disc(splat);
            let index = self.discs.len() as u32;
            let mut hit = |column: usize, row: usize, height: f32| {
                let pixel = (row - rows.start) * view.width + column;
                // Nothing of the cloud is below its lowest point.
                let key = u64::from(height.max(0.0).to_bits()) << 32 | u64::from(index);
                self.ends[pixel + 1] += 1;
                self.drawn.push((pixel as u32, key));
            };
            let mut n_pixels = 0;
            if cosine.abs() > LEAST_DRAWN {
                for (row, columns) in disc.covered(view.width, view.height) {
                    n_pixels += columns.len();
                    if rows.contains(&row) {
                        for column in columns {
                            hit(column, row, disc.height_at(column, row));
                        }
                    }
                }
            }
            if n_pixels == 0 {
                let (column, row) = (disc.x as usize, disc.y as usize);
                if rows.contains(&row) {
                    hit(column.min(view.width - 1), row, disc.height);
                }
            }
            let weight = if cosine.abs() < LEAST_COSINE {
                0
            } else {
                weights.of(cosine)
            };
            self.discs.push(Seen {
                splat: id,
                spacing: splat.spacing / view.pixel,
                cosine,
                weight: weight as f32 / n_pixels.max(1) as f32,
            });
        }
        self.sort();
    }

    /// Sorts the hits by pixel.
    fn sort(&mut self) {
        let mut place = 0;
        for end in &mut self.ends {
            place += *end;
            *end = place;
        }
        self.keys.clear();
        self.keys.resize(self.drawn.len(), 0);
        // `ends[pixel]` is where the pixel starts, and moves to where it ends.
        for &(pixel, key) in &self.drawn {
            let place = &mut self.ends[pixel as usize];
            self.keys[*place as usize] = key;
            *place += 1;
        }
    }

    /// Counts the sheets at each pixel and casts their votes.
    pub fn vote(&mut self) {
        self.votes.clear();
        self.votes.resize(self.discs.len(), [0; TOLERANCES.len()]);
        let mut start = 0;
        for &end in &self.ends {
            let keys = &mut self.keys[start..end as usize];
            start = end as usize;
            // A single disc is a single sheet.
            if keys.len() < 2 {
                continue;
            }
            keys.sort_unstable();
            self.hits.clear();
            self.hits.extend(keys.iter().map(|&key| {
                let disc = &self.discs[key as u32 as usize];
                Hit {
                    height: f32::from_bits((key >> 32) as u32),
                    seen: key as u32,
                    spacing: disc.spacing,
                    cosine: disc.cosine.abs(),
                }
            }));
            let n_sheets = count(&self.hits);
            let mut which = 0;
            while let Some(&n) = n_sheets.get(which) {
                let mut end = which + 1;
                if n % 2 == 0 && n <= MOST_SHEETS {
                    let mut sheets = [Sheet::default(); MOST_SHEETS];
                    let are_thin = group(&self.hits, TOLERANCES[which], &mut sheets);
                    // What is thin for a tight tolerance is thin for a loose one: the same sheets vote the same.
                    while are_thin && n_sheets.get(end) == Some(&n) {
                        end += 1;
                    }
                    cast(&self.hits, &sheets[..n], &self.discs, |disc, vote| {
                        for sum in &mut self.votes[disc][which..end] {
                            *sum += vote;
                        }
                    });
                }
                which = end;
            }
        }
    }

    /// The votes of the splats for each tolerance, packed as tallies are.
    pub fn votes(&self) -> impl Iterator<Item = (u32, [i64; TOLERANCES.len()])> {
        self.discs.iter().map(|disc| disc.splat).zip(self.votes.iter().copied())
    }
}

/// Whether two hits that follow each other are of one sheet.
#[inline]
fn are_one(hit: &Hit, next: &Hit, tolerance: f32) -> bool {
    next.height - hit.height <= tolerance * hit.spacing.max(next.spacing)
}

/// Number of sheets of hits, ascending, for each tolerance.
fn count(hits: &[Hit]) -> [usize; TOLERANCES.len()] {
    let mut n_sheets = [1; TOLERANCES.len()];
    for pair in hits.windows(2) {
        for (n, tolerance) in n_sheets.iter_mut().zip(TOLERANCES) {
            *n += usize::from(!are_one(&pair[0], &pair[1], tolerance));
        }
    }
    n_sheets
}

/// Groups hits, ascending, into `sheets`, which has room for them. Returns whether no sheet is thicker than one should be.
fn group(hits: &[Hit], tolerance: f32, sheets: &mut [Sheet]) -> bool {
    let thick = THICK * tolerance;
    let mut are_thin = true;
    let mut before = 1.0;
    let mut start = 0;
    for sheet in sheets {
        let Some(first) = hits.get(start) else {
            break;
        };
        let (mut cosines, mut spacings) = (0.0, 0.0);
        let mut end = start;
        loop {
            cosines += hits[end].cosine;
            spacings += hits[end].spacing;
            end += 1;
            if end == hits.len() || !are_one(&hits[end - 1], &hits[end], tolerance) {
                break;
            }
        }
        let count = (end - start) as f32;
        let thickness = (hits[end - 1].height - first.height) * count / spacings;
        are_thin &= thickness <= thick;
        let quality =
            smoothstep(cosines / count, STEEP[0], STEEP[1]) * (1.0 - smoothstep(thickness, thick, 2.0 * thick));
        *sheet = Sheet { end, quality, before };
        before *= quality;
        start = end;
    }
    are_thin
}

/// Casts the votes of an even number of sheets, from the lowest on: the outward side of the first faces downward.
fn cast(hits: &[Hit], sheets: &[Sheet], discs: &[Seen], mut vote: impl FnMut(usize, i64)) {
    let mut after = 1.0;
    for (index, sheet) in sheets.iter().enumerate().rev() {
        let start = if index == 0 { 0 } else { sheets[index - 1].end };
        let quality = sheet.before.max(after) * sheet.quality;
        after *= sheet.quality;
        if quality <= LEAST_QUALITY {
            continue;
        }
        for hit in &hits[start..sheet.end] {
            let disc = &discs[hit.seen as usize];
            // Rounds, as no weight is negative.
            let weight = (quality * disc.weight + 0.5) as i32;
            let upward = index % 2 == 1;
            let signed = if (disc.cosine > 0.0) == upward { weight } else { -weight };
            vote(hit.seen as usize, Tally::packed(signed, weight));
        }
    }
}
