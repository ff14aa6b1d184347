//! The list of what was done: a click goes there, back or forth.

use egui::{Button, RichText, ScrollArea, Ui, Vec2};
use normend_core::EditKind;
use normend_core::document::Step;

use crate::command::Action;
use crate::session::Session;
use crate::theme;

const ROW_HEIGHT: f32 = 24.0;

/// The tab. Only the rows in sight are laid out.
pub fn ui(ui: &mut Ui, session: &Session) -> Option<Action> {
    let document = &session.document;
    let n_steps = document.steps().count();
    if n_steps == 0 {
        let hint = "Nothing was done yet. Every edit is listed here, and a click goes back to before it or after it.";
        ui.add(egui::Label::new(RichText::new(hint).weak()).wrap());
        return None;
    }
    let n_done = document.n_done();
    let mut action = None;
    let list = ScrollArea::vertical().id_salt("history").auto_shrink([false, true]);
    list.show_rows(ui, ROW_HEIGHT, n_steps + 1, |ui, rows| {
        for place in rows {
            let (text, detail) = match place.checked_sub(1).and_then(|step| document.steps().nth(step)) {
                Some(step) => (step.kind().label().to_owned(), detail(step)),
                None => ("As opened".to_owned(), String::new()),
            };
            let mut text = RichText::new(text);
            if place > n_done {
                text = text.weak();
            }
            let button = Button::selectable(place == n_done, text)
                .shortcut_text(detail)
                .min_size(Vec2::new(ui.available_width(), ROW_HEIGHT));
            let mut response = ui.add(button);
            response = response.on_hover_text(match place.cmp(&n_done) {
                std::cmp::Ordering::Less => "Take back what was done after this",
                std::cmp::Ordering::Equal => "The present state",
                std::cmp::Ordering::Greater => "Do everything up to this again",
            });
            if place == n_done {
                let edge = response.rect.left_center();
                let mark = egui::Rect::from_center_size(edge + Vec2::new(1.5, 0.0), Vec2::new(3.0, ROW_HEIGHT - 8.0));
                ui.painter().rect_filled(mark, 1.5, theme::accent(ui));
            }
            if response.clicked() && place != n_done {
                action = Some(Action::GoToStep(place));
            }
        }
    });
    action
}

/// How much a step did.
fn detail(step: &Step) -> String {
    let counted = |n: u64| theme::counted(n, "point", "points");
    match step.kind() {
        EditKind::SetParameters | EditKind::SetViewpoints => String::new(),
        EditKind::Select | EditKind::Hide | EditKind::Accept | EditKind::Pin | EditKind::Unpin | EditKind::Recipe => {
            counted(step.change().n_points())
        }
        _ => counted(step.n_turned()),
    }
}
