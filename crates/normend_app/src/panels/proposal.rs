//! The bar over the view while an edit is shown that is not made yet.

use egui::{Align2, Area, Id, Order, Rect, RichText, Ui, Vec2};

use crate::theme::{self, SPACE_L, SPACE_M};

/// What the user answers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reply {
    /// Make the edit.
    Apply,
    /// Leave all as it is.
    Leave,
}

/// The bar at the lower right of `area`: that `n_points` would turn, and the choice.
pub fn ui(ui: &Ui, area: Rect, n_points: u64) -> Option<Reply> {
    let mut reply = None;
    Area::new(Id::unique("proposal"))
        .order(Order::Middle)
        // At the right, because the axes are at the left.
        .pivot(Align2::RIGHT_BOTTOM)
        .fixed_pos(area.right_bottom() - Vec2::splat(SPACE_L))
        .show(ui.ctx(), |ui| {
            theme::card(ui).show(ui, |ui| {
                ui.horizontal(|ui| {
                    ui.spacing_mut().item_spacing.x = SPACE_M;
                    let text = format!("{} would turn to face you", theme::counted(n_points, "point", "points"));
                    ui.label(RichText::new(text).color(ui.visuals().strong_text_color()));
                    let apply = ui.add(theme::primary_button(ui, "Apply"));
                    if apply.on_hover_text("Turn the highlighted points (Enter)").clicked() {
                        reply = Some(Reply::Apply);
                    }
                    if ui.button("Leave").on_hover_text("Change nothing (Escape)").clicked() {
                        reply = Some(Reply::Leave);
                    }
                    ui.label(RichText::new("Enter applies, Esc leaves").weak());
                });
            });
        });
    reply
}
