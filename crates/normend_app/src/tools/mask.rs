//! A mask over the view: a bit for each physical pixel. Every tool that draws in two dimensions only paints one; what a mask
//! selects is decided elsewhere ([`crate::selection`]).
//!
//! Invariant: a pixel is in a figure when its center is.

use glam::Vec2;

/// Bits by pixel, from the top left of the view.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Mask {
    size: [u32; 2],
    row_words: usize,
    words: Vec<u64>,
    /// First and one past the last painted pixel each way; `None` while nothing is painted.
    bounds: Option<[[u32; 2]; 2]>,
}

impl Mask {
    /// Nothing painted yet, over a view of `size` physical pixels.
    pub fn new(size: [u32; 2]) -> Self {
        let row_words = (size[0] as usize).div_ceil(64);
        Self {
            size,
            row_words,
            words: vec![0; row_words * size[1] as usize],
            bounds: None,
        }
    }

    /// Whether a pixel is painted; `false` outside of the view.
    pub fn contains(&self, [x, y]: [u32; 2]) -> bool {
        x < self.size[0]
            && y < self.size[1]
            && self.words[y as usize * self.row_words + x as usize / 64] >> (x % 64) & 1 == 1
    }

    /// First and one past the last painted pixel each way; `None` when none is.
    pub fn bounds(&self) -> Option<[[u32; 2]; 2]> {
        self.bounds
    }

    /// Paints what is within `radius` of the line from `a` to `b`, all in physical pixels; a disc where they are the same.
    pub fn paint_line(&mut self, a: Vec2, b: Vec2, radius: f32) {
        let (low, high) = (a.y.min(b.y) - radius, a.y.max(b.y) + radius);
        let along = b - a;
        let squared_len = along.length_squared();
        for y in self.rows(low, high) {
            let center = y as f32 + 0.5;
            // The parts of the row in both discs and in the rectangle between them make one run, because their union is convex.
            let mut run: Option<(f32, f32)> = None;
            let mut join = |from: f32, to: f32| {
                run = Some(run.map_or((from, to), |(start, end)| (start.min(from), end.max(to))));
            };
            for end in [a, b] {
                let squared_half = radius * radius - (center - end.y) * (center - end.y);
                if squared_half >= 0.0 {
                    join(end.x - squared_half.sqrt(), end.x + squared_half.sqrt());
                }
            }
            if squared_len > 0.0 {
                // Where x makes 0 ≤ t ≤ 1 along the line and keeps the distance across it within the radius.
                let (along, across) = (along / squared_len.sqrt(), along.perp() / squared_len.sqrt());
                let rise = center - a.y;
                let within = |factor: f32, offset: f32, low: f32, high: f32| {
                    if factor == 0.0 {
                        let holds = (low..=high).contains(&offset);
                        return if holds {
                            (f32::MIN, f32::MAX)
                        } else {
                            (f32::MAX, f32::MIN)
                        };
                    }
                    let ends = [(low - offset) / factor, (high - offset) / factor];
                    (ends[0].min(ends[1]), ends[0].max(ends[1]))
                };
                let lengthwise = within(along.x, along.y * rise, 0.0, squared_len.sqrt());
                let crosswise = within(across.x, across.y * rise, -radius, radius);
                let (from, to) = (lengthwise.0.max(crosswise.0), lengthwise.1.min(crosswise.1));
                if from <= to {
                    join(a.x + from, a.x + to);
                }
            }
            if let Some((from, to)) = run {
                self.paint_run(y, from, to);
            }
        }
    }

