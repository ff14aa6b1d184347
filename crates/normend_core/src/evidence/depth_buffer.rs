//! Depths of oriented discs in a picture, from in front and from behind at once.

use std::ops::Range;

/// A disc as a picture shows it: an ellipse of pixels with a plane of heights.
#[derive(Clone, Copy, Debug)]
pub(super) struct Disc {
    /// Column of the center, in pixels.
    pub x: f32,
    /// Row of the center, in pixels.
    pub y: f32,
    /// Height of the center: the larger, the nearer to the viewer. The unit is that of the projection.
    pub height: f32,
    /// Rise of the height a column and a row.
    pub slope: [f32; 2],
    /// Radius in pixels, where the disc is seen from straight above.
    pub radius: f32,
    /// The ellipse `a x² + 2 b x y + c y² ≤ radius²` around the center, as `[a, b, c]`.
    pub ellipse: [f32; 3],
    /// Heights that differ by less are of one surface.
    pub tolerance: f32,
}

impl Disc {
    /// The height of its plane in the middle of a pixel.
    #[inline]
    pub fn height_at(&self, column: usize, row: usize) -> f32 {
        self.height + self.slope[0] * (column as f32 + 0.5 - self.x) + self.slope[1] * (row as f32 + 0.5 - self.y)
    }

    /// The pixels of a picture whose middles it covers, row by row.
    #[inline]
    pub fn covered(&self, width: usize, height: usize) -> impl Iterator<Item = (usize, Range<usize>)> + use<> {
        let Self {
            x,
            y,
            radius,
            ellipse: [a, b, c],
            ..
        } = *self;
        let determinant = a * c - b * b;
        let squared_radius = radius * radius;
        let reach = (squared_radius * a / determinant).sqrt();
        middles_between(y - reach, y + reach, height).map(move |row| {
            let up = row as f32 + 0.5 - y;
            let half = (a * squared_radius - determinant * up * up).max(0.0).sqrt() / a;
            let middle = x - b * up / a;
            (row, middles_between(middle - half, middle + half, width))
        })
    }
}

/// The highest and the lowest surface at each pixel.
#[derive(Debug, Default)]
pub(super) struct DepthBuffer {
    width: usize,
    height: usize,
    highest: Vec<f32>,
    lowest: Vec<f32>,
}

/// Where a look checks a disc, in radii: a look counts that sees a disc and not only a hole's width of it.
const SAMPLES: [[f32; 2]; 5] = [[0.0, 0.0], [SAMPLE, 0.0], [-SAMPLE, 0.0], [0.0, SAMPLE], [0.0, -SAMPLE]];

/// Half way to the rim and a little more: holes between random points are up to about a disc wide, and a disc at an edge
/// still has its samples on its own surface.
const SAMPLE: f32 = 0.6;

/// Samples besides the center that may be hidden: one, as at the edge of what stands in front.
const MAY_BE_HIDDEN: u32 = 1;

impl DepthBuffer {
    /// Makes the buffer empty and `width × height` pixels large. Room is kept from one picture to the next.
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
        for (row, columns) in disc.covered(self.width, self.height) {
            let first = disc.height_at(columns.start, row);
            let span = row * self.width + columns.start..row * self.width + columns.end;
            let pixels = self.highest[span.clone()].iter_mut().zip(&mut self.lowest[span]);
            for (step, (highest, lowest)) in pixels.enumerate() {
                let height = first + disc.slope[0] * step as f32;
                *highest = if height > *highest { height } else { *highest };
                *lowest = if height < *lowest { height } else { *lowest };
            }
        }
    }

    /// Whether a disc, its center within the picture, is at the highest and whether it is at the lowest surface. Heights
    /// are compared in the middle of pixels, so that a plane hides none of its own discs.
    #[inline]
    pub fn sees(&self, disc: &Disc) -> (bool, bool) {
        let mut hidden = [0, 0];
        for [x, y] in SAMPLES {
            let column = disc.x + x * disc.radius;
            let row = disc.y + y * disc.radius;
            // Nothing was drawn beyond the picture, so nothing hides what is there.
            if column < 0.0 || row < 0.0 || column as usize >= self.width || row as usize >= self.height {
                continue;
            }
            let (column, row) = (column as usize, row as usize);
            let pixel = row * self.width + column;
            let height = disc.height_at(column, row);
            let cost = if [x, y] == [0.0, 0.0] { MAY_BE_HIDDEN + 1 } else { 1 };
            hidden[0] += cost * u32::from(height < self.highest[pixel] - disc.tolerance);
            hidden[1] += cost * u32::from(height > self.lowest[pixel] + disc.tolerance);
            if hidden[0].min(hidden[1]) > MAY_BE_HIDDEN {
                break;
            }
        }
        (hidden[0] <= MAY_BE_HIDDEN, hidden[1] <= MAY_BE_HIDDEN)
    }
}

