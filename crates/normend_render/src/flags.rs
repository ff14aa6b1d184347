//! The bits of the points on the GPU, one plane of words for each [`Flag`], all in one buffer: OpenGL allows few.
//!
//! Invariant: `words` mirrors the GPU's, so an upload is the touched words and nothing is read back.

use std::ops::Range;

use egui_wgpu::wgpu;

use crate::error::RenderError;
use crate::gpu_types::Flag;
use crate::storage::{binding_limit, storage_buffer};

/// Touched words closer than this are uploaded together: a kilobyte costs less than another upload.
const MERGE_WORDS: u32 = 256;

/// All bits of all points, with their mirror.
pub struct Flags {
    words: Vec<u32>,
    plane_words: u32,
    n_points: u32,
    buffer: wgpu::Buffer,
}

impl Flags {
    /// All bits of `n_points` points are 0.
    ///
    /// # Errors
    /// [`RenderError::BufferTooLarge`] and [`RenderError::OutOfMemory`].
    pub fn new(device: &wgpu::Device, n_points: usize) -> Result<Self, RenderError> {
        let plane_words = n_points.div_ceil(32).max(1);
        let words = vec![0_u32; plane_words * Flag::COUNT];
        let needed = size_of_val(words.as_slice()) as u64;
        let limit = binding_limit(device);
        if needed > limit {
            return Err(RenderError::BufferTooLarge {
                what: "signs and marks of the points",
                needed,
                limit,
            });
        }
        let buffer = storage_buffer(device, "flags", &words).map_err(|error| RenderError::OutOfMemory {
            n_points,
            needed,
            reason: error.to_string(),
        })?;
        Ok(Self {
            words,
            plane_words: plane_words as u32,
            n_points: n_points as u32,
            buffer,
        })
    }

    /// The planes, one after the other.
    pub fn buffer(&self) -> &wgpu::Buffer {
        &self.buffer
    }

    /// Words of one plane.
    pub fn plane_words(&self) -> u32 {
        self.plane_words
    }

    /// Bytes of all planes.
    pub fn n_bytes(&self) -> u64 {
        size_of_val(self.words.as_slice()) as u64
    }

    /// Toggles the bit `flag` of `ranges` and uploads the words that they touch; returns the bytes uploaded.
    pub fn toggle(&mut self, queue: &wgpu::Queue, flag: Flag, ranges: &[Range<u32>]) -> u64 {
        let mut touched: Vec<Range<u32>> = Vec::with_capacity(ranges.len());
        let n_points = self.n_points;
        let plane = self.plane(flag);
        for range in ranges {
            let range = range.start..range.end.min(n_points);
            if range.start < range.end {
                toggle(plane, range.clone());
                touched.push(range.start / 32..(range.end - 1) / 32 + 1);
            }
        }
        touched.sort_unstable_by_key(|words| words.start);
        self.upload(queue, flag, &touched)
    }

    /// Sets the bit `flag` of all points; words that are missing are 0. Uploads the words that change; returns their
    /// bytes. O(n/32).
    pub fn set(&mut self, queue: &wgpu::Queue, flag: Flag, words: &[u32]) -> u64 {
        let mut changed: Vec<Range<u32>> = Vec::new();
        let missing = std::iter::repeat(&0);
        for ((at, old), &new) in (0_u32..).zip(self.plane(flag)).zip(words.iter().chain(missing)) {
            if *old != new {
                *old = new;
                match changed.last_mut() {
                    Some(last) if last.end == at => last.end += 1,
                    _ => changed.push(at..at + 1),
                }
            }
        }
        self.upload(queue, flag, &changed)
    }

    fn plane(&mut self, flag: Flag) -> &mut [u32] {
        let len = self.plane_words as usize;
        &mut self.words[flag as usize * len..][..len]
    }

    /// Uploads words of a plane, given as ranges sorted by start.
    fn upload(&self, queue: &wgpu::Queue, flag: Flag, touched: &[Range<u32>]) -> u64 {
        let first = flag as u32 * self.plane_words;
        let mut uploaded = 0;
        for words in merge(touched, MERGE_WORDS) {
            let slice = &self.words[(first + words.start) as usize..(first + words.end) as usize];
            queue.write_buffer(
                &self.buffer,
                u64::from(first + words.start) * 4,
                bytemuck::cast_slice(slice),
            );
            uploaded += size_of_val(slice) as u64;
        }
        uploaded
    }
}

/// Flips the bits of a range that is not empty and lies within `words`.
fn toggle(words: &mut [u32], range: Range<u32>) {
    let (first, last) = ((range.start / 32) as usize, ((range.end - 1) / 32) as usize);
    let head = u32::MAX << (range.start % 32);
    let tail = u32::MAX >> (31 - (range.end - 1) % 32);
    if first == last {
        words[first] ^= head & tail;
        return;
    }
    words[first] ^= head;
    for word in &mut words[first + 1..last] {
        *word = !*word;
    }
    words[last] ^= tail;
}

/// Joins ranges, sorted by start, that are less than `gap` apart.
fn merge(sorted: &[Range<u32>], gap: u32) -> Vec<Range<u32>> {
    let mut merged: Vec<Range<u32>> = Vec::new();
    for range in sorted {
        match merged.last_mut() {
            Some(last) if range.start <= last.end.saturating_add(gap) => last.end = last.end.max(range.end),
            _ => merged.push(range.clone()),
        }
    }
    merged
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn toggle_flips_the_bits_of_the_range_alone(start in 0_u32..200, len in 1_u32..200) {
            let range = start..(start + len).min(256);
            prop_assume!(!range.is_empty());
            let mut words = [0x5a5a_1234_u32; 8];
            toggle(&mut words, range.clone());
            for bit in 0..256 {
                let was = 0x5a5a_1234_u32 >> (bit % 32) & 1 == 1;
                let is = words[bit as usize / 32] >> (bit % 32) & 1 == 1;
                prop_assert_eq!(is != was, range.contains(&bit), "bit {}", bit);
            }
        }
    }

    #[test]
    fn merge_joins_what_is_near() {
        let check = |input: &[Range<u32>], expect: &[Range<u32>]| assert_eq!(merge(input, 10), expect);
        check(&[], &[]);
        check(&[0..3, 5..6, 17..18], &[0..6, 17..18]);
        check(&[0..30, 5..6, 50..60], &[0..30, 50..60]);
        check(&[0..1, 11..12, 23..24], &[0..12, 23..24]);
    }
}
