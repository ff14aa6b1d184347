//! Depths of oriented discs under a parallel projection, seen from both ends at once.

/// A disc in view coordinates: x and y in pixels, z toward the viewer above.
#[derive(Clone, Copy, Debug)]
pub(super) struct Disc {
    pub x: f32,
    pub y: f32,
    /// Height of the center.
    pub z: f32,
    pub radius: f32,
    /// Rise of the disc's plane along x: `−n_x / n_z`.
    pub slope_x: f32,
    /// Rise of the disc's plane along y: `−n_y / n_z`.
    pub slope_y: f32,
}

/// The highest and the lowest surface at each pixel.
#[derive(Debug, Default)]
pub(super) struct DepthBuffer {
    width: usize,
    height: usize,
    highest: Vec<f32>,
    lowest: Vec<f32>,
}

impl DepthBuffer {
    /// Makes the buffer empty and `width × height` large. Room is kept from one view to the next.
    pub fn clear(&mut self, width: usize, height: usize) {
        (self.width, self.height) = (width, height);
        self.highest.clear();
        self.highest.resize(width * height, f32::NEG_INFINITY);
        self.lowest.clear();
        self.lowest.resize(width * height, f32::INFINITY);
    }

    /// Draws a disc: every pixel whose middle it covers gets the height of its plane there.
    #[inline]
    pub fn draw(&mut self, disc: &Disc) {
        let Disc { slope_x, slope_y, .. } = *disc;
        // The disc covers the offset (x, y) where x² + y² + (slope_x x + slope_y y)² ≤ radius².
        let a = 1.0 + slope_x * slope_x;
        let b = slope_x * slope_y;
        let c = 1.0 + slope_y * slope_y;
        let determinant = a * c - b * b;
        let squared_radius = disc.radius * disc.radius;
        let reach = (squared_radius * a / determinant).sqrt();
        let rows = middles_between(disc.y - reach, disc.y + reach, self.height);
        for row in rows {
            let y = row as f32 + 0.5 - disc.y;
            let squared = a * squared_radius - determinant * y * y;
            if squared < 0.0 {
                continue;
            }
            let middle = disc.x - b * y / a;
            let half = squared.sqrt() / a;
            let columns = middles_between(middle - half, middle + half, self.width);
            let first = row * self.width;
            let span = first + columns.start..first + columns.end;
            let start = disc.z + slope_y * y + slope_x * (columns.start as f32 + 0.5 - disc.x);
            for ((i, highest), lowest) in (0..).zip(&mut self.highest[span.clone()]).zip(&mut self.lowest[span]) {
                let z = start + slope_x * i as f32;
                *highest = if z > *highest { z } else { *highest };
                *lowest = if z < *lowest { z } else { *lowest };
            }
        }
    }

    /// Whether the middle of `disc` is within `tolerance` of the highest and of the lowest surface there. Heights are
    /// compared at the middle of the pixel, so that a plane hides none of its own discs.
    #[inline]
    pub fn sees(&self, disc: &Disc, tolerance: f32) -> (bool, bool) {
        let (column, row) = (disc.x as usize, disc.y as usize);
        let pixel = row.min(self.height - 1) * self.width + column.min(self.width - 1);
        let z = disc.z + disc.slope_x * (column as f32 + 0.5 - disc.x) + disc.slope_y * (row as f32 + 0.5 - disc.y);
        (
            z >= self.highest[pixel] - tolerance,
            z <= self.lowest[pixel] + tolerance,
        )
    }
}

/// The pixels of `0..n` whose middles are in `low..=high`.
#[inline]
fn middles_between(low: f32, high: f32, n: usize) -> std::ops::Range<usize> {
    // Casts saturate: what is left of the picture becomes 0.
    let start = (low + 0.5) as usize;
    let end = ((high + 0.5) as usize).min(n);
    start.min(end)..end
}
