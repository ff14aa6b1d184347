//! Who says which side is right: kinds of sources, the list of the user's own, votes, viewpoints, and the parts with their rules.

use egui::{Button, Color32, RichText, ScrollArea, Ui, Vec2};
use normend_core::sources::Origin;

use super::{components, scanner, viewpoints, votes};
use crate::command::{Action, Command};
use crate::session::Session;
use crate::source_kinds::SourceKind;
use crate::theme::{self, SPACE_S, SPACE_XS};

const ROW_HEIGHT: f32 = 24.0;
const LIST_HEIGHT: f32 = 180.0;
/// Radius of the ball beside the name of a kind, in points.
const BALL: f32 = 5.0;

/// What the kinds are.
const ABOUT_KINDS: &str = "What says the side of points, by kind. The box shows or hides it in the view.";

/// What the words of the rows mean.
const ABOUT_LIST: &str = "Points whose side you decided.\nFlipped: the source turned its point.\n\
                          Kept: it holds the side that the point has without sources.";

/// The tab. `blocked` says why nothing can be oriented again now.
pub fn ui(ui: &mut Ui, session: &mut Session, blocked: Option<&str>) -> Option<Action> {
    let mut action = theme::section_about(ui, "Sources", ABOUT_KINDS, |ui| kinds(ui, session, blocked));
    if !session.document.sources().is_empty() {
        let listed = theme::section_about(ui, "Your sources", ABOUT_LIST, |ui| list(ui, session));
        action = action.or(listed);
    }
    if session.document.propagation().is_some() {
        // Places that are known come first; the field to type one is seldom needed.
        let has_places = session.scanner.places.words().is_some() || !session.document.state().scanner.own.is_empty();
        if has_places {
            action = scanner::ui(ui, session, blocked).or(action);
        }
        let voted = theme::section_about(ui, "Votes", votes::ABOUT, |ui| {
            ui.add_enabled_ui(blocked.is_none(), |ui| votes::ui(ui, session)).inner
        });
        action = action.or(voted);
        action = viewpoints::ui(ui, session).or(action);
        let parts = theme::section_about(ui, "Components", components::ABOUT, |ui| {
            components::ui(ui, session, blocked)
        });
        action = action.or(parts);
        if !has_places {
            action = scanner::ui(ui, session, blocked).or(action);
        }
    }
    action
}

/// The kinds that there are, each with what can be done with all of it.
fn kinds(ui: &mut Ui, session: &Session, blocked: Option<&str>) -> Option<Action> {
    let mut action = None;
    let present: Vec<SourceKind> = (SourceKind::ALL.into_iter())
        .filter(|&kind| session.kinds.count(kind) > 0)
        .collect();
    for &kind in &present {
        ui.horizontal(|ui| {
            ui.spacing_mut().item_spacing.x = SPACE_XS;
            let mut shown = session.kinds.is_shown(kind);
            let show = ui.checkbox(&mut shown, "");
            let show = show.accessible_name(format!("Show {}", kind.label()));
            if show.on_hover_text("Show in the view").changed() {
                action = Some(Action::ShowKind(kind, shown));
            }
            let (place, _) = ui.allocate_exact_size(Vec2::new(2.0 * BALL + SPACE_XS, ROW_HEIGHT), egui::Sense::hover());
            if let Some(color) = kind.color() {
                ui.painter().circle_filled(place.center(), BALL, color);
            } else if kind != SourceKind::Scanner {
                // These are green or pink, by what they do.
                let [kept, flipped] = [theme::SOURCE_KEPT, theme::SOURCE_FLIPPED].map(color_of);
                ui.painter()
                    .circle_filled(place.center() - Vec2::new(2.0, 0.0), BALL - 1.0, kept);
                ui.painter()
                    .circle_filled(place.center() + Vec2::new(3.0, 0.0), BALL - 1.0, flipped);
            }
            ui.label(kind.label()).on_hover_text(kind.about());
            ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
                let orients = matches!(kind, SourceKind::Voted | SourceKind::Scanner | SourceKind::File);
                let drop = ui.add_enabled(!orients || blocked.is_none(), Button::new("Drop").small());
                let drop = drop.accessible_name(format!("Drop {}", kind.label()));
                let drop = drop.on_hover_text(kind.drop_tooltip());
                if drop.on_disabled_hover_text(blocked.unwrap_or_default()).clicked() {
                    action = Some(Action::DropKind(kind));
                }
                ui.add_space(SPACE_XS);
                ui.label(RichText::new(theme::thousands(session.kinds.count(kind))).weak());
            });
        });
    }
    let is_own = |kind: &SourceKind| !matches!(kind, SourceKind::Voted | SourceKind::Scanner | SourceKind::File);
    if !present.iter().any(is_own) {
        let hint = "You made none yet. Click a wrong region in the view: it turns, and its point becomes a source.";
        ui.add(egui::Label::new(RichText::new(hint).weak()).wrap());
    }
    action
}

