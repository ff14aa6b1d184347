//! Hints for the first steps: one small card at a time in the view, gone for good once it is dismissed.

use std::collections::BTreeSet;

use egui::{Align, Align2, Area, Button, Id, Label, Layout, Order, Rect, RichText, Ui, Vec2};

use crate::command::Command;
use crate::theme::{self, SPACE_L, SPACE_M, SPACE_S};
use crate::viewport::GIZMO_WIDTH;

/// In points.
const WIDTH: f32 = 300.0;
/// Narrower the words stand in a column of single words; then there is no card. In points.
const MIN_WIDTH: f32 = 180.0;
/// Edits after which the next hint comes: one at a time, not all after the first.
const N_BEFORE_JOURNAL: usize = 2;
const N_BEFORE_HISTORY: usize = 3;
const N_BEFORE_TOOLS: usize = 4;
const N_BEFORE_FACE_ME: usize = 6;

/// Seconds from the end of one hint to the next: hints must not become work.
const REST_SECS: f64 = 60.0;

/// One hint.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Card {
    /// How to look around.
    Look,
    /// How to mend.
    Point,
    /// How to choose how much a click turns.
    Size,
    /// How to find everything else.
    Find,
    /// How to step through what is suspected.
    Suspects,
    /// How to choose points by hand.
    Tools,
    /// That edits survive a crash.
    Journal,
    /// How to go back.
    History,
    /// How to turn all that is in sight.
    FaceMe,
}

/// What the user has come to.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Progress {
    /// The open scan is oriented.
    pub is_oriented: bool,
    /// Edits that undo can take back.
    pub n_steps: usize,
    /// There are patches to choose from.
    pub has_patches: bool,
    /// The list of suspects is open and has some that are not settled.
    pub lists_suspects: bool,
    /// A tool that draws or paints is chosen.
    pub is_selecting: bool,
    /// Edits are written into a journal.
    pub is_journaled: bool,
}

impl Card {
    /// All hints, in the order they come.
    pub const ALL: [Self; 9] = [
        Self::Look,
        // These are about what the user has just opened.
        Self::Suspects,
        Self::Tools,
        Self::Point,
        Self::Size,
        Self::Find,
        Self::Journal,
        Self::History,
        Self::FaceMe,
    ];

    /// The name in the settings.
    pub fn name(self) -> &'static str {
        match self {
            Self::Look => "look",
            Self::Point => "point",
            Self::Size => "size",
            Self::Find => "find",
            Self::Suspects => "suspects",
            Self::Tools => "tools",
            Self::Journal => "journal",
            Self::History => "history",
            Self::FaceMe => "face_me",
        }
    }

    fn title(self) -> &'static str {
        match self {
            Self::Look => "Look around",
            Self::Point => "Mend with a click",
            Self::Size => "More or less at once",
            Self::Find => "Everything else",
            Self::Suspects => "From suspect to suspect",
            Self::Tools => "Choose points by hand",
            Self::Journal => "Nothing gets lost",
            Self::History => "Back and forth",
            Self::FaceMe => "All that you see",
        }
    }

    fn text(self, ctx: &egui::Context) -> String {
        let key = |command: Command| {
            let in_menu = || format!("“{}” in the menu {}", command.label(), command.menu().label());
            command.key_text(ctx).unwrap_or_else(in_menu)
        };
        match self {
            Self::Look => "Drag turns the view, the wheel zooms to the pointer, the right button moves it. \
                           A double-click chooses what the view turns around."
                .to_owned(),
            Self::Point => format!(
                "Point at a patch of the wrong color: what lights up is what a click turns. {} takes a click back.",
                key(Command::Undo)
            ),
            Self::Size => format!(
                "Hold the button down over a patch and turn the wheel, or press {} and {}, for a larger or smaller one.",
                key(Command::LargerPatch),
                key(Command::SmallerPatch)
            ),
            Self::Find => format!(
                "{} finds every command by a few letters; {} lists all keys.",
                key(Command::Palette),
                key(Command::Shortcuts)
            ),
            Self::Suspects => format!(
                "{} goes to the next patch that probably points to the wrong side. Enter flips it, {} leaves it as it is.",
                key(Command::NextSuspect),
                key(Command::AcceptSuspect)
            ),
            Self::Tools => format!(
                "{} paints over points, {} draws around them, {} spans a rectangle. {} flips what is selected.",
                key(Command::BrushTool),
                key(Command::LassoTool),
                key(Command::RectangleTool),
                key(Command::Flip)
            ),
            Self::Journal => "Your edits are kept as you make them. After a crash they are offered when you open the \
                              scan again."
                .to_owned(),
            Self::History => format!(
                "{} takes an edit back, {} makes it again. The tab History lists them all: click one to go there.",
                key(Command::Undo),
                key(Command::Redo)
            ),
            Self::FaceMe => format!(
                "{} turns what you see so that it faces you. Look at the scan from where it should face to.",
                key(Command::WhatISeeFacesMe)
            ),
        }
    }

    fn is_due(self, progress: Progress) -> bool {
        match self {
            Self::Look => progress.is_oriented,
            // Who has mended knows.
            Self::Point => progress.is_oriented && progress.n_steps == 0,
            Self::Size => progress.n_steps > 0 && progress.has_patches,
            Self::Find => progress.n_steps > 0,
            Self::Suspects => progress.is_oriented && progress.lists_suspects,
            Self::Tools => progress.is_oriented && (progress.is_selecting || progress.n_steps >= N_BEFORE_TOOLS),
            Self::Journal => progress.is_journaled && progress.n_steps >= N_BEFORE_JOURNAL,
            Self::History => progress.n_steps >= N_BEFORE_HISTORY,
            Self::FaceMe => progress.is_oriented && progress.n_steps >= N_BEFORE_FACE_ME,
        }
    }
}

