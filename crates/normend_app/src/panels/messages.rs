//! Messages over the view, and the log of all of them.

use egui::{Align, Align2, Area, Button, Id, Label, Layout, Order, Rect, RichText, ScrollArea, Ui, Vec2};

use crate::messages::{Level, Message, Messages};
use crate::theme::{self, SPACE_M, SPACE_S};

const WIDTH: f32 = 380.0;
const LOG_SIZE: Vec2 = Vec2::new(520.0, 280.0);
const MAX_SHOWN: usize = 4;

/// The newest messages in the upper right corner of `view`.
pub fn toasts(ui: &Ui, view: Rect, messages: &mut Messages) {
    let shown: Vec<usize> = messages
        .entries()
        .iter()
        .enumerate()
        .rev()
        .filter(|(_, entry)| entry.shown_until.is_some())
        .map(|(index, _)| index)
        .take(MAX_SHOWN)
        .collect();
    if shown.is_empty() {
        return;
    }
    Area::new(Id::unique("messages"))
        .order(Order::Middle)
        .pivot(Align2::RIGHT_TOP)
        .fixed_pos(view.right_top() + Vec2::new(-SPACE_M, SPACE_M))
        .show(ui.ctx(), |ui| {
            for index in shown {
                let Some(entry) = messages.entries_mut().get_mut(index) else {
                    continue;
                };
                theme::card(ui).show(ui, |ui| {
                    ui.set_width(WIDTH);
                    ui.with_layout(Layout::right_to_left(Align::TOP), |ui| {
                        let close = ui.add(Button::new(RichText::new("Close").weak()).small().frame(false));
                        if close.on_hover_text("Hide this message; the log keeps it").clicked() {
                            entry.shown_until = None;
                        }
                        ui.with_layout(Layout::top_down(Align::Min), |ui| {
                            let color = match entry.level {
                                Level::Done | Level::Note => ui.visuals().text_color(),
                                Level::Error => ui.visuals().error_fg_color,
                            };
                            ui.add(Label::new(RichText::new(text(entry)).color(color)).wrap());
                        });
                    });
                });
            }
        });
}

fn text(message: &Message) -> String {
    if message.n_times > 1 {
        format!("{} (×{})", message.text, message.n_times)
    } else {
        message.text.clone()
    }
}

/// Seconds as "1:02:03".
fn clock(secs: f64) -> String {
    let secs = secs.max(0.0) as u64;
    format!("{}:{:02}:{:02}", secs / 3600, secs / 60 % 60, secs % 60)
}

/// The window with all messages of this run.
pub fn log(ui: &Ui, open: &mut bool, messages: &Messages) {
    egui::Window::new("Messages")
        .open(open)
        .default_size(LOG_SIZE)
        .default_pos(ui.ctx().content_rect().center() - 0.5 * LOG_SIZE)
        .collapsible(false)
        .show(ui.ctx(), |ui| {
            if messages.entries().is_empty() {
                ui.label(RichText::new("Nothing was said yet.").weak());
                return;
            }
            ScrollArea::vertical()
                .auto_shrink([false, false])
                .stick_to_bottom(true)
                .show(ui, |ui| {
                    egui::Grid::new("log")
                        .num_columns(3)
                        .spacing([SPACE_M, SPACE_S])
                        .show(ui, |ui| {
                            for entry in messages.entries() {
                                let (name, color) = match entry.level {
                                    Level::Done => ("Done", ui.visuals().weak_text_color()),
                                    Level::Note => ("Note", ui.visuals().weak_text_color()),
                                    Level::Error => ("Error", ui.visuals().error_fg_color),
                                };
                                let time = RichText::new(clock(entry.at_secs)).monospace().weak();
                                ui.label(time)
                                    .on_hover_text("Hours, minutes and seconds since the editor started");
                                ui.label(RichText::new(name).color(color));
                                ui.add(Label::new(text(entry)).wrap().selectable(true));
                                ui.end_row();
                            }
                        });
                });
        });
}

#[cfg(test)]
mod tests {
    use super::clock;

    #[test]
    fn the_clock_counts_hours_minutes_and_seconds() {
        assert_eq!(clock(0.9), "0:00:00");
        assert_eq!(clock(3723.0), "1:02:03");
    }
}
