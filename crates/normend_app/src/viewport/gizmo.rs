//! The directions of the axes in a corner of the view; a click on one looks from there.

use egui::{Align2, Color32, FontId, Pos2, Rect, Sense, Stroke, Ui, Vec2};
use glam::Vec3;
use normend_render::Camera;

/// From the middle to the ends of the axes, in points.
const REACH: f32 = 32.0;
/// Radius of the ends, in points: with the gap around them large enough to hit.
const BALL: f32 = 9.0;
/// From the view's corner to the middle, in points.
pub(super) const MARGIN: f32 = 54.0;
/// What the axes take of the view's width, from its left edge, in points.
pub const WIDTH: f32 = 2.0 * MARGIN;

struct Axis {
    name: &'static str,
    direction: Vec3,
    color: Color32,
}

const RED: Color32 = Color32::from_rgb(0xe0, 0x5a, 0x5a);
const GREEN: Color32 = Color32::from_rgb(0x5f, 0xb3, 0x4d);
const BLUE: Color32 = Color32::from_rgb(0x5b, 0x8d, 0xef);

const AXES: [Axis; 6] = [
    Axis::new("+x", Vec3::X, RED),
    Axis::new("−x", Vec3::NEG_X, RED),
    Axis::new("+y", Vec3::Y, GREEN),
    Axis::new("−y", Vec3::NEG_Y, GREEN),
    Axis::new("+z", Vec3::Z, BLUE),
    Axis::new("−z", Vec3::NEG_Z, BLUE),
];

impl Axis {
    const fn new(name: &'static str, direction: Vec3, color: Color32) -> Self {
        Self { name, direction, color }
    }

    fn is_positive(&self) -> bool {
        self.direction.element_sum() > 0.0
    }
}

/// Draws the axes into the lower left corner of `rect`, the nearest last. Returns the direction to look from (unit, from the
/// scene toward the eye) when one was clicked; one that the view already looks from gives the opposite.
pub(super) fn ui(ui: &Ui, rect: Rect, camera: &Camera) -> Option<Vec3> {
    let center = rect.left_bottom() + Vec2::new(MARGIN, -MARGIN);
    let (right, up, back) = (camera.right(), camera.up(), camera.back());
    let place = |axis: Vec3| center + Vec2::new(right.dot(axis), -up.dot(axis)) * REACH;
    let mut axes: Vec<&Axis> = AXES.iter().collect();
    axes.sort_by(|a, b| back.dot(a.direction).total_cmp(&back.dot(b.direction)));

    let painter = ui.painter_at(rect);
    let mut clicked = None;
    for axis in axes {
        let end = place(axis.direction);
        // Widgets that are added later lie above, as the nearer balls do.
        let id = ui.scope_id().with(("axis", axis.name));
        let response = ui.interact(Rect::from_center_size(end, Vec2::splat(2.0 * BALL)), id, Sense::click());
        let label = format!("Look from {}", axis.name);
        response.widget_info(|| egui::WidgetInfo::labeled(egui::accesskit::Role::Button, true, &label));
        if response.clicked() {
            clicked = Some(axis.direction);
        }
        ball(&painter, axis, center, end, response.hovered() || response.has_focus());
        response.on_hover_text(format!("{label}; click again for the other side"));
    }
    clicked.map(|direction| {
        if direction.dot(back) > 0.999 {
            -direction
        } else {
            direction
        }
    })
}

fn ball(painter: &egui::Painter, axis: &Axis, center: Pos2, end: Pos2, is_lit: bool) {
    if axis.is_positive() {
        painter.line_segment([center, end], Stroke::new(2.0, axis.color));
        painter.circle_filled(end, BALL, axis.color);
    } else {
        // Dark enough below its letters in both themes.
        painter.circle_filled(end, BALL - 1.0, axis.color.lerp_to_gamma(Color32::BLACK, 0.62));
        painter.circle_stroke(end, BALL - 1.0, Stroke::new(1.5, axis.color));
    }
    if is_lit {
        painter.circle_stroke(end, BALL + 1.0, Stroke::new(2.0, Color32::WHITE));
    }
    if axis.is_positive() || is_lit {
        let color = if axis.is_positive() {
            Color32::from_rgb(0x10, 0x12, 0x15)
        } else {
            Color32::WHITE
        };
        let text = if axis.is_positive() { &axis.name[1..] } else { axis.name };
        painter.text(end, Align2::CENTER_CENTER, text, FontId::proportional(11.0), color);
    }
}
