//! The tools that paint a mask with the main button: brush, lasso, rectangle, polygon.
//!
//! A figure begins with a press and takes its [`Combine`] from the keys that are held then. It ends with the release, a polygon
//! when it is closed; then its mask goes to [`crate::selection`], as one step.

use egui::{Color32, Mesh, Pos2, Rect, Shape, Stroke as Line, Ui, Vec2};

use super::mask::Mask;
use super::{Combine, Tool};
use crate::theme;
use crate::viewport::{DrawEvent, LINE, LINE_HALO, ViewPlace};

/// How far from the last corner another press closes a polygon (a double-click), in points; and from the first corner, which is
/// aimed at.
const AT_LAST: f32 = 4.0;
const AT_FIRST: f32 = 9.0;

/// What a finished figure selects.
#[derive(Clone, Debug, PartialEq)]
pub struct Stroke {
    /// The painted pixels.
    pub mask: Mask,
    /// How it joins the selection.
    pub combine: Combine,
}

/// The figure under way, if any.
#[derive(Debug, Default)]
pub struct Painting {
    figure: Option<Figure>,
    combine: Combine,
}

/// Places are in points of the window.
#[derive(Debug)]
enum Figure {
    Brush { mask: Mask, last: Pos2 },
    Lasso(Vec<Pos2>),
    Rectangle { from: Pos2, to: Pos2 },
    Polygon(Vec<Pos2>),
}

impl Figure {
    /// What it covers now.
    fn mask(&self, view: &ViewPlace) -> Mask {
        let corners = match self {
            Self::Brush { mask, .. } => return mask.clone(),
            Self::Lasso(corners) | Self::Polygon(corners) => corners.clone(),
            Self::Rectangle { from, to } => {
                let rect = Rect::from_two_pos(*from, *to);
                vec![
                    rect.left_top(),
                    rect.right_top(),
                    rect.right_bottom(),
                    rect.left_bottom(),
                ]
            }
        };
        let mut mask = Mask::new(view.size);
        let corners: Vec<_> = corners.into_iter().map(|place| view.pixels(place)).collect();
        mask.paint_polygon(&corners);
        mask
    }
}

impl Painting {
    /// How the figure under way joins the selection.
    pub fn combine(&self) -> Option<Combine> {
        self.figure.as_ref().map(|_| self.combine)
    }

    /// Follows the main button. `brush_radius` in points. Returns what is finished.
    pub fn follow(&mut self, tool: Tool, brush_radius: f32, events: &[DrawEvent], view: &ViewPlace) -> Vec<Stroke> {
        let mut finished = Vec::new();
        let radius = brush_radius * view.pixels_per_point;
        for &event in events {
            match event {
                DrawEvent::Press { place, modifiers } => {
                    if let Some(Figure::Polygon(corners)) = &mut self.figure {
                        let is_at = |corner: Option<&Pos2>, reach| corner.is_some_and(|at| at.distance(place) <= reach);
                        if is_at(corners.last(), AT_LAST) || (corners.len() > 2 && is_at(corners.first(), AT_FIRST)) {
                            finished.extend(self.close(view));
                        } else {
                            corners.push(place);
                        }
                        continue;
                    }
                    self.combine = Combine::of(modifiers);
                    self.figure = match tool {
                        Tool::Brush => {
                            let mut mask = Mask::new(view.size);
                            mask.paint_line(view.pixels(place), view.pixels(place), radius);
                            Some(Figure::Brush { mask, last: place })
                        }
                        Tool::Lasso => Some(Figure::Lasso(vec![place])),
                        Tool::Rectangle => Some(Figure::Rectangle { from: place, to: place }),
                        Tool::Polygon => Some(Figure::Polygon(vec![place])),
                        Tool::Mend | Tool::Patch | Tool::Component => None,
                    };
                }
                DrawEvent::Move(place) => self.go_to(place, radius, view),
                DrawEvent::Release(place) => {
                    self.go_to(place, radius, view);
                    if !matches!(self.figure, Some(Figure::Polygon(_))) {
                        finished.extend(self.finish(view));
                    }
                }
            }
        }
        finished
    }

    fn go_to(&mut self, place: Pos2, radius: f32, view: &ViewPlace) {
        match &mut self.figure {
            Some(Figure::Brush { mask, last }) => {
                mask.paint_line(view.pixels(*last), view.pixels(place), radius);
                *last = place;
            }
            // Closer corners than a pixel add nothing but work.
            Some(Figure::Lasso(corners))
                if (corners.last()).is_none_or(|last| last.distance(place) * view.pixels_per_point >= 1.0) =>
            {
                corners.push(place);
            }
            Some(Figure::Rectangle { to, .. }) => *to = place,
            Some(Figure::Lasso(_) | Figure::Polygon(_)) | None => {}
        }
    }

    fn finish(&mut self, view: &ViewPlace) -> Option<Stroke> {
        let mask = self.figure.take()?.mask(view);
        Some(Stroke {
            mask,
            combine: self.combine,
        })
    }

    /// Closes the polygon under way, if it has three corners.
    pub fn close(&mut self, view: &ViewPlace) -> Option<Stroke> {
        match &self.figure {
            Some(Figure::Polygon(corners)) if corners.len() > 2 => self.finish(view),
            _ => None,
        }
    }

    /// Takes the last corner of the polygon under way back; `false` when there is none.
    pub fn take_corner_back(&mut self) -> bool {
        let Some(Figure::Polygon(corners)) = &mut self.figure else {
            return false;
        };
        corners.pop();
        if corners.is_empty() {
            self.figure = None;
        }
        true
    }

