//! The suspects: a ranked list with small pictures, and a card in the view that gives both sides of the argument.

use egui::{
    Align, Align2, Area, Button, Id, Image, Label, Layout, Order, ProgressBar, Rect, RichText, ScrollArea, Sense, Ui,
    Vec2,
};
use normend_core::suspects::{Grounds, Kind, LEAST_POINTS, Suspect};

use crate::command::{Action, Command};
use crate::session::Session;
use crate::suspect_pictures::{self, SuspectPictures};
use crate::suspects_list::{Row, Standing, SuspectAction, SuspectsList};
use crate::theme::{self, SPACE_L, SPACE_M, SPACE_S, SPACE_XS};

/// What the list is.
pub const ABOUT: &str = "Patches that probably point to the wrong side, the most likely and largest first.\n\
                         Nothing is turned before you say so.";

/// Height of a row, in points.
const ROW_HEIGHT: f32 = suspect_pictures::SIZE.y + 2.0 * SPACE_XS;
/// Width of the card, in points.
const CARD_WIDTH: f32 = 540.0;
/// From here on (or below its opposite) the seam says something.
const CLEAR_SEAM: f32 = 0.1;

/// The tab.
pub fn ui(ui: &mut Ui, session: &mut Session, pictures: &mut SuspectPictures) -> Option<Action> {
    let mut action = None;
    let list = &mut session.suspects;
    if let Some(status) = list.status() {
        action = running(ui, &status);
    } else if session.document.propagation().is_none() {
        hint(ui, "The scan is not oriented yet.");
        return None;
    } else if !list.is_known() {
        let text = match list.stopped() {
            Some(Some(reason)) => format!("{reason} Nothing was looked for."),
            _ => "Nothing was looked for yet.".to_owned(),
        };
        hint(ui, &text);
        if look_button(ui, true) {
            action = Some(SuspectAction::Look.into());
        }
        return action;
    }
    if !list.is_known() {
        return action;
    }
    let [n_open, n_turned, n_accepted] =
        [Standing::Open, Standing::Turned, Standing::Accepted].map(|standing| list.count(standing));
    let is_old = list.is_old(&session.document);
    if list.status().is_none() {
        if is_old {
            ui.add(Label::new("Signs changed since this was looked for.").wrap());
        }
        ui.horizontal(|ui| {
            ui.spacing_mut().item_spacing.x = SPACE_XS;
            // From an old list, too, the next is found by looking again.
            action = buttons(ui, n_open > 0 || is_old).or(action.take());
            if look_button(ui, is_old) {
                action = Some(SuspectAction::Look.into());
            }
        });
    }
    let mut summary = vec![theme::counted(n_open as u64, "suspect", "suspects")];
    if n_turned > 0 {
        summary.push(format!("{} flipped", theme::thousands(n_turned as u64)));
    }
    if n_accepted > 0 {
        summary.push(format!("{} accepted", theme::thousands(n_accepted as u64)));
    }
    ui.add_space(SPACE_XS);
    if list.is_stale(&session.document) {
        // What it counts is of signs that are no more.
    } else if n_open > 0 || (is_old && summary.len() > 1) {
        ui.label(RichText::new(summary.join(" · ")).weak());
    } else if !is_old {
        ui.label(RichText::new("Nothing is suspected").strong());
        if let Some(grounds) = list.grounds() {
            ui.add(Label::new(RichText::new(belief(grounds)).weak()).wrap());
        }
        if summary.len() > 1 {
            ui.label(RichText::new(summary[1..].join(" · ")).weak());
        }
    }
    ui.add_space(SPACE_XS);
    rows(ui, list, pictures).or(action).or_else(|| {
        if n_accepted > 0 {
            let text = format!("Show the {} accepted", theme::thousands(n_accepted as u64));
            ui.checkbox(&mut list.shows_accepted, text).on_hover_text(
                "Accepted patches are no suspects any more, also after looking again; they can be taken back",
            );
        }
        None
    })
}

fn hint(ui: &mut Ui, text: &str) {
    ui.add(Label::new(RichText::new(text).weak()).wrap());
}

/// The button to look; the next thing to do where `is_due`.
fn look_button(ui: &mut Ui, is_due: bool) -> bool {
    let button = if is_due {
        theme::primary_button(ui, "Look again")
    } else {
        Button::new("Look again")
    };
    let tooltip = Command::FindSuspects.tooltip_with_keys(ui.ctx());
    ui.add(button).on_hover_text(tooltip).clicked()
}

