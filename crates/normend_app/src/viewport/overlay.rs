//! What is painted over the picture: the pivot, words beside the pointer, and notices of states that hide or change something.

use egui::text::{LayoutJob, TextFormat};
use egui::{Align2, Color32, FontId, Pos2, Rect, Stroke, StrokeKind, TextureId, Ui, Vec2};

use super::{Viewport, gizmo};
use crate::theme::{SPACE_S, SPACE_XS};

/// Behind a light line, so that it is seen on any picture.
pub const HALO: Color32 = Color32::from_black_alpha(140);
/// A line over the picture.
pub const LINE: Color32 = Color32::from_rgba_premultiplied(230, 230, 230, 230);

impl Viewport {
    pub(super) fn picture(&self, ui: &Ui, texture: TextureId) {
        let whole = Rect::from_min_max(Pos2::ZERO, Pos2::new(1.0, 1.0));
        ui.painter().image(texture, self.rect, whole, Color32::WHITE);
    }

    pub(super) fn pivot_mark(&self, ui: &Ui) {
        let Some(place) = self.place(self.camera.pivot) else {
            return;
        };
        let painter = ui.painter_at(self.rect);
        for (width, color) in [(3.0, HALO), (1.5, LINE)] {
            painter.circle_stroke(place, 6.0, Stroke::new(width, color));
            painter.circle_filled(place, width * 0.75, color);
        }
    }

    /// Says at the bottom of the view that something is cut away or that keys fly, and how to leave that.
    pub(super) fn notices(&self, ui: &Ui) {
        let mut bottom = self.rect.bottom() - SPACE_S;
        if let Some(fly) = &self.fly {
            let text = format!(
                "Flying at speed {:.2} · W A S D E Q move · Shift hurries · drag looks · wheel: speed · Esc ends",
                fly.speed()
            );
            bottom = self.notice(ui, bottom, &text);
        }
        if self.clip.near > 0.0 {
            let text = format!(
                "The nearest {:.0} % is cut away · Ctrl+wheel moves the cut",
                100.0 * self.clip.near
            );
            self.notice(ui, bottom, &text);
        }
    }

    /// One line in the middle, `bottom` at its lower edge; returns where the next one goes.
    fn notice(&self, ui: &Ui, bottom: f32, text: &str) -> f32 {
        let painter = ui.painter_at(self.rect);
        let color = ui.visuals().strong_text_color();
        let padding = Vec2::new(SPACE_S, SPACE_XS);
        // Not over the axes in the corner.
        let max_width = (self.rect.width() - 4.0 * gizmo::MARGIN).max(120.0);
        let galley = painter.layout(text.to_owned(), FontId::proportional(13.0), color, max_width);
        let size = galley.size() + 2.0 * padding;
        let rect = Align2::CENTER_BOTTOM.anchor_size(Pos2::new(self.rect.center().x, bottom), size);
        painter.rect(
            rect,
            5.0,
            ui.visuals().window_fill,
            ui.visuals().window_stroke,
            StrokeKind::Inside,
        );
        painter.galley(rect.min + padding, galley, color);
        // Painted text is not there for screen readers.
        let response = ui.interact(
            rect,
            ui.scope_id().with(("notice", bottom as i32)),
            egui::Sense::hover(),
        );
        response.widget_info(|| egui::WidgetInfo::labeled(egui::accesskit::Role::Label, true, text));
        rect.top() - SPACE_XS
    }

    /// The cross that shows where keys point, `place` in its middle.
    pub fn crosshair(&self, ui: &Ui, place: Pos2) {
        let painter = ui.painter_at(self.rect);
        for (width, color) in [(3.0, HALO), (1.5, LINE)] {
            for arm in [Vec2::X, -Vec2::X, Vec2::Y, -Vec2::Y] {
                // Open in the middle, so that what is meant is seen.
                painter.line_segment([place + 4.0 * arm, place + 14.0 * arm], Stroke::new(width, color));
            }
        }
    }

    /// A few words beside the pointer, after a sign if there is one.
    pub fn badge(&self, ui: &Ui, pointer: Pos2, sign: &str, text: &str) {
        let painter = ui.painter_at(self.rect);
        let color = ui.visuals().strong_text_color();
        let mut words = LayoutJob::default();
        // Only this font has the signs of sets.
        words.append(sign, 0.0, TextFormat::simple(FontId::monospace(15.0), color));
        let gap = if sign.is_empty() { 0.0 } else { SPACE_S };
        words.append(text, gap, TextFormat::simple(FontId::proportional(13.0), color));
        let galley = painter.layout_job(words);
        let padding = Vec2::new(8.0, 4.0);
        let size = galley.size() + 2.0 * padding;
        let mut min = pointer + Vec2::new(18.0, 14.0);
        if min.x + size.x > self.rect.right() {
            min.x = pointer.x - 12.0 - size.x;
        }
        if min.y + size.y > self.rect.bottom() {
            min.y = pointer.y - 8.0 - size.y;
        }
        ground(ui, &painter, Rect::from_min_size(min, size));
        painter.galley(min + padding, galley, color);
    }
}

/// What words over the picture stand on, so that they are read on any colors.
pub fn ground(ui: &Ui, painter: &egui::Painter, rect: Rect) {
    let visuals = ui.visuals();
    painter.rect(
        rect,
        5.0,
        visuals.window_fill,
        visuals.window_stroke,
        StrokeKind::Inside,
    );
}