    /// Whether a polygon is under way.
    pub fn has_corners(&self) -> bool {
        matches!(self.figure, Some(Figure::Polygon(_)))
    }

    /// Drops the figure under way; `false` when there is none.
    pub fn cancel(&mut self) -> bool {
        self.figure.take().is_some()
    }

    /// Paints the figure over the picture, and for the brush the disc at `pointer`.
    pub fn paint(&self, ui: &Ui, view: &ViewPlace, tool: Tool, brush_radius: f32, pointer: Option<Pos2>) {
        let painter = ui.painter_at(view.rect);
        let halo = Line::new(3.0, LINE_HALO);
        let line = Line::new(1.5, LINE);
        if let Some(figure) = &self.figure {
            let color = match self.combine {
                Combine::Remove => Color32::from_black_alpha(110),
                Combine::Replace | Combine::Add | Combine::Intersect => theme::SELECTION_VEIL,
            };
            painter.add(veil(&figure.mask(view), view, color));
            let mut corners = match figure {
                Figure::Brush { .. } => Vec::new(),
                Figure::Lasso(corners) => corners.clone(),
                Figure::Polygon(corners) => corners.iter().copied().chain(pointer).collect(),
                Figure::Rectangle { from, to } => {
                    let rect = Rect::from_two_pos(*from, *to);
                    vec![
                        rect.left_top(),
                        rect.right_top(),
                        rect.right_bottom(),
                        rect.left_bottom(),
                    ]
                }
            };
            corners.extend(corners.first().copied());
            painter.add(Shape::line(corners.clone(), halo));
            painter.add(Shape::line(corners, line));
            if let Figure::Polygon(corners) = figure {
                for (index, &corner) in corners.iter().enumerate() {
                    let radius = if index == 0 { 5.0 } else { 3.0 };
                    painter.circle(corner, radius, LINE, Line::new(1.5, LINE_HALO));
                }
            }
        }
        if let Some(pointer) = pointer.filter(|_| tool == Tool::Brush) {
            painter.circle_stroke(pointer, brush_radius, halo);
            painter.circle_stroke(pointer, brush_radius, line);
        }
    }
}

/// The painted pixels in one color, each once however often it was painted over.
fn veil(mask: &Mask, view: &ViewPlace, color: Color32) -> Mesh {
    let mut mesh = Mesh::default();
    let at = |x: u32, y: u32| view.rect.min + Vec2::new(x as f32, y as f32) / view.pixels_per_point;
    for (y, start, end) in mask.runs() {
        mesh.add_colored_rect(Rect::from_min_max(at(start, y), at(end, y + 1)), color);
    }
    mesh
}

#[cfg(test)]
mod tests {
    use egui::Modifiers;

    use super::*;

    const VIEW: ViewPlace = ViewPlace {
        rect: Rect::from_min_max(Pos2::new(10.0, 20.0), Pos2::new(110.0, 80.0)),
        size: [200, 120],
        pixels_per_point: 2.0,
    };

    fn press(x: f32, y: f32) -> DrawEvent {
        DrawEvent::Press {
            place: Pos2::new(x, y),
            modifiers: Modifiers::SHIFT,
        }
    }

    #[test]
    fn a_brush_paints_in_points_whatever_the_screen() {
        let mut painting = Painting::default();
        let stroke = painting.follow(
            Tool::Brush,
            5.0,
            &[press(30.0, 40.0), DrawEvent::Release(Pos2::new(30.0, 40.0))],
            &VIEW,
        );
        let [stroke] = stroke.as_slice() else {
            panic!("{stroke:?}")
        };
        assert_eq!(stroke.combine, Combine::Add);
        // A disc of radius 10 pixels around pixel (40, 40).
        assert_eq!(stroke.mask.bounds(), Some([[30, 30], [50, 50]]));
        assert_eq!(painting.combine(), None);
    }

    #[test]
    fn a_polygon_grows_by_clicks_and_closes_at_its_first_or_last_corner() {
        for (x, y) in [(30.0, 33.0), (70.0, 68.0)] {
            let mut painting = Painting::default();
            let release = DrawEvent::Release(Pos2::new(0.0, 0.0));
            let corners = [press(30.0, 30.0), release, press(70.0, 30.0), release];
            assert!(painting.follow(Tool::Polygon, 5.0, &corners, &VIEW).is_empty());
            assert!(painting.close(&VIEW).is_none(), "two corners hold nothing");
            painting.follow(Tool::Polygon, 5.0, &[press(20.0, 50.0)], &VIEW);
            assert!(painting.take_corner_back());
            painting.follow(Tool::Polygon, 5.0, &[press(70.0, 70.0)], &VIEW);
            let strokes = painting.follow(Tool::Polygon, 5.0, &[press(x, y)], &VIEW);
            assert_eq!(strokes.len(), 1, "not closed at {x} {y}");
            assert!(strokes[0].mask.contains([110, 40]) && !strokes[0].mask.contains([50, 90]));
        }
    }

    #[test]
    fn what_is_canceled_selects_nothing() {
        let mut painting = Painting::default();
        painting.follow(Tool::Lasso, 5.0, &[press(30.0, 30.0)], &VIEW);
        assert!(painting.cancel() && !painting.cancel());
        let release = [DrawEvent::Release(Pos2::new(60.0, 60.0))];
        assert!(painting.follow(Tool::Lasso, 5.0, &release, &VIEW).is_empty());
        assert!(!painting.take_corner_back());
    }
}