/// The pixels of `0..n` whose middles are in `low..=high`.
#[inline]
fn middles_between(low: f32, high: f32, n: usize) -> Range<usize> {
    // Casts saturate: what is left of the picture becomes 0, and what is not a number too.
    let start = (low + 0.5) as usize;
    let end = ((high + 0.5) as usize).min(n);
    start.min(end)..end
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn disc(x: f32, y: f32, height: f32, radius: f32, slope: [f32; 2]) -> Disc {
        let [a, b] = slope;
        Disc {
            x,
            y,
            height,
            slope,
            radius,
            ellipse: [1.0 + a * a, a * b, 1.0 + b * b],
            tolerance: 0.1,
        }
    }

    proptest! {
        #[test]
        fn each_pixel_whose_middle_is_covered_gets_the_height_of_the_plane(
            (x, y) in (-3.0_f32..23.0, -3.0_f32..19.0),
            radius in 0.0_f32..9.0,
            slope in (-4.0_f32..4.0, -4.0_f32..4.0),
        ) {
            let disc = disc(x, y, 7.0, radius, slope.into());
            let mut buffer = DepthBuffer::default();
            buffer.clear(20, 16);
            buffer.draw(&disc);
            for row in 0..16 {
                for column in 0..20 {
                    let (dx, dy) = (column as f32 + 0.5 - x, row as f32 + 0.5 - y);
                    let rise = slope.0 * dx + slope.1 * dy;
                    let squared = dx * dx + dy * dy + rise * rise;
                    let found = (buffer.highest[row * 20 + column], buffer.lowest[row * 20 + column]);
                    if squared < 0.999 * radius * radius - 1e-3 {
                        prop_assert!((found.0 - 7.0 - rise).abs() < 1e-3 && found.0 == found.1, "{found:?}");
                    } else if squared > 1.001 * radius * radius + 1e-3 {
                        prop_assert_eq!(found, (f32::NEG_INFINITY, f32::INFINITY));
                    }
                }
            }
        }

        #[test]
        fn a_plane_hides_none_of_its_discs(
            places in prop::collection::vec((0.0_f32..20.0, 0.0_f32..16.0), 1..60),
            slope in (-4.0_f32..4.0, -4.0_f32..4.0),
        ) {
            let discs: Vec<Disc> =
                places.iter().map(|&(x, y)| disc(x, y, slope.0 * x + slope.1 * y, 3.0, slope.into())).collect();
            let mut buffer = DepthBuffer::default();
            buffer.clear(20, 16);
            discs.iter().for_each(|disc| buffer.draw(disc));
            prop_assert!(discs.iter().all(|disc| buffer.sees(disc) == (true, true)));
        }
    }

    #[test]
    fn what_is_behind_is_seen_from_behind() {
        let mut buffer = DepthBuffer::default();
        buffer.clear(20, 20);
        let front = disc(10.0, 10.0, 1.0, 6.0, [0.0; 2]);
        let back = disc(10.0, 10.0, 0.0, 6.0, [0.0; 2]);
        buffer.draw(&front);
        buffer.draw(&back);
        assert_eq!(
            (buffer.sees(&front), buffer.sees(&back)),
            ((true, false), (false, true))
        );
        // Heights within the tolerance are of one surface.
        let same = Disc { height: 0.95, ..front };
        assert_eq!(buffer.sees(&same), (true, false));
    }

    #[test]
    fn a_hole_narrower_than_a_disc_shows_nothing() {
        let mut buffer = DepthBuffer::default();
        buffer.clear(30, 30);
        let back = disc(15.2, 15.2, 0.0, 4.0, [0.0; 2]);
        for x in [7.0, 23.0] {
            buffer.draw(&disc(x, 15.0, 1.0, 7.5, [0.0; 2]));
        }
        buffer.draw(&back);
        assert_eq!(buffer.sees(&back), (false, true));
    }
}
