//! The menu of a right click in the view: what can be done with what is under the pointer, then with the selection.

use egui::{Button, RichText, Ui};
use glam::DVec3;

use super::Availability;
use crate::command::{Action, Command};
use crate::scene_sync::Target;
use crate::theme;
use crate::tools::point_tool::Means;
use crate::viewport::Pixel;

/// Width of the menu, in points: room for the longest command with its key.
const WIDTH: f32 = 264.0;

/// What stands in the second part of the menu.
const OF_SELECTION: [Command; 7] = [
    Command::Flip,
    Command::SelectionFacesMe,
    Command::Pin,
    Command::Unpin,
    Command::PropagateFrom,
    Command::PropagateInside,
    Command::HideSelected,
];

/// The content of the menu. `target` is what is at `pixel`; `None` while that is not known. `place` is where its point is in the file.
pub fn ui(
    ui: &mut Ui,
    pixel: Pixel,
    target: Option<Option<Target>>,
    place: Option<DVec3>,
    availability: &Availability<'_>,
) -> Option<Action> {
    ui.set_min_width(WIDTH);
    let mut action = None;
    let mut item = |ui: &mut Ui, label: &str, tooltip: &str, available: Result<(), &'static str>, chosen: Action| {
        let response = ui.add_enabled(available.is_ok(), Button::new(label));
        let clicked = match available {
            Ok(()) => response.on_hover_text(tooltip).clicked(),
            Err(reason) => response.on_disabled_hover_text(reason).clicked(),
        };
        if clicked {
            action = Some(chosen);
        }
    };
    match target {
        None => {
            ui.label(RichText::new("Looking what is here…").weak());
        }
        Some(None) => {
            ui.label(RichText::new("No point is here").weak());
        }
        Some(Some(target)) => {
            if let Some(place) = place {
                let text = place.to_array().map(theme::coordinate).join(", ");
                let tooltip = format!(
                    "Where this point is in the file: click to copy. Point {}",
                    target.point()
                );
                if ui.button(RichText::new(&text).weak()).on_hover_text(tooltip).clicked() {
                    ui.ctx().copy_text(text);
                }
                ui.separator();
            }
            if let Target::Source { point, .. } = target {
                let select = Action::SelectSource { point, extend: false };
                item(
                    ui,
                    "Select this source",
                    "Select it as in the list of sources",
                    Ok(()),
                    select,
                );
                let flip = Action::FlipSources(vec![point]);
                item(ui, "Flip this source", "Turn it, and what belongs to it", Ok(()), flip);
                let remove = Action::RemoveSources(vec![point]);
                item(ui, "Remove this source", "Vouch for it no longer", Ok(()), remove);
                ui.separator();
            }
            for (command, means) in [
                (Command::MendHere, Means::Patch),
                (Command::MendAlongTreeHere, Means::Tree),
                (Command::TurnWholeHere, Means::Whole),
                (Command::SelectPatchHere, Means::SelectPatch),
                (Command::SelectComponentHere, Means::SelectComponent),
            ] {
                if command == Command::SelectPatchHere {
                    ui.separator();
                }
                let at = Action::Point { pixel, means };
                item(ui, command.label(), command.tooltip(), availability(command), at);
            }
            let pin = Action::Point {
                pixel,
                means: Means::PinPatch,
            };
            let tooltip = "Protect the patch here: nothing turns it until you unpin it";
            item(
                ui,
                "Pin patch here",
                tooltip,
                availability(Command::SelectPatchHere),
                pin,
            );
            let pivot = Command::SetPivot;
            item(ui, pivot.label(), pivot.tooltip(), Ok(()), Action::Pivot(pixel));
        }
    }
    ui.separator();
    for command in OF_SELECTION {
        let available = availability(command);
        let mut button = Button::new(command.label());
        if let Some(keys) = command.key_text(ui.ctx()) {
            button = button.shortcut_text(keys);
        }
        let response = ui.add_enabled(available.is_ok(), button);
        let clicked = match available {
            Ok(()) => response.on_hover_text(command.tooltip()).clicked(),
            Err(reason) => response.on_disabled_hover_text(reason).clicked(),
        };
        if clicked {
            action = Some(command.into());
        }
    }
    action
}