    /// Paints the inside of a closed polygon (physical pixels, the last corner joined to the first). What it goes around more than
    /// once is inside too.
    pub fn paint_polygon(&mut self, corners: &[Vec2]) {
        let (mut low, mut high) = (f32::INFINITY, f32::NEG_INFINITY);
        for corner in corners {
            (low, high) = (low.min(corner.y), high.max(corner.y));
        }
        let mut crossings: Vec<(f32, i32)> = Vec::new();
        for y in self.rows(low, high) {
            let center = y as f32 + 0.5;
            crossings.clear();
            for (index, &a) in corners.iter().enumerate() {
                let b = corners[(index + 1) % corners.len()];
                // Half open, so that a corner on the row counts once.
                if (a.y <= center) != (b.y <= center) {
                    let x = a.x + (b.x - a.x) * ((center - a.y) / (b.y - a.y));
                    crossings.push((x, if a.y <= center { 1 } else { -1 }));
                }
            }
            crossings.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
            let mut winding = 0;
            let mut start = 0.0;
            for &(x, turn) in &crossings {
                if winding == 0 {
                    start = x;
                }
                winding += turn;
                if winding == 0 {
                    self.paint_run(y, start, x);
                }
            }
        }
    }

    /// The rows whose centers lie from `low` to `high`.
    fn rows(&self, low: f32, high: f32) -> std::ops::Range<u32> {
        first_center(low).min(self.size[1])..past_center(high).min(self.size[1])
    }

    /// Paints the pixels of a row whose centers lie from `from` to `to`.
    fn paint_run(&mut self, y: u32, from: f32, to: f32) {
        let (start, end) = (first_center(from).min(self.size[0]), past_center(to).min(self.size[0]));
        if start >= end {
            return;
        }
        let row = &mut self.words[y as usize * self.row_words..(y as usize + 1) * self.row_words];
        let (first, last) = (start as usize / 64, (end as usize - 1) / 64);
        for (index, word) in row.iter_mut().enumerate().take(last + 1).skip(first) {
            let low = if index == first { start % 64 } else { 0 };
            let high = if index == last { (end - 1) % 64 } else { 63 };
            *word |= (u64::MAX << low) & (u64::MAX >> (63 - high));
        }
        let painted = [[start, y], [end, y + 1]];
        self.bounds = Some(self.bounds.map_or(painted, |[min, max]| {
            [[min[0].min(start), min[1].min(y)], [max[0].max(end), max[1].max(y + 1)]]
        }));
    }

    /// The painted pixels as runs: row, first and one past the last pixel, from the top. For painting them on the screen.
    pub fn runs(&self) -> Vec<(u32, u32, u32)> {
        let mut runs = Vec::new();
        let Some([min, max]) = self.bounds else { return runs };
        for y in min[1]..max[1] {
            let row = &self.words[y as usize * self.row_words..(y as usize + 1) * self.row_words];
            let mut x = min[0];
            while let Some(start) = next(row, x, false).filter(|&start| start < max[0]) {
                let end = next(row, start, true).unwrap_or(max[0]);
                runs.push((y, start, end));
                x = end;
            }
        }
        runs
    }
}

/// The first bit of a row from `x` on that is set, or with `clear`, that is not; `None` past its words.
fn next(row: &[u64], x: u32, clear: bool) -> Option<u32> {
    let mut index = x as usize / 64;
    let mut ignored = !(u64::MAX << (x % 64));
    while let Some(&word) = row.get(index) {
        let wanted = if clear { !word } else { word } & !ignored;
        if wanted != 0 {
            return Some(index as u32 * 64 + wanted.trailing_zeros());
        }
        ignored = 0;
        index += 1;
    }
    None
}

/// The first pixel whose center is not before `x`.
fn first_center(x: f32) -> u32 {
    // A float out of range becomes the nearest end.
    (x - 0.5).ceil().max(0.0) as u32
}

