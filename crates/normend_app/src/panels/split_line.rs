//! The line in the view between what is compared: its handle, and what is on either side.

use egui::{Align2, CursorIcon, FontId, Id, Rect, Sense, Stroke, Ui, Vec2, pos2};

use crate::compare::{Comparing, Style};
use crate::theme::{self, SPACE_S};

/// Width of what can be grabbed, in points.
const GRAB_WIDTH: f32 = 14.0;
/// From the top of the view to the names, in points.
const NAMES_AT: f32 = 28.0;

/// Takes the drag of the line, and says what is shown where. Goes on with showing both in turn.
pub fn ui(ui: &Ui, view: Rect, comparing: &mut Comparing) {
    let present = "Now";
    let other = comparing.other.label();
    match comparing.style {
        _ if !comparing.is_ready() => {}
        Style::Off => {}
        Style::Split => {
            let x = view.left() + comparing.split * view.width();
            let grab = Rect::from_center_size(pos2(x, view.center().y), Vec2::new(GRAB_WIDTH, view.height()));
            let response = ui.interact(grab, Id::unique("split line"), Sense::drag());
            response.widget_info(|| {
                egui::WidgetInfo::slider(
                    true,
                    f64::from(comparing.split),
                    "Line between the two that are compared",
                )
            });
            if response.hovered() || response.dragged() {
                ui.set_cursor_icon(CursorIcon::ResizeHorizontal);
            }
            if let Some(position) = response.interact_pointer_pos().filter(|_| response.dragged()) {
                comparing.split = ((position.x - view.left()) / view.width()).clamp(0.0, 1.0);
            }
            let handle = Rect::from_center_size(pos2(x, view.center().y), Vec2::new(8.0, 36.0));
            ui.painter().rect_filled(handle, 4.0, theme::accent(ui));
            ui.painter().rect_stroke(
                handle,
                4.0,
                Stroke::new(1.0, ui.visuals().panel_fill),
                egui::StrokeKind::Outside,
            );
            let at = view.top() + NAMES_AT;
            name(ui, view, pos2(x - 2.0 * SPACE_S, at), Align2::RIGHT_CENTER, other);
            name(ui, view, pos2(x + 2.0 * SPACE_S, at), Align2::LEFT_CENTER, present);
        }
        Style::Blink => {
            let text = if comparing.shows_other() { other } else { present };
            name(
                ui,
                view,
                pos2(view.center().x, view.top() + NAMES_AT),
                Align2::CENTER_CENTER,
                text,
            );
        }
    }
}

fn name(ui: &Ui, view: Rect, at: egui::Pos2, align: Align2, text: &str) {
    let painter = ui.painter().with_clip_rect(view);
    let galley = painter.layout_no_wrap(text.to_owned(), FontId::proportional(13.0), ui.visuals().text_color());
    let rect = align.anchor_size(at, galley.size());
    let card = rect.expand2(Vec2::new(SPACE_S, 3.0));
    painter.rect_filled(card, 6.0, ui.visuals().panel_fill);
    painter.galley(rect.min, galley, ui.visuals().text_color());
}
