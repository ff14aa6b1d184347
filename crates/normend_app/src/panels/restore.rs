//! The questions about edits that are not of this run: a journal that was left behind, a recipe of another file.

use std::time::SystemTime;

use egui::{Label, RichText, Ui};
use normend_io::recipe::ScanIdentity;

use super::modal;
use crate::journal::found::Offer;
use crate::theme::{self, SPACE_S};

const WIDTH: f32 = 440.0;
/// Characters of a file's name.
const MAX_NAME: usize = 60;
/// Kinds of edits that are listed; the rest is counted together.
const MOST_KINDS: usize = 6;

/// What the user decided about a journal.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Decision {
    /// Not yet.
    Wait,
    /// Make its edits again.
    Restore,
    /// Its edits are not wanted.
    Remove,
    /// Keep its edits as a recipe.
    Keep,
    /// Ask again the next time.
    Later,
    /// Ask about another one first.
    Other,
}

/// Asks about a journal of the scan called `name`, which has `n_points` now. `n_more` others can be asked about instead.
pub fn ui(ui: &Ui, name: &str, n_points: usize, offer: &Offer, n_more: usize) -> Decision {
    let n_edits = theme::counted(offer.n_edits() as u64, "edit", "edits");
    let title = if offer.is_same {
        format!("Restore {n_edits}?")
    } else {
        "The scan has changed".to_owned()
    };
    modal::show(ui, &title, WIDTH, |ui| {
        let name = theme::elided(name, MAX_NAME);
        let scan = &offer.reading.recipe.head.scan;
        let mut paragraphs = Vec::new();
        if offer.is_same {
            paragraphs.push(format!("Edits of {name} were kept that are in no exported file."));
        } else {
            let points = theme::counted(scan.n_points, "point", "points");
            let now = theme::thousands(n_points as u64);
            paragraphs.push(format!(
                "There is a journal with {n_edits} of an earlier content of {name} ({points}; now {now}). It is not applied, because it \
                 could turn other points than were meant."
            ));
        }
        if let Some(modified) = offer.modified {
            paragraphs.push(format!("Last edit: {}", moment(modified)));
        }
        for paragraph in paragraphs {
            ui.add(Label::new(paragraph).wrap());
        }
        kinds(ui, offer);
        let weak = |ui: &mut Ui, text: String| {
            ui.add(Label::new(RichText::new(text).weak()).wrap());
        };
        if offer.n_undone() > 0 {
            let undone = theme::counted(
                offer.n_undone() as u64,
                "edit that was undone",
                "edits that were undone",
            );
            weak(ui, format!("Redo can bring back {undone}."));
        }
        let program = &offer.reading.recipe.head.program;
        if program != env!("CARGO_PKG_VERSION") {
            weak(
                ui,
                format!("Made with Normend {program}; this is {}.", env!("CARGO_PKG_VERSION")),
            );
        }
        if let Some(damage) = offer.damage() {
            let text = format!("The journal is damaged, only the edits before that can be used: {damage}.");
            ui.add(Label::new(RichText::new(text).color(ui.visuals().warn_fg_color)).wrap());
        }
        if n_more > 0 {
            let more = theme::counted(n_more as u64, "other journal", "other journals");
            weak(
                ui,
                format!(
                    "There is {more} of this scan, from other times. What you do not choose stays, and is offered again."
                ),
            );
        }
        ui.add_space(SPACE_S);
        buttons(ui, offer.is_same, n_more > 0)
    })
}

/// How many edits of each kind.
fn kinds(ui: &mut Ui, offer: &Offer) {
    let kinds = offer.kinds();
    let mut lines: Vec<(String, usize)> = (kinds.iter().take(MOST_KINDS))
        .map(|&(kind, n)| (kind.label().to_owned(), n))
        .collect();
    let n_rest: usize = kinds.iter().skip(MOST_KINDS).map(|&(_, n)| n).sum();
    if n_rest > 0 {
        lines.push(("Others".to_owned(), n_rest));
    }
    ui.add_space(SPACE_S);
    for (kind, n) in lines {
        ui.label(format!("{} × {kind}", theme::thousands(n as u64)));
    }
    ui.add_space(SPACE_S);
}

fn buttons(ui: &mut Ui, is_same: bool, has_others: bool) -> Decision {
    let mut decision = Decision::Wait;
    ui.horizontal(|ui| {
        let enter = modal::enter_pressed(ui);
        let (first, about, meant) = if is_same {
            (
                "Restore",
                "Make these edits again, with their undo history",
                Decision::Restore,
            )
        } else {
            (
                "Keep as recipe…",
                "Save these edits as a file of their own",
                Decision::Keep,
            )
        };
        let button = ui.add(theme::primary_button(ui, first)).on_hover_text(about);
        if button.clicked() || enter {
            decision = meant;
        }
        let (second, about) = if is_same {
            ("Discard", "Remove these edits for good")
        } else {
            ("Delete", "Remove these edits for good")
        };
        if ui.button(second).on_hover_text(about).clicked() {
            decision = Decision::Remove;
        }
        let later = ui.button("Decide later");
        if later
            .on_hover_text("Ask again when this scan is opened the next time (Esc)")
            .clicked()
        {
            decision = Decision::Later;
        }
        if has_others
            && ui
                .button("Show another")
                .on_hover_text("See the other edits of this scan")
                .clicked()
        {
            decision = Decision::Other;
        }
    });
    decision
}

/// A moment in the user's time zone, as "2026-11-22 14:03".
fn moment(time: SystemTime) -> String {
    jiff::Zoned::try_from(time).map_or_else(
        |_| "unknown".to_owned(),
        |time| time.strftime("%Y-%m-%d %H:%M").to_string(),
    )
}

/// Asks whether the recipe called `name`, which is of another file than the one that is open, is meant; `None` when not answered
/// yet.
pub fn other_scan_ui(ui: &Ui, name: &str, of: &ScanIdentity, here: &str) -> Option<bool> {
    modal::show(ui, "A recipe of another file", WIDTH, |ui| {
        let text = format!(
            "{} was made for {}, which has as many points as {} but another content. Apply it only if both hold the same points in \
             the same order.",
            theme::elided(name, MAX_NAME),
            theme::elided(&of.name, MAX_NAME),
            theme::elided(here, MAX_NAME)
        );
        ui.add(Label::new(text).wrap());
        ui.add_space(SPACE_S);
        let mut decision = None;
        ui.horizontal(|ui| {
            let apply = ui.add(theme::primary_button(ui, "Apply"));
            let apply = apply.on_hover_text("Do the edits of the recipe with this scan (Enter)");
            if apply.clicked() || modal::enter_pressed(ui) {
                decision = Some(true);
            }
            if modal::cancel_button(ui) {
                decision = Some(false);
            }
        });
        decision
    })
}
