//! Messages over the view, and the window with all of them.

use egui::{Align, Align2, Area, Button, Id, Label, Layout, Order, Rect, RichText, ScrollArea, TextEdit, Ui, Vec2};

use crate::job::JobStatus;
use crate::messages::{Level, Message, Messages};
use crate::theme::{self, SPACE_M, SPACE_S, SPACE_XS};

/// Widest message over the view, in points, and the share of the view that it may take.
const WIDTH: f32 = 380.0;
const SHARE: f32 = 0.5;
const LOG_SIZE: Vec2 = Vec2::new(640.0, 320.0);
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
                    ui.set_width(WIDTH.min(SHARE * view.width()));
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
                            ui.add(Label::new(RichText::new(entry.full_text()).color(color)).wrap());
                        });
                    });
                });
            }
        });
}

/// Which messages the window lists.
#[derive(Clone, Debug, Default)]
pub struct LogView {
    /// `None` lists all.
    level: Option<Level>,
    search: String,
}

impl LogView {
    fn lists(&self, entry: &Message) -> bool {
        let search = self.search.trim().to_lowercase();
        self.level.is_none_or(|level| level == entry.level) && entry.text.to_lowercase().contains(&search)
    }
}

/// The window with all messages of this run, and the work under way with its title.
pub fn log(
    ui: &Ui,
    open: &mut bool,
    view: &mut LogView,
    messages: &mut Messages,
    running: Option<(String, JobStatus)>,
) {
    egui::Window::new("Messages")
        .open(open)
        .default_size(LOG_SIZE)
        .default_pos(ui.ctx().content_rect().center() - 0.5 * LOG_SIZE)
        .collapsible(false)
        .show(ui.ctx(), |ui| {
            filters(ui, view, messages);
            ui.separator();
            if let Some((title, status)) = running {
                let percent = (status.fraction * 100.0).floor();
                let text = format!("{title}: {} · {percent}%", status.stage);
                ui.label(RichText::new(text).color(theme::accent(ui)));
            }
            let listed: Vec<&Message> = messages.entries().iter().filter(|entry| view.lists(entry)).collect();
            if listed.is_empty() {
                let text = if messages.entries().is_empty() {
                    "Nothing was said yet."
                } else {
                    "No message is like this."
                };
                ui.label(RichText::new(text).weak());
                // The window keeps its size when there is nothing to list.
                ui.allocate_space(ui.available_size());
                return;
            }
            list(ui, &listed);
        });
}

fn filters(ui: &mut Ui, view: &mut LogView, messages: &mut Messages) {
    ui.horizontal(|ui| {
        ui.spacing_mut().item_spacing.x = SPACE_XS;
        for (level, name) in [
            (None, "All"),
            (Some(Level::Done), "Done"),
            (Some(Level::Note), "Notes"),
            (Some(Level::Error), "Errors"),
        ] {
            if ui.add(Button::selectable(view.level == level, name)).clicked() {
                view.level = level;
            }
        }
        ui.add_space(SPACE_S);
        let field = TextEdit::singleline(&mut view.search)
            .hint_text("Search")
            .desired_width(140.0);
        ui.add(field)
            .widget_info(|| egui::WidgetInfo::labeled(egui::accesskit::Role::TextInput, true, "Search messages"));
        ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
            let any = !messages.entries().is_empty();
            let clear = ui.add_enabled(any, Button::new("Clear"));
            let clear = clear.on_hover_text("Forget all messages");
            if clear.on_disabled_hover_text("There are no messages").clicked() {
                messages.clear();
            }
            let copy = ui.add_enabled(any, Button::new("Copy"));
            let copy = copy.on_hover_text("Copy the listed messages as text");
            if copy.on_disabled_hover_text("There are no messages").clicked() {
                let listed = messages.entries().iter().filter(|entry| view.lists(entry));
                ui.ctx().copy_text(as_text(listed));
            }
        });
    });
}

/// One line for each message: the time, the level, what was said.
fn as_text<'a>(messages: impl Iterator<Item = &'a Message>) -> String {
    messages
        .map(|entry| format!("{}  {}  {}\n", entry.clock(), entry.level.label(), entry.full_text()))
        .collect()
}

fn list(ui: &mut Ui, messages: &[&Message]) {
    ScrollArea::vertical()
        .auto_shrink([false, false])
        .stick_to_bottom(true)
        .show(ui, |ui| {
            egui::Grid::new("log")
                .num_columns(3)
                .spacing([SPACE_M, SPACE_S])
                .show(ui, |ui| {
                    for entry in messages {
                        let color = match entry.level {
                            Level::Done | Level::Note => ui.visuals().weak_text_color(),
                            Level::Error => ui.visuals().error_fg_color,
                        };
                        ui.label(RichText::new(entry.clock()).monospace().weak());
                        ui.label(RichText::new(entry.level.label()).color(color));
                        ui.add(Label::new(entry.full_text()).wrap().selectable(true));
                        ui.end_row();
                    }
                });
        });
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn messages_are_listed_by_level_and_words_and_copied_as_lines() {
        let mut messages = Messages::default();
        messages.info("Opened church.ply.");
        messages.error("No such file.");
        messages.error("No such file.");
        let listed = |view: &LogView| as_text(messages.entries().iter().filter(|entry| view.lists(entry)));
        let mut view = LogView::default();
        assert_eq!(listed(&view).lines().count(), 2);
        view.level = Some(Level::Error);
        let text = listed(&view);
        assert!(text.ends_with("  Error  No such file. (×2)\n"), "{text}");
        assert_eq!(text.find("  Error"), Some("14:03:59".len()));
        view.level = None;
        view.search = "CHURCH".to_owned();
        assert!(listed(&view).contains("  Done  Opened church.ply.") && listed(&view).lines().count() == 1);
    }
}