fn color_of(color: [f32; 3]) -> Color32 {
    let [r, g, b] = color.map(|channel| (channel * 255.0).round() as u8);
    Color32::from_rgb(r, g, b)
}

/// The list and its buttons: select, flip, remove, fly to. Only the rows in sight are laid out.
fn list(ui: &mut Ui, session: &mut Session) -> Option<Action> {
    let reveal = session.reveal.take();
    let session = &*session;
    let sources = session.document.sources();
    let mut action = None;
    ui.horizontal(|ui| {
        ui.spacing_mut().item_spacing.x = SPACE_XS;
        let n_selected = session.selected.len();
        for command in [Command::FlipSources, Command::RemoveSources] {
            let short = if command == Command::FlipSources {
                "Flip"
            } else {
                "Remove"
            };
            let button = ui.add_enabled(n_selected > 0, Button::new(short));
            let tooltip = command.tooltip_with_keys(ui.ctx());
            if button
                .on_hover_text(tooltip)
                .on_disabled_hover_text("Select sources first")
                .clicked()
            {
                action = Some(command.into());
            }
        }
        let one = session.selected.first().filter(|_| n_selected == 1);
        let button = ui.add_enabled(one.is_some(), Button::new("Show"));
        let button = button.on_hover_text("Bring this source into view");
        if button.on_disabled_hover_text("Select one source first").clicked() {
            action = one.map(|&point| Action::FlyTo(point));
        }
        if n_selected > 0 {
            ui.label(RichText::new(format!("{} of {}", theme::thousands(n_selected as u64), sources.len())).weak());
        }
    });
    ui.add_space(SPACE_XS);
    let mut list = ScrollArea::vertical()
        .id_salt("sources")
        .max_height(LIST_HEIGHT)
        .auto_shrink([false, true]);
    // A source that was just made is brought into the middle of the list.
    if let Some(index) = reveal.and_then(|point| sources.iter().position(|source| source.point == point)) {
        let pitch = ROW_HEIGHT + ui.spacing().item_spacing.y;
        list = list.vertical_scroll_offset((index as f32 * pitch - 0.5 * (LIST_HEIGHT - pitch)).max(0.0));
    }
    list.show_rows(ui, ROW_HEIGHT, sources.len(), |ui, rows| {
        for source in sources.iter().skip(rows.start).take(rows.len()) {
            let flipped = session.document.is_flipped(source);
            let response = row(
                ui,
                source.point,
                flipped,
                source.origin,
                session.selected.contains(&source.point),
            );
            if response.double_clicked() {
                action = Some(Action::FlyTo(source.point));
            } else if response.clicked() {
                let extend = ui.input(|input| input.modifiers.shift || input.modifiers.command);
                action = Some(Action::SelectSource {
                    point: source.point,
                    extend,
                });
            }
        }
    });
    action
}

fn row(ui: &mut Ui, point: u32, flipped: bool, origin: Origin, selected: bool) -> egui::Response {
    let state = if flipped { "flipped" } else { "kept" };
    let by = match origin {
        Origin::Rule(rule) => rule.label(),
        origin => origin.label(),
    };
    let text = format!("      Point {}", theme::thousands(u64::from(point)));
    let button = Button::selectable(selected, text)
        .shortcut_text(format!("{state}, {}", by.to_lowercase()))
        .min_size(Vec2::new(ui.available_width(), ROW_HEIGHT));
    let state = if flipped {
        "It turned its point."
    } else {
        "It holds the side that its point has without sources."
    };
    let about = SourceKind::of(origin).about();
    let response = ui.add(button).on_hover_text(format!(
        "{state}\n{about}\nClick to select, double-click to bring into view."
    ));
    let color = color_of(if flipped {
        theme::SOURCE_FLIPPED
    } else {
        theme::SOURCE_KEPT
    });
    let center = response.rect.left_center() + Vec2::new(SPACE_S + 8.0, 0.0);
    ui.painter().circle_filled(center, BALL, color);
    response
}