/// The hint to show now.
pub fn due(dismissed: &BTreeSet<String>, progress: Progress) -> Option<Card> {
    Card::ALL
        .into_iter()
        .find(|card| !dismissed.contains(card.name()) && card.is_due(progress))
}

/// Keeps hints apart from each other.
#[derive(Clone, Copy, Debug, Default)]
pub struct Pace {
    shown: Option<Card>,
    /// No other one comes before, in seconds of the interface's clock.
    rests_until: f64,
}

impl Pace {
    /// What to show at the time `now`, in seconds, when `due` is due: a hint that is shown stays while it is due.
    pub fn show(&mut self, due: Option<Card>, now: f64) -> Option<Card> {
        if self.shown.is_some() && self.shown != due {
            (self.shown, self.rests_until) = (None, now + REST_SECS);
        }
        if now >= self.rests_until {
            self.shown = due;
        }
        self.shown
    }

    /// The next hint may come at once, as when the user asks for hints.
    pub fn restart(&mut self) {
        *self = Self::default();
    }
}

/// Shows a hint in the lower right corner of `view`, where nothing else is: left of it are the axes, above is the middle.
/// Says whether the user dismisses it. In a view that has no room it is not shown.
pub fn ui(ui: &Ui, view: Rect, card: Card) -> bool {
    let mut dismissed = false;
    let beside = GIZMO_WIDTH + 2.0 * SPACE_M + 2.0 * SPACE_L;
    let width = WIDTH.min(view.width() - beside);
    if width < MIN_WIDTH {
        return false;
    }
    Area::new(Id::unique("hint"))
        .order(Order::Middle)
        .pivot(Align2::RIGHT_BOTTOM)
        .fixed_pos(view.right_bottom() - Vec2::splat(SPACE_M))
        .show(ui.ctx(), |ui| {
            theme::card(ui).show(ui, |ui| {
                ui.set_width(width);
                ui.spacing_mut().item_spacing.y = SPACE_S;
                ui.label(RichText::new(card.title()).color(theme::accent(ui)).strong());
                ui.add(Label::new(card.text(ui.ctx())).wrap());
                // As high as the button: by itself the row would take all that is left of the view.
                let row = Vec2::new(width, ui.spacing().interact_size.y);
                ui.allocate_ui_with_layout(row, Layout::right_to_left(Align::Center), |ui| {
                    let button = ui.add(Button::new("Got it"));
                    dismissed = button.on_hover_text("This hint does not come again").clicked();
                });
            });
        });
    dismissed
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_hint_at_most_each_minute() {
        let mut pace = Pace::default();
        assert_eq!(pace.show(Some(Card::Look), 5.0), Some(Card::Look));
        assert_eq!(
            pace.show(Some(Card::Look), 500.0),
            Some(Card::Look),
            "it stays as long as it is due"
        );
        assert_eq!(pace.show(Some(Card::Point), 501.0), None);
        assert_eq!(pace.show(Some(Card::Point), 560.0), None);
        assert_eq!(pace.show(Some(Card::Point), 561.0), Some(Card::Point));
        assert_eq!(pace.show(None, 562.0), None);
        pace.restart();
        assert_eq!(pace.show(Some(Card::Look), 563.0), Some(Card::Look));
    }

    #[test]
    fn hints_come_when_they_help_and_never_again() {
        let mut dismissed = BTreeSet::new();
        let mut progress = Progress::default();
        assert_eq!(due(&dismissed, progress), None);
        progress.is_oriented = true;
        assert_eq!(due(&dismissed, progress), Some(Card::Look));
        dismissed.insert("look".to_owned());
        assert_eq!(due(&dismissed, progress), Some(Card::Point));
        progress.n_steps = 1;
        assert_eq!(due(&dismissed, progress), Some(Card::Find), "there are no patches");
        progress.has_patches = true;
        assert_eq!(due(&dismissed, progress), Some(Card::Size));
        dismissed.extend(["size", "find"].map(str::to_owned));
        assert_eq!(due(&dismissed, progress), None);
        // What has just been opened comes first.
        progress.lists_suspects = true;
        assert_eq!(due(&dismissed, progress), Some(Card::Suspects));
        progress.lists_suspects = false;
        progress.is_selecting = true;
        assert_eq!(due(&dismissed, progress), Some(Card::Tools));
        dismissed.insert("tools".to_owned());
        // The rest comes with the edits, one at a time.
        progress.n_steps = 2;
        assert_eq!(due(&dismissed, progress), None, "there is no journal");
        progress.is_journaled = true;
        assert_eq!(due(&dismissed, progress), Some(Card::Journal));
        dismissed.insert("journal".to_owned());
        assert_eq!(due(&dismissed, progress), None);
        progress.n_steps = 3;
        assert_eq!(due(&dismissed, progress), Some(Card::History));
        dismissed.insert("history".to_owned());
        progress.n_steps = 6;
        assert_eq!(due(&dismissed, progress), Some(Card::FaceMe));
        dismissed.extend(Card::ALL.map(|card| card.name().to_owned()));
        progress.lists_suspects = true;
        assert_eq!(due(&dismissed, progress), None);
    }
}
