//! The points as discs in the frame of their principal axes, and who of many views sees which.

use std::sync::atomic::{AtomicUsize, Ordering};

use glam::{Mat3, Vec3};
use rayon::prelude::*;

use super::depth_buffer::{DepthBuffer, Disc};
use super::frame::Frame;
use crate::progress::Steps;
use crate::{Cancelled, PointCloud, Progress};

/// Spacing of points by the distance to the sixth neighbor. Where `d` points stand on a unit of area, six of them are within
/// `sqrt(6 / (π d))`, and one of them has the area `1 / d`.
const SPACING_OF_SIXTH: f32 = 0.72;

/// Size of a pixel in median spacings. Smaller ones cost more and tell no more; at one spacing, votes in narrow gaps get worse.
pub(super) const PIXEL: f32 = 0.7;

/// Radius of a disc in spacings. Smaller discs leave holes that far sides are seen through, larger ones hide their neighbors
/// around edges and in noise.
const DISC: f32 = 1.2;

/// How far below the surface in front a point still is on it, in its own spacings. More looks through sheets as near as that,
/// less takes noise for surfaces.
const TOLERANCE: f32 = 0.6;

/// Cosine of the angle from which on a disc hides nothing: edges of thin sheets are no surface.
const LEAST_DRAWN: f32 = 0.1;

/// A point is an outlier that is so many times as far from the center as all but one in a hundred. Outliers are not looked at:
/// a picture that reached to them would show the rest too small.
const OUTLIER: f32 = 3.0;

/// One point as a disc, in the frame.
#[derive(Clone, Copy)]
pub(super) struct Splat {
    pub position: Vec3,
    pub normal: Vec3,
    pub spacing: f32,
}

impl Splat {
    /// The radius of its disc.
    pub fn radius(&self) -> f32 {
        DISC * self.spacing
    }

    /// How far below the surface in front it still is on it.
    pub fn tolerance(&self) -> f32 {
        TOLERANCE * self.spacing
    }
}

/// The discs of a cloud, along a curve that keeps neighbors together, which is kind to caches.
pub(super) struct Scene {
    pub splats: Vec<Splat>,
    /// Point ids of `splats`.
    ids: Vec<u32>,
    /// Turns directions of the frame into those of the cloud.
    pub cloud_from_frame: Mat3,
    pub frame: Frame,
    /// Median spacing.
    pub spacing: f32,
    /// Distance from the center within which points set the size of pictures.
    pub reach: f32,
}

/// By splat, one bit each: seen in front, seen from behind.
struct Seen {
    front: Vec<u64>,
    behind: Vec<u64>,
}

/// A picture to take: its size and where it shows discs.
pub(super) struct Picture<P> {
    pub width: usize,
    pub height: usize,
    /// Cosine between normal and line of sight below which a look is not taken.
    pub least_cosine: f32,
    /// The disc of a splat and the cosine between its normal and the line of sight, of any sign; `None` where the picture
    /// does not show it.
    pub project: P,
}

/// Most axes or places to look from: two bits for each fit into 64.
pub(super) const MAX_LOOKS: usize = 32;

impl Scene {
    /// The scene of `cloud`, which is not empty, with `n` unit `normals` and `n` distances to the sixth neighbor.
    pub fn new(cloud: &PointCloud, normals: &[Vec3], radii: &[f32]) -> Self {
        let frame = Frame::of(cloud);
        let positions: Vec<Vec3> = (cloud.positions().par_iter())
            .map(|&position| (frame.frame_from_cloud * (position.as_dvec3() - frame.center)).as_vec3())
            .collect();
        let frame_from_cloud = frame.frame_from_cloud.as_mat3();
        let cells = CURVE_CELLS / cloud.diagonal().max(f32::MIN_POSITIVE);
        let mut order: Vec<(u32, u32)> = (0..)
            .zip(&positions)
            .map(|(id, &position)| (curve(position * cells), id))
            .collect();
        order.par_sort_unstable();
        let ids: Vec<u32> = order.par_iter().map(|&(_, id)| id).collect();
        drop(order);
        let splats = (ids.par_iter())
            .map(|&id| Splat {
                position: positions[id as usize],
                normal: frame_from_cloud * normals[id as usize],
                spacing: SPACING_OF_SIXTH * radii[id as usize],
            })
            .collect();
        let rank = |values: &mut [f32], share: f32| {
            let index = ((values.len() - 1) as f32 * share) as usize;
            *values.select_nth_unstable_by(index, f32::total_cmp).1
        };
        let median = rank(&mut radii.to_vec(), 0.5);
        let mut distances: Vec<f32> = positions.par_iter().map(|position| position.length()).collect();
        let reach = OUTLIER * rank(&mut distances, 0.99);
        Self {
            splats,
            ids,
            cloud_from_frame: frame_from_cloud.transpose(),
            frame,
            spacing: SPACING_OF_SIXTH * median,
            reach,
        }
    }

    /// The point ids of the splats.
    pub fn into_ids(self) -> Vec<u32> {
        self.ids
    }

    /// Most pixels of a picture: surfaces that fill it need about four a point, and outliers must not cost memory.
    pub fn most_pixels(&self) -> f32 {
        16.0 * self.splats.len() as f32 + 4096.0
    }

