//! Hints for the first steps: one small card at a time in the view, gone for good once it is dismissed.

use std::collections::BTreeSet;

use egui::{Align, Align2, Area, Button, Id, Label, Layout, Order, Rect, RichText, Ui, Vec2};

use crate::command::Command;
use crate::theme::{self, SPACE_M, SPACE_S};

const WIDTH: f32 = 300.0;

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
}

/// What the user has come to.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Progress {
    /// The open scan is oriented.
    pub is_oriented: bool,
    /// It was mended at least once.
    pub is_mended: bool,
    /// There are patches to choose from.
    pub has_patches: bool,
}

impl Card {
    /// All hints, in the order they come.
    pub const ALL: [Self; 4] = [Self::Look, Self::Point, Self::Size, Self::Find];

    /// The name in the settings.
    pub fn name(self) -> &'static str {
        match self {
            Self::Look => "look",
            Self::Point => "point",
            Self::Size => "size",
            Self::Find => "find",
        }
    }

    fn title(self) -> &'static str {
        match self {
            Self::Look => "Look around",
            Self::Point => "Mend with a click",
            Self::Size => "More or less at once",
            Self::Find => "Everything else",
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
        }
    }

    fn is_due(self, progress: Progress) -> bool {
        match self {
            Self::Look => progress.is_oriented,
            // Who has mended knows.
            Self::Point => progress.is_oriented && !progress.is_mended,
            Self::Size => progress.is_mended && progress.has_patches,
            Self::Find => progress.is_mended,
        }
    }
}

/// The hint to show now.
pub fn due(dismissed: &BTreeSet<String>, progress: Progress) -> Option<Card> {
    Card::ALL
        .into_iter()
        .find(|card| !dismissed.contains(card.name()) && card.is_due(progress))
}

/// Shows a hint in the lower right corner of `view`, where nothing else is; says whether the user dismisses it.
pub fn ui(ui: &Ui, view: Rect, card: Card) -> bool {
    let mut dismissed = false;
    Area::new(Id::unique("hint"))
        .order(Order::Middle)
        .pivot(Align2::RIGHT_BOTTOM)
        .fixed_pos(view.right_bottom() - Vec2::splat(SPACE_M))
        .show(ui.ctx(), |ui| {
            theme::card(ui).show(ui, |ui| {
                ui.set_width(WIDTH);
                ui.spacing_mut().item_spacing.y = SPACE_S;
                ui.label(RichText::new(card.title()).color(theme::accent(ui)).strong());
                ui.add(Label::new(card.text(ui.ctx())).wrap());
                ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
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
    fn hints_come_when_they_help_and_never_again() {
        let mut dismissed = BTreeSet::new();
        let mut progress = Progress::default();
        assert_eq!(due(&dismissed, progress), None);
        progress.is_oriented = true;
        assert_eq!(due(&dismissed, progress), Some(Card::Look));
        dismissed.insert("look".to_owned());
        assert_eq!(due(&dismissed, progress), Some(Card::Point));
        progress.is_mended = true;
        assert_eq!(due(&dismissed, progress), Some(Card::Find), "there are no patches");
        progress.has_patches = true;
        assert_eq!(due(&dismissed, progress), Some(Card::Size));
        dismissed.extend(["size", "find"].map(str::to_owned));
        assert_eq!(due(&dismissed, progress), None);
    }
}
