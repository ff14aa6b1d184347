//! The side panel: a row of tabs, one of them open, and an edge that is dragged.

use egui::{Button, CursorIcon, EventFilter, Id, Key, Modifiers, Rect, Sense, Ui, Vec2, WidgetInfo};

use crate::theme::{self, SPACE_M, SPACE_XS};

/// Width of the strip at the edge that is dragged, in points: half of the margin, so that it covers no content.
const EDGE_WIDTH: f32 = 0.5 * SPACE_M;
/// What one press of an arrow key adds to the width, in points.
const KEY_STEP: f32 = 16.0;
/// What is left for the view in a small window, in points.
const MIN_VIEW_WIDTH: f32 = 280.0;

/// What the side panel shows.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum SideTab {
    /// The scan, and how it is oriented.
    #[default]
    Orient,
    /// Who vouches for which point.
    Sources,
    /// What probably points to the wrong side.
    Suspects,
    /// How the scan is shown.
    View,
    /// What was done.
    History,
}

impl SideTab {
    /// All tabs, from left to right.
    pub const ALL: [Self; 5] = [Self::Orient, Self::Sources, Self::Suspects, Self::View, Self::History];

    /// The name on the tab.
    pub fn label(self) -> &'static str {
        match self {
            Self::Orient => "Orient",
            Self::Sources => "Sources",
            Self::Suspects => "Suspects",
            Self::View => "View",
            Self::History => "History",
        }
    }

    /// What the tab is for.
    pub fn tooltip(self) -> &'static str {
        match self {
            Self::Orient => "The scan, and how it is oriented",
            Self::Sources => "The points whose side is vouched for",
            Self::Suspects => "What probably points to the wrong side",
            Self::View => "How the scan is shown",
            Self::History => "What was done; click to go back",
        }
    }
}

/// How wide the panel is drawn where the user wants `wanted` and the window has `room`, all in points.
pub fn shown_width(wanted: f32, room: f32) -> f32 {
    let narrowest = *theme::SIDE_PANEL_WIDTHS.start();
    wanted.min((room - MIN_VIEW_WIDTH).max(narrowest))
}

/// The edge toward the view: a drag or the arrow keys change the panel's `wanted` width, a double-click brings the usual
/// one back. `shown` is the present width; `ui` is that of the panel before anything is in it. In points.
pub fn edge(ui: &Ui, shown: f32, wanted: &mut f32) {
    let inside = ui.max_rect();
    let panel = inside.expand(SPACE_M);
    let strip = Rect::from_min_size(panel.min, Vec2::new(EDGE_WIDTH, panel.height()));
    let response = ui.interact(strip, Id::unique("edge of the side panel"), Sense::click_and_drag());
    let bounds = theme::SIDE_PANEL_WIDTHS;
    response.widget_info(|| WidgetInfo::slider(true, f64::from(shown), "Width of the side panel"));
    if response.dragged() {
        *wanted = (shown - response.drag_delta().x).clamp(*bounds.start(), *bounds.end());
    }
    if response.double_clicked() {
        *wanted = theme::SIDE_PANEL_WIDTH;
    }
    if response.has_focus() {
        // The arrows are for the edge, not for the way to the next widget.
        let filter = EventFilter {
            horizontal_arrows: true,
            ..EventFilter::default()
        };
        let step = ui.input_mut(|input| {
            let mut pressed = |key| input.count_and_consume_key(Modifiers::NONE, key) as f32;
            pressed(Key::ArrowLeft) - pressed(Key::ArrowRight)
        });
        ui.memory_mut(|memory| memory.set_focus_lock_filter(response.id, filter));
        *wanted = (*wanted + KEY_STEP * step).clamp(*bounds.start(), *bounds.end());
    }
    if response.hovered() || response.dragged() || response.has_focus() {
        let line = Rect::from_min_size(panel.min, Vec2::new(2.0, panel.height()));
        ui.painter().rect_filled(line, 0.0, theme::accent(ui));
    }
    response
        .on_hover_and_drag_cursor(CursorIcon::ResizeHorizontal)
        .on_hover_text("Drag to make the panel wider or narrower; a double-click brings the usual width back");
}

/// The row of tabs; a click opens one. Together they are as wide as the panel's content, with the same room around each
/// name.
pub fn tabs(ui: &mut Ui, open: &mut SideTab) {
    let gap = 0.5 * SPACE_XS;
    let widths = theme::filling(ui, SideTab::ALL.map(SideTab::label), theme::content_width(ui), gap);
    ui.horizontal(|ui| {
        ui.spacing_mut().item_spacing.x = gap;
        // Their widths have it.
        ui.spacing_mut().button_padding.x = 0.0;
        for (tab, width) in SideTab::ALL.into_iter().zip(widths) {
            let button = Button::selectable(*open == tab, tab.label()).min_size(Vec2::new(width, 26.0));
            if ui.add(button).on_hover_text(tab.tooltip()).clicked() {
                *open = tab;
            }
        }
    });
    ui.add_space(SPACE_XS);
    ui.separator();
    ui.add_space(SPACE_XS);
}

#[cfg(test)]
mod tests {
    use super::shown_width;

    #[test]
    fn a_small_window_keeps_room_for_the_view() {
        let check = |wanted, room, expect| assert_eq!(shown_width(wanted, room), expect, "{wanted} of {room}");
        check(324.0, 1280.0, 324.0);
        check(520.0, 1280.0, 520.0);
        check(520.0, 700.0, 420.0);
        // Where both do not fit, the panel stays readable.
        check(520.0, 400.0, 280.0);
    }
}