fn running(ui: &mut Ui, status: &crate::job::JobStatus) -> Option<Action> {
    let mut action = None;
    ui.label(RichText::new(&status.stage).weak());
    ui.horizontal(|ui| {
        let bar = ProgressBar::new(status.fraction)
            .desired_width(theme::content_width(ui) - 90.0)
            .desired_height(8.0);
        ui.add(bar).accessible_name("Looking for suspects");
        let button = ui.add_enabled(!status.cancelling, Button::new("Stop"));
        if button.on_hover_text("Stop looking").clicked() {
            action = Some(SuspectAction::Stop.into());
        }
    });
    action
}

fn buttons(ui: &mut Ui, any: bool) -> Option<Action> {
    let mut action = None;
    for (text, command) in [("Next", Command::NextSuspect), ("Previous", Command::PreviousSuspect)] {
        let button = ui.add_enabled(any, Button::new(text));
        let tooltip = command.tooltip_with_keys(ui.ctx());
        let button = button.on_hover_text(tooltip);
        if button.on_disabled_hover_text("Nothing is suspected").clicked() {
            action = Some(command.into());
        }
    }
    action
}

/// The rows that are not settled, and accepted ones if they are asked for; only those in sight are laid out.
fn rows(ui: &mut Ui, list: &SuspectsList, pictures: &mut SuspectPictures) -> Option<Action> {
    let is_listed = |standing: Standing| match standing {
        Standing::Open => true,
        Standing::Turned => false,
        Standing::Accepted => list.shows_accepted,
    };
    let listed: Vec<(usize, &Row, Standing)> = (list.rows().enumerate())
        .filter(|(_, (_, standing))| is_listed(*standing))
        .map(|(index, (row, standing))| (index, row, standing))
        .collect();
    let mut action = None;
    ScrollArea::vertical()
        .id_salt("suspects")
        .max_height((ui.available_height() - 40.0).max(3.0 * ROW_HEIGHT))
        .auto_shrink([false, true])
        .show_rows(ui, ROW_HEIGHT, listed.len(), |ui, range| {
            for &(index, row, standing) in &listed[range] {
                let is_focused = list.focus() == Some(index);
                if let Some(chosen) = row_ui(ui, index, row, standing, is_focused, pictures) {
                    action = Some(chosen.into());
                }
            }
        });
    action
}

fn row_ui(
    ui: &mut Ui,
    index: usize,
    row: &Row,
    standing: Standing,
    is_focused: bool,
    pictures: &mut SuspectPictures,
) -> Option<SuspectAction> {
    let (rect, response) = ui.allocate_exact_size(Vec2::new(ui.available_width(), ROW_HEIGHT), Sense::click());
    let n_points = theme::counted(row.points.len(), "point", "points");
    let title = format!("{n_points} · {}", percent(row.suspect.score));
    let reason = reason(&row.suspect);
    let label = format!("Suspect {}: {title}, {reason}", index + 1);
    response.widget_info(|| egui::WidgetInfo::selected(egui::accesskit::Role::Button, true, is_focused, &label));
    let visuals = ui.style().interact_selectable(&response, is_focused);
    if is_focused || response.hovered() || response.has_focus() {
        ui.painter().rect(
            rect,
            4.0,
            visuals.weak_bg_fill,
            if response.has_focus() {
                visuals.bg_stroke
            } else {
                egui::Stroke::NONE
            },
            egui::StrokeKind::Inside,
        );
    }
    let place = Rect::from_min_size(rect.min + Vec2::splat(SPACE_XS), suspect_pictures::SIZE);
    match pictures.get(index) {
        Some(texture) => Image::new(texture).corner_radius(3.0).paint_at(ui, place),
        None => {
            ui.painter().rect_filled(place, 3.0, ui.visuals().faint_bg_color);
        }
    }
    let text_left = place.right() + SPACE_S;
    let text_rect = Rect::from_min_max(
        egui::pos2(text_left, rect.top() + SPACE_XS),
        rect.max - Vec2::splat(SPACE_XS),
    );
    let mut text = ui.new_child(egui::UiBuilder::new().max_rect(text_rect));
    text.spacing_mut().item_spacing.y = 1.0;
    text.add(
        Label::new(RichText::new(title).color(ui.visuals().strong_text_color()))
            .truncate()
            .selectable(false),
    );
    let quiet = if is_focused {
        ui.visuals().strong_text_color()
    } else {
        ui.visuals().weak_text_color()
    };
    let small = |text: &str| RichText::new(text).small().color(quiet);
    let mut taken_back = None;
    if standing == Standing::Accepted {
        text.horizontal(|ui| {
            ui.label(small("Accepted"));
            let button = ui.add(Button::new("Take back").small());
            if button.on_hover_text("Suspect it again").clicked() {
                taken_back = Some(SuspectAction::TakeBack(index));
            }
        });
    } else {
        text.add(Label::new(small(&reason)).wrap().selectable(false));
    }
    let focuses = response.on_hover_text("Click to fly there").clicked() && standing == Standing::Open;
    taken_back.or(focuses.then_some(SuspectAction::Focus(index)))
}