    /// Calls `look(i, …)` for `n_looks` (up to [`MAX_LOOKS`]), in parallel, and returns by point id the looks that see it: bit
    /// `i` those that see it in front, bit `32 + i` those that see it from behind.
    ///
    /// # Errors
    /// [`Cancelled`] when `progress` asks to stop; nothing else.
    pub fn masks(
        &self,
        n_looks: usize,
        progress: &dyn Progress,
        look: impl Fn(usize, &mut Look<'_>) + Sync,
    ) -> Result<Vec<u64>, Cancelled> {
        let next = AtomicUsize::new(0);
        let steps = Steps::new(progress, n_looks);
        let n_lanes = rayon::current_num_threads().clamp(1, n_looks.max(1)).min(MAX_LANES);
        let lanes: Vec<Vec<(usize, Seen)>> = (0..n_lanes)
            .into_par_iter()
            .with_max_len(1)
            .map(|_| {
                let mut buffer = DepthBuffer::default();
                let mut done = Vec::new();
                loop {
                    let index = next.fetch_add(1, Ordering::Relaxed);
                    if index >= n_looks {
                        return Ok(done);
                    }
                    let n_words = self.splats.len().div_ceil(64);
                    let mut taken = Look {
                        scene: self,
                        buffer: &mut buffer,
                        seen: Seen {
                            front: vec![0; n_words],
                            behind: vec![0; n_words],
                        },
                    };
                    look(index, &mut taken);
                    done.push((index, taken.seen));
                    steps.advance(1)?;
                }
            })
            .collect::<Result<_, Cancelled>>()?;
        let seen: Vec<(usize, Seen)> = lanes.into_iter().flatten().collect();
        let mut in_order = vec![0; self.splats.len().next_multiple_of(64)];
        in_order.par_chunks_mut(64).enumerate().for_each(|(word, masks)| {
            let mut rows = [0; 64];
            for (look, seen) in &seen {
                rows[*look] = seen.front[word];
                rows[MAX_LOOKS + look] = seen.behind[word];
            }
            transpose(&mut rows);
            masks.copy_from_slice(&rows);
        });
        drop(seen);
        let mut masks = vec![0; self.splats.len()];
        for (&id, mask) in self.ids.iter().zip(in_order) {
            masks[id as usize] = mask;
        }
        Ok(masks)
    }
}

/// Most pictures that are drawn at the same time: each takes up to 16 bytes a pixel.
const MAX_LANES: usize = 8;

/// The pictures of one look, and what they see.
pub(super) struct Look<'a> {
    scene: &'a Scene,
    buffer: &'a mut DepthBuffer,
    seen: Seen,
}

impl Look<'_> {
    /// Takes a picture and notes what it sees.
    pub fn take(&mut self, picture: Picture<impl Fn(&Splat) -> Option<(Disc, f32)>>) {
        self.buffer.clear(picture.width, picture.height);
        for splat in &self.scene.splats {
            if let Some((disc, cosine)) = (picture.project)(splat)
                && cosine.abs() > LEAST_DRAWN
            {
                self.buffer.draw(&disc);
            }
        }
        let in_picture = |disc: &Disc| {
            disc.x >= 0.0 && disc.y >= 0.0 && disc.x < picture.width as f32 && disc.y < picture.height as f32
        };
        for (word, splats) in self.scene.splats.chunks(64).enumerate() {
            for (bit, splat) in splats.iter().enumerate() {
                if let Some((disc, cosine)) = (picture.project)(splat)
                    && cosine.abs() > picture.least_cosine
                    && in_picture(&disc)
                {
                    let (front, behind) = self.buffer.sees(&disc);
                    self.seen.front[word] |= u64::from(front) << bit;
                    self.seen.behind[word] |= u64::from(behind) << bit;
                }
            }
        }
    }
}

/// Cells of the curve along the diagonal; 10 bits an axis hold twice that.
const CURVE_CELLS: f32 = 500.0;

/// The place on a Morton curve of a position around 0, in cells.
fn curve(position: Vec3) -> u32 {
    let cell = (position + CURVE_CELLS).as_uvec3().to_array();
    (0..10).rev().fold(0, |code, bit| {
        cell.iter().fold(code, |code, axis| code << 1 | (axis >> bit & 1))
    })
}

/// Swaps rows and columns of 64 × 64 bits, by quarters of ever smaller squares.
fn transpose(rows: &mut [u64; 64]) {
    let mut size = 32;
    let mut low = u64::MAX >> 32;
    while size > 0 {
        for row in (0..64).filter(|row| row & size == 0) {
            let swapped = (rows[row] >> size ^ rows[row + size]) & low;
            rows[row] ^= swapped << size;
            rows[row + size] ^= swapped;
        }
        size /= 2;
        low ^= low << size;
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn bits_are_transposed(rows in prop::collection::vec(any::<u64>(), 64)) {
            let mut transposed: [u64; 64] = rows.clone().try_into().unwrap();
            transpose(&mut transposed);
            for (row, bits) in rows.iter().enumerate() {
                for (column, other) in transposed.iter().enumerate() {
                    prop_assert_eq!(bits >> column & 1, other >> row & 1);
                }
            }
        }
    }

    #[test]
    fn the_curve_keeps_neighbors_together() {
        let near = curve(Vec3::splat(10.0)).abs_diff(curve(Vec3::splat(11.0)));
        let far = curve(Vec3::splat(10.0)).abs_diff(curve(Vec3::splat(-400.0)));
        assert!(near < 64 && far > 1 << 24, "{near} {far}");
        assert!(curve(Vec3::splat(CURVE_CELLS)) < 1 << 30);
    }
}
