//! The parts that hang together: how large each is, which rule says its side, and what can be done with it.

use egui::{Button, ComboBox, RichText, ScrollArea, Ui, Vec2};
use normend_core::{Propagation, SideRule};

use crate::command::{Action, Command};
use crate::components::{ComponentAction, Standing};
use crate::session::Session;
use crate::theme::{self, SPACE_XS};

/// What the section is.
pub const ABOUT: &str = "The parts of the scan that hang together. For each a rule decides which side is right.\n\
                         Those that nothing tells the side of come first, then the largest.";

const ROW_HEIGHT: f32 = 26.0;
const LIST_HEIGHT: f32 = 210.0;
/// Width of the size of a part, in points; its rule takes the rest of the row.
const SIZE_WIDTH: f32 = 108.0;

/// The section. `blocked` says why no rule can be asked.
pub fn ui(ui: &mut Ui, session: &Session, blocked: Option<&str>) -> Option<Action> {
    let components = &session.components;
    let propagation = session.document.propagation()?;
    let mut action = None;
    if let Some(status) = components.status() {
        ui.horizontal(|ui| {
            ui.spinner();
            ui.label(RichText::new(&status.stage).weak());
            let stop = ui.add_enabled(!status.cancelling, Button::new("Stop").small());
            if stop.on_hover_text("Stop; the parts stay as they are").clicked() {
                action = Some(ComponentAction::Stop.into());
            }
        });
    } else {
        let mut text = theme::counted(components.len() as u64, "part", "parts");
        let n_undecided = session.n_undecided();
        if n_undecided > 0 {
            text += &format!(", {} could face either way", theme::thousands(n_undecided as u64));
        }
        ui.label(RichText::new(text).weak());
    }
    let idle = blocked.is_none() && components.status().is_none();
    ui.add_enabled_ui(idle, |ui| {
        action = buttons(ui, session).map(Action::from).or(action.take());
        if components.len() > 1 {
            ui.horizontal(|ui| {
                ui.spacing_mut().item_spacing.x = SPACE_XS;
                let (place, _) = ui.allocate_exact_size(Vec2::new(SIZE_WIDTH, ROW_HEIGHT), egui::Sense::hover());
                let name = ui.put(place, egui::Label::new(RichText::new("All parts").weak()));
                let (chosen, combo) = rules(ui, session, propagation, "all parts", "Choose a rule", None);
                combo.labelled_by(name.id);
                action = chosen.map(Action::from).or(action.take());
            });
        }
        let chosen = list(ui, session, propagation);
        action = chosen.map(Action::from).or(action.take());
    });
    action
}

/// What can be done with the part that is chosen.
fn buttons(ui: &mut Ui, session: &Session) -> Option<ComponentAction> {
    let focus = session.components.focus();
    let mut chosen = None;
    ui.horizontal_wrapped(|ui| {
        ui.spacing_mut().item_spacing.x = SPACE_XS;
        let button = |ui: &mut Ui, text: &str, tooltip: &str| {
            let response = ui.add_enabled(focus.is_some(), Button::new(text));
            let response = response.accessible_name(format!("{text} the part"));
            let response = response.on_hover_text(tooltip);
            response
                .on_disabled_hover_text("Click the size of a part first")
                .clicked()
        };
        if button(ui, "Flip", "Turn the whole part") {
            chosen = focus.map(ComponentAction::Flip);
        }
        if button(ui, "Select", "Select its points") {
            chosen = focus.map(ComponentAction::Select);
        }
        if session.document.hidden().is_empty() {
            if button(ui, "Isolate", "Hide all other points") {
                chosen = focus.map(ComponentAction::Isolate);
            }
        } else if ui
            .button("Show hidden")
            .on_hover_text(Command::ShowAll.tooltip_with_keys(ui.ctx()))
            .clicked()
        {
            chosen = Some(ComponentAction::ShowHidden);
        }
        if button(ui, "Show", "Bring it into view") {
            chosen = focus.map(ComponentAction::Show);
        }
    });
    chosen
}