/// Both sides of the argument about the suspect in focus, at the upper left of `view`.
pub fn card(ui: &Ui, view: Rect, list: &SuspectsList) -> Option<Action> {
    let index = list.focus()?;
    let row = list.row(index)?;
    let mut action = None;
    Area::new(Id::unique("suspect"))
        .order(Order::Middle)
        .pivot(Align2::LEFT_TOP)
        .fixed_pos(view.left_top() + Vec2::splat(SPACE_M))
        .show(ui.ctx(), |ui| {
            theme::card(ui).show(ui, |ui| {
                ui.set_width(CARD_WIDTH.min(view.width() - 6.0 * SPACE_M));
                let open: Vec<usize> = (list.rows().enumerate())
                    .filter(|(_, (_, standing))| *standing == Standing::Open)
                    .map(|(index, _)| index)
                    .collect();
                let place = open.iter().position(|&each| each == index).unwrap_or_default() + 1;
                let n_points = theme::counted(row.points.len(), "point", "points");
                ui.horizontal(|ui| {
                    let title = format!("Suspect {place} of {}", open.len());
                    ui.label(RichText::new(title).color(theme::accent(ui)).strong());
                    ui.label(format!("{n_points}, {} to be wrong", percent(row.suspect.score)));
                });
                ui.add_space(SPACE_XS);
                let [flip, keep] = arguments(&row.suspect);
                let width = 0.5 * (ui.available_width() - SPACE_L);
                ui.horizontal_top(|ui| {
                    ui.spacing_mut().item_spacing = Vec2::new(SPACE_L, SPACE_XS);
                    for (title, reasons) in [("To flip it", flip), ("To keep it", keep)] {
                        let column = Layout::top_down(Align::LEFT);
                        ui.allocate_ui_with_layout(Vec2::new(width, 0.0), column, |ui| {
                            ui.set_width(width);
                            ui.label(RichText::new(title).strong());
                            if reasons.is_empty() {
                                ui.label(RichText::new("Nothing").weak());
                            }
                            for reason in reasons {
                                ui.add(Label::new(reason).wrap());
                            }
                        });
                    }
                });
                ui.add_space(SPACE_S);
                ui.horizontal(|ui| {
                    ui.spacing_mut().item_spacing.x = SPACE_XS;
                    let flip_key = RichText::new(Command::MendHere.keys_text(ui.ctx())).color(egui::Color32::WHITE);
                    let flip = theme::primary_button(ui, "Flip").shortcut_text(flip_key);
                    let accept = Button::new("Accept").shortcut_text(Command::AcceptSuspect.keys_text(ui.ctx()));
                    let next = Button::new("Next").shortcut_text(Command::NextSuspect.keys_text(ui.ctx()));
                    for (button, chosen, tooltip) in [
                        (
                            flip,
                            SuspectAction::Flip(index),
                            "Turn these points, and go on to the next suspect",
                        ),
                        (accept, SuspectAction::Accept(index), Command::AcceptSuspect.tooltip()),
                        (next, SuspectAction::Next, Command::NextSuspect.tooltip()),
                    ] {
                        if ui.add(button).on_hover_text(tooltip).clicked() {
                            action = Some(chosen.into());
                        }
                    }
                    let close = ui.add(Button::new("Close").shortcut_text(Command::Cancel.keys_text(ui.ctx())));
                    if close.on_hover_text("Leave the suspects").clicked() {
                        action = Some(SuspectAction::Leave.into());
                    }
                });
            });
        });
    action
}

/// How likely it is, in words.
fn percent(score: f32) -> String {
    let percent = (100.0 * score).round();
    if percent < 100.0 {
        format!("{percent:.0}% likely")
    } else {
        "over 99% likely".to_owned()
    }
}

