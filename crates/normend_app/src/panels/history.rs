//! The list of what was done: a click goes there, back or forth.

use egui::{Button, RichText, ScrollArea, Ui, Vec2};
use normend_core::document::Step;
use normend_core::{EditKind, Parameters, Preset, Start};

use crate::command::Action;
use crate::session::Session;
use crate::theme;

const ROW_HEIGHT: f32 = 24.0;
/// Most characters of what parameters became, so that a row stays one line.
const PARAMETERS_CHARS: usize = 34;

/// The tab. Only the rows in sight are laid out.
pub fn ui(ui: &mut Ui, session: &Session) -> Option<Action> {
    let document = &session.document;
    let n_steps = document.steps().count();
    let n_points = document.cloud().n_points() as u64;
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
                Some(step) => words(step, n_points),
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

/// What a step did, and how much, in a cloud of `n_points`.
fn words(step: &Step, n_points: u64) -> (String, String) {
    let counted = |n: u64| theme::counted(n, "point", "points");
    let [before, after] = step.sizes();
    let change = step.change();
    let text = step.kind().label();
    let (text, n) = match step.kind() {
        EditKind::SetParameters => {
            let changes = step.parameters().map(parameter_words).unwrap_or_default();
            let changes = if changes.is_empty() {
                String::new()
            } else {
                format!(": {changes}")
            };
            return (
                format!("{text}{}", theme::elided(&changes, PARAMETERS_CHARS)),
                String::new(),
            );
        }
        EditKind::SetViewpoints | EditKind::SetScanner => return (text.to_owned(), String::new()),
        EditKind::Select => {
            let text = match parts(change.selected.len(), before.selected, after.selected) {
                _ if after.selected == 0 => "Select none",
                (0, _) => "Deselect",
                (_, 0) => "Select",
                _ => "Select others",
            };
            (text, change.selected.len())
        }
        EditKind::Hide => match parts(change.hidden.len(), before.hidden, after.hidden) {
            _ if after.hidden == 0 => ("Show all", change.hidden.len()),
            (0, n_shown) => ("Show", n_shown),
            // Where most is hidden, what is left is what was meant.
            (_, n_shown) if n_shown > 0 || after.hidden > n_points / 2 => ("Show only", n_points - after.hidden),
            (n_hidden, _) => ("Hide", n_hidden),
        },
        EditKind::Accept => match parts(change.accepted.len(), before.accepted, after.accepted) {
            (0, n_left) => ("Accept no longer", n_left),
            (n_joined, _) => (text, n_joined),
        },
        EditKind::Pin | EditKind::Unpin | EditKind::Recipe => (text, change.n_points()),
        _ => (text, step.n_turned()),
    };
    (text.to_owned(), counted(n))
}

/// How many points joined a set and how many left it, when `n_toggled` did either.
fn parts(n_toggled: u64, before: u64, after: u64) -> (u64, u64) {
    let n_joined = (n_toggled + after).saturating_sub(before) / 2;
    (n_joined, n_toggled.saturating_sub(n_joined))
}

/// What became of parameters, in a few words.
fn parameter_words([before, after]: [Parameters; 2]) -> String {
    let mut words = Vec::new();
    if before.start != after.start {
        words.push(after.start.label().to_owned());
    }
    let preset = Preset::of(&after).filter(|_| after.start == Start::Estimate);
    match preset {
        Some(preset) if Preset::of(&before) != Some(preset) || before.start != after.start => {
            words.push(format!("preset {}", preset.label()));
        }
        _ => words.extend(single_words(before, after)),
    }
    if before.rule != after.rule {
        words.push(format!("right side {}", after.rule.label()));
    }
    words.join(", ")
}

/// The parameters that a preset sets, each on its own.
fn single_words(before: Parameters, after: Parameters) -> Vec<String> {
    let mut words = Vec::new();
    let mut say = |differs: bool, word: String| {
        if differs {
            words.push(word);
        }
    };
    let numbers = |name, before: usize, after: usize| format!("{name} {before} → {after}");
    say(before.method != after.method, "another method".to_owned());
    say(before.estimator != after.estimator, after.estimator.label().to_owned());
    let (k, k_after) = (before.k_normals, after.k_normals);
    say(k != k_after, numbers("normals k", k, k_after));
    let (k, k_after) = (before.k_graph, after.k_graph);
    say(k != k_after, numbers("graph k", k, k_after));
    say(before.edge_rule != after.edge_rule, after.edge_rule.label().to_owned());
    say(before.sources != after.sources, after.sources.label().to_owned());
    say(before.views != after.views, numbers("views", before.views, after.views));
    say(before.eta != after.eta, format!("eta {} → {}", before.eta, after.eta));
    words
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use glam::Vec3;
    use normend_core::{Document, Edit, PointCloud, PointSet};

    use super::*;

    #[test]
    fn steps_say_what_they_did() {
        let positions = (0..10_u8).map(|x| Vec3::X * f32::from(x)).collect();
        let cloud = Arc::new(PointCloud::new(glam::DVec3::ZERO, positions).unwrap());
        let normals = Arc::new(vec![Vec3::Z; 10]);
        let mut document = Document::new(cloud, Some(normals));
        let mut check = |edit: Edit, text: &str, detail: &str| {
            document.apply(edit).unwrap();
            let said = words(document.next_undo().unwrap(), 10);
            assert_eq!((said.0.as_str(), said.1.as_str()), (text, detail));
        };
        let set = |range: std::ops::Range<u32>| PointSet::from_iter(range);
        check(Edit::Select(set(0..4)), "Select", "4 points");
        check(Edit::Select(set(0..1)), "Deselect", "3 points");
        check(Edit::Select(set(5..7)), "Select others", "3 points");
        check(Edit::Select(set(0..0)), "Select none", "2 points");
        check(Edit::Hide(set(0..3)), "Hide", "3 points");
        check(Edit::Hide(set(1..3)), "Show", "1 point");
        check(Edit::Hide(set(1..9)), "Show only", "2 points");
        check(Edit::Hide(set(0..0)), "Show all", "8 points");
        check(Edit::Accept(set(0..2)), "Accept", "2 points");
        check(Edit::Accept(set(0..1)), "Accept no longer", "1 point");
    }

    #[test]
    fn parameters_say_what_changed() {
        let tree = Preset::Tree.parameters();
        let graph = Parameters {
            k_graph: tree.k_graph + 2,
            ..tree
        };
        let check = |before, after, expect: &str| assert_eq!(parameter_words([before, after]), expect);
        check(tree, graph, "graph k 6 → 8");
        check(
            tree,
            Preset::Auto.parameters(),
            &format!("preset {}", Preset::Auto.label()),
        );
        let kept = Parameters {
            start: Start::Keep,
            ..tree
        };
        check(kept, tree, &format!("Estimate, preset {}", Preset::Tree.label()));
        check(tree, kept, "Keep given");
    }
}