/// The rows in sight.
fn list(ui: &mut Ui, session: &Session, propagation: &Propagation) -> Option<ComponentAction> {
    let components = &session.components;
    let mut action = None;
    ScrollArea::vertical()
        .id_salt("components")
        .max_height(LIST_HEIGHT)
        .auto_shrink([false, true])
        .show_rows(ui, ROW_HEIGHT, components.len(), |ui, rows| {
            for (component, n_points) in rows.filter_map(|row| components.row(row)) {
                ui.horizontal(|ui| {
                    ui.spacing_mut().item_spacing.x = SPACE_XS;
                    let is_focused = components.focus() == Some(component);
                    let size = theme::counted(n_points as u64, "point", "points");
                    let button = Button::selectable(is_focused, size).min_size(Vec2::new(SIZE_WIDTH, ROW_HEIGHT));
                    let response = ui
                        .add(button)
                        .on_hover_text("Click to choose this part, double-click to bring it into view");
                    if response.double_clicked() {
                        action = Some(ComponentAction::Show(component));
                    } else if response.clicked() {
                        action = Some(ComponentAction::Focus(component));
                    }
                    let standing = components.standing(propagation, component);
                    let (text, about) = in_words(standing);
                    let id = format!("part {component}");
                    let (chosen, combo) = rules(ui, session, propagation, &id, &text, Some((component, standing)));
                    let label = format!("Rule of the part of {n_points} points");
                    combo.accessible_name(label).on_hover_text(about);
                    action = chosen.or(action.take());
                });
            }
        });
    action
}

/// A list of rules to choose from, for one part or for all.
fn rules(
    ui: &mut Ui,
    session: &Session,
    propagation: &Propagation,
    id: &str,
    text: &str,
    part: Option<(usize, Standing)>,
) -> (Option<ComponentAction>, egui::Response) {
    let which = part.map(|(component, _)| component);
    let mut chosen = None;
    let color = if part.is_some_and(|(_, standing)| standing == Standing::Nothing) {
        ui.visuals().warn_fg_color
    } else {
        ui.visuals().text_color()
    };
    let combo = ComboBox::from_id_salt(("rule of", id))
        .selected_text(RichText::new(text).color(color))
        .width(ui.available_width())
        .truncate()
        .show_ui(ui, |ui| {
            let present = part.and_then(|(_, standing)| match standing {
                Standing::Chosen(rule) | Standing::Rule(rule, _) => Some(rule),
                _ => None,
            });
            for rule in SideRule::ALL {
                let missing = match rule {
                    // It stands for others, which are in the list themselves.
                    SideRule::Automatic => continue,
                    SideRule::TowardScanner if propagation.found_station.is_none() => {
                        Some("No place of the scanner was found; look from there and choose “Toward me”")
                    }
                    SideRule::Given if session.document.given_normals().is_none() => Some("This file has no normals"),
                    _ => None,
                };
                let button = Button::selectable(present == Some(rule), rule.label());
                let response = ui.add_enabled(missing.is_none(), button);
                if response.on_disabled_hover_text(missing.unwrap_or_default()).clicked() {
                    chosen = Some(ComponentAction::Decide(which, rule));
                }
            }
            let toward_me = ui
                .button("Toward me")
                .on_hover_text("Toward the place that you look from now");
            if toward_me.clicked() {
                chosen = Some(ComponentAction::TowardMe(which));
            }
        });
    (chosen, combo.response)
}

/// Who says the side, shortly and as a sentence.
fn in_words(standing: Standing) -> (String, String) {
    match standing {
        Standing::Chosen(rule) => (
            format!("{}, chosen", rule.label()),
            "The rule that you chose decided its side".to_owned(),
        ),
        Standing::Sources => (
            "Your sources".to_owned(),
            "Sources that you made say its side".to_owned(),
        ),
        Standing::Rule(rule, agreement) => {
            let percent = (50.0 + 50.0 * agreement).floor();
            (
                format!("{}, {percent:.0}%", rule.label()),
                format!("{percent:.0}% of what is known of it says this side"),
            )
        }
        Standing::Votes => ("By votes".to_owned(), "Viewpoints voted for its side".to_owned()),
        Standing::AsGiven => ("As in the file".to_owned(), "Its signs came with the file".to_owned()),
        Standing::Highest => (
            "Highest point up".to_owned(),
            "Its highest point points up, for want of anything better".to_owned(),
        ),
        Standing::Nothing => (
            "Nothing tells".to_owned(),
            "Nothing tells which side is right: choose a rule, or flip it".to_owned(),
        ),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_rule_says_how_sure_it_is() {
        assert_eq!(in_words(Standing::Rule(SideRule::Outward, 0.94)).0, "Outward, 97%");
        assert_eq!(in_words(Standing::Rule(SideRule::Up, 1.0)).0, "Up, 100%");
        assert_eq!(
            in_words(Standing::Chosen(SideRule::IntoRoom)).0,
            "Into the room, chosen"
        );
    }
}