/// The strongest reason, in a few words.
fn reason(suspect: &Suspect) -> String {
    let why = match suspect.kind {
        Kind::Whole => "the whole part looks the other way than the automatic method finds",
        _ if suspect.seam < -CLEAR_SEAM => "looks the other way than its surroundings",
        Kind::Differs => "the automatic method has it the other way round",
        Kind::Doubtful => "the automatic method is not sure of it",
    };
    let (with, against) = (suspect.votes_for, suspect.votes_against);
    if with + against < 0.5 {
        format!("{why}; nobody sees it")
    } else if against > with {
        format!("{why}; seen from behind {} to {}", looks(against), looks(with))
    } else {
        format!("{why}; yet seen from the front {} to {}", looks(with), looks(against))
    }
}

fn looks(votes: f32) -> String {
    theme::thousands(votes.round() as u64)
}

/// What speaks for flipping, and what for keeping.
fn arguments(suspect: &Suspect) -> [Vec<String>; 2] {
    let (mut flip, mut keep) = (Vec::new(), Vec::new());
    match suspect.kind {
        Kind::Differs => flip.push("The automatic method disagrees.".to_owned()),
        Kind::Whole => flip.push("The automatic method has the whole part the other way round.".to_owned()),
        Kind::Doubtful => keep.push("The automatic method agrees, but is not sure.".to_owned()),
    }
    if suspect.kind != Kind::Whole {
        let seam = suspect.seam;
        if seam < -CLEAR_SEAM {
            flip.push(format!("Neighbors disagree (seam {seam:.2}).").replace('-', "−"));
        } else if seam > CLEAR_SEAM {
            keep.push(format!("It fits its surroundings (seam {seam:.2})."));
        }
    }
    let seen = |votes: f32, side: &str| {
        let n = votes.round() as u64;
        (n > 0).then(|| format!("{} {side}.", theme::counted(n, "look sees", "looks see")))
    };
    flip.extend(seen(suspect.votes_against, "its back"));
    keep.extend(seen(suspect.votes_for, "its front"));
    if suspect.votes_for + suspect.votes_against < 0.5 {
        keep.push("Nobody sees it.".to_owned());
    }
    [flip, keep]
}

/// Why nothing is suspected.
fn belief(grounds: &Grounds) -> String {
    let mut text = format!(
        "The side of {:.0}% of the points is seen, and the most doubtful patch of {LEAST_POINTS} points or more is {} to be right.",
        (100.0 * grounds.share_known).floor(),
        percent(grounds.weakest),
    );
    if grounds.n_undecided > 0 {
        let parts = theme::counted(grounds.n_components as u64, "part", "parts");
        text += &format!(
            " Nothing tells the side of {} of {parts}: see Components in the tab Sources.",
            theme::thousands(grounds.n_undecided as u64)
        );
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    fn suspect(kind: Kind, seam: f32, votes_for: f32, votes_against: f32) -> Suspect {
        Suspect {
            points: vec![1, 2, 3],
            point: 2,
            score: 0.93,
            kind,
            seam,
            votes_for,
            votes_against,
        }
    }

    #[test]
    fn reasons_are_plain_words() {
        let check = |kind, seam, votes: [f32; 2], expect: &str| {
            assert_eq!(reason(&suspect(kind, seam, votes[0], votes[1])), expect);
        };
        check(
            Kind::Differs,
            -0.8,
            [2.0, 1041.2],
            "looks the other way than its surroundings; seen from behind 1,041 to 2",
        );
        check(
            Kind::Doubtful,
            0.4,
            [0.0, 0.0],
            "the automatic method is not sure of it; nobody sees it",
        );
        check(
            Kind::Differs,
            0.9,
            [3.0, 1.0],
            "the automatic method has it the other way round; yet seen from the front 3 to 1",
        );
    }

    #[test]
    fn each_argument_is_on_its_side() {
        let [flip, keep] = arguments(&suspect(Kind::Differs, -0.8, 1.0, 41.0));
        assert_eq!(flip.len(), 3);
        assert!(flip[1].contains("seam −0.80"), "{flip:?}");
        assert_eq!(flip[2], "41 looks see its back.");
        assert_eq!(keep, ["1 look sees its front."]);
        let [flip, keep] = arguments(&suspect(Kind::Doubtful, 0.8, 0.0, 0.0));
        assert!(flip.is_empty());
        assert_eq!(keep.len(), 3);
    }

    #[test]
    fn belief_has_its_figures() {
        let grounds = Grounds {
            share_known: 0.987,
            weakest: 0.9199,
            n_components: 1200,
            n_undecided: 3,
        };
        let text = belief(&grounds);
        for part in ["98% of the points", "92% likely to be right", "3 of 1,200 parts"] {
            assert!(text.contains(part), "{text}");
        }
    }
}