/// One past the last pixel whose center is not beyond `x`.
fn past_center(x: f32) -> u32 {
    ((x - 0.5).floor() + 1.0).max(0.0) as u32
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    const SIZE: [u32; 2] = [150, 40];

    fn pixels() -> impl Iterator<Item = ([u32; 2], Vec2)> {
        (0..SIZE[1]).flat_map(|y| (0..SIZE[0]).map(move |x| ([x, y], Vec2::new(x as f32 + 0.5, y as f32 + 0.5))))
    }

    fn check(mask: &Mask, inside: impl Fn(Vec2) -> Option<bool>) {
        let mut bounds: Option<[[u32; 2]; 2]> = None;
        for (pixel, center) in pixels() {
            if let Some(inside) = inside(center) {
                assert_eq!(mask.contains(pixel), inside, "{pixel:?}");
            }
            if mask.contains(pixel) {
                let [x, y] = pixel;
                let [min, max] = bounds.unwrap_or([pixel, [x + 1, y + 1]]);
                bounds = Some([[min[0].min(x), min[1].min(y)], [max[0].max(x + 1), max[1].max(y + 1)]]);
            }
        }
        assert_eq!(mask.bounds(), bounds);
        let mut again = Mask::new(SIZE);
        for (y, start, end) in mask.runs() {
            assert!((start..end).all(|x| mask.contains([x, y])) && !mask.contains([end, y]));
            again.paint_run(y, start as f32, end as f32);
        }
        assert_eq!(again, *mask);
    }

    #[test]
    fn an_empty_mask_holds_nothing() {
        let mut mask = Mask::new(SIZE);
        mask.paint_polygon(&[]);
        mask.paint_polygon(&[Vec2::new(3.0, 3.0)]);
        mask.paint_line(Vec2::new(-100.0, 5.0), Vec2::new(-60.0, 9.0), 20.0);
        check(&mask, |_| Some(false));
        assert!(!mask.contains([SIZE[0], 0]) && !mask.contains([0, SIZE[1]]));
        assert_eq!(Mask::new([0, 0]).bounds(), None);
    }

    #[test]
    fn a_loop_that_goes_around_twice_has_no_hole() {
        let mut mask = Mask::new(SIZE);
        let square = |reach: f32| {
            [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)]
                .map(|(x, y)| Vec2::new(30.0 + reach * x, 20.0 + reach * y))
        };
        mask.paint_polygon(&[square(10.0), square(5.0)].concat());
        assert!(mask.contains([30, 20]) && mask.contains([22, 12]) && !mask.contains([41, 20]));
    }

    fn place() -> impl Strategy<Value = Vec2> {
        (-30.0_f32..180.0, -20.0_f32..60.0).prop_map(|(x, y)| Vec2::new(x, y))
    }

    proptest! {
        #[test]
        fn a_line_is_what_is_near_it(a in place(), b in place(), radius in 0.1_f32..30.0, same in any::<bool>()) {
            let b = if same { a } else { b };
            let mut mask = Mask::new(SIZE);
            mask.paint_line(a, b, radius);
            check(&mask, |center| {
                let along = b - a;
                let t = if same { 0.0 } else { ((center - a).dot(along) / along.length_squared()).clamp(0.0, 1.0) };
                let distance = center.distance(a + t * along);
                // Rounding decides at the border itself.
                ((distance - radius).abs() > 1e-2).then_some(distance < radius)
            });
        }

        #[test]
        fn a_polygon_is_what_it_goes_around(corners in prop::collection::vec(place(), 3..12)) {
            let mut mask = Mask::new(SIZE);
            mask.paint_polygon(&corners);
            check(&mask, |center| {
                let mut angle = 0.0_f64;
                for (index, &a) in corners.iter().enumerate() {
                    let b = corners[(index + 1) % corners.len()];
                    let (from, to) = ((a - center).as_dvec2(), (b - center).as_dvec2());
                    let t = (-from.dot(to - from) / (to - from).length_squared()).clamp(0.0, 1.0);
                    if from.lerp(to, t).length() < 1e-2 {
                        return None;
                    }
                    angle += from.angle_to(to);
                }
                Some(angle.abs() > std::f64::consts::PI)
            });
        }
    }
}
