//! The card of the running job: what it does, how far it is, and how to stop it.

use egui::{Align2, Area, Button, Id, Order, ProgressBar, Rect, RichText, Ui, Vec2};

use crate::job::JobStatus;
use crate::theme::{self, SPACE_L, SPACE_M, SPACE_XS};

/// Shows the card at the lower edge of `view`; says whether the user cancels.
pub fn ui(ui: &Ui, view: Rect, title: &str, status: &JobStatus) -> bool {
    let mut cancel = false;
    Area::new(Id::unique("running job"))
        .order(Order::Middle)
        .pivot(Align2::CENTER_BOTTOM)
        .fixed_pos(view.center_bottom() - Vec2::new(0.0, SPACE_L))
        .show(ui.ctx(), |ui| {
            theme::card(ui).show(ui, |ui| {
                ui.set_width(340.0);
                ui.label(RichText::new(title).strong());
                ui.add_space(SPACE_XS);
                ui.horizontal(|ui| {
                    ui.spacing_mut().item_spacing.x = SPACE_M;
                    let bar = ProgressBar::new(status.fraction)
                        .desired_width(250.0)
                        .desired_height(8.0);
                    ui.add(bar).accessible_name("Progress");
                    let text = if status.cancelling { "Cancelling" } else { "Cancel" };
                    let button = ui.add_enabled(!status.cancelling, Button::new(text));
                    cancel = button.on_hover_text("Stop this work").clicked();
                });
                ui.label(RichText::new(details(status)).weak());
            });
        });
    cancel
}

fn details(status: &JobStatus) -> String {
    let percent = (status.fraction * 100.0).floor();
    match status.seconds_left {
        Some(secs) if secs >= 90.0 => format!("{} · {percent}% · about {:.0} min left", status.stage, secs / 60.0),
        Some(secs) if secs >= 1.0 => format!("{} · {percent}% · about {secs:.0} s left", status.stage),
        _ => format!("{} · {percent}%", status.stage),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn details_name_stage_percent_and_time() {
        let check = |fraction, seconds_left, expect: &str| {
            let status = JobStatus {
                stage: "Reading".to_owned(),
                fraction,
                seconds_left,
                cancelling: false,
            };
            assert_eq!(details(&status), expect);
        };
        check(0.0, None, "Reading · 0%");
        check(0.999, Some(0.2), "Reading · 99%");
        check(0.5, Some(12.3), "Reading · 50% · about 12 s left");
        check(0.5, Some(180.0), "Reading · 50% · about 3 min left");
    }
}
