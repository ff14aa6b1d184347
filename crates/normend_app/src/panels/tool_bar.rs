//! The tools as buttons, and what they reach: the part of the toolbar after the commands.

use egui::accesskit::Role;
use egui::{Button, Ui, WidgetInfo};

use crate::command::{Action, Command};
use crate::theme::SPACE_XS;
use crate::tools::Tool;

/// The buttons; `None` for the tool while there is nothing to use one on.
pub fn ui(ui: &mut Ui, tool: Option<Tool>, visible_only: bool) -> Option<Action> {
    let mut action = None;
    ui.spacing_mut().item_spacing.x = SPACE_XS;
    ui.spacing_mut().button_padding.x = 9.0;
    for offered in Tool::ALL {
        let command = offered.command();
        let is_active = tool == Some(offered);
        if toggle(
            ui,
            tool.is_some(),
            is_active,
            offered.label(),
            Role::RadioButton,
            command,
        ) {
            action = Some(command.into());
        }
    }
    ui.separator();
    let command = Command::VisibleOnly;
    if toggle(
        ui,
        tool.is_some(),
        visible_only,
        "Visible only",
        Role::CheckBox,
        command,
    ) {
        action = Some(command.into());
    }
    action
}

/// A button that stays down. To a screen reader it has the name of its command.
fn toggle(ui: &mut Ui, enabled: bool, is_down: bool, label: &str, role: Role, command: Command) -> bool {
    let response = ui.add_enabled(enabled, Button::selectable(is_down, label));
    response.widget_info(|| WidgetInfo::selected(role, enabled, is_down, command.label()));
    response
        .on_hover_text(command.tooltip_with_keys(ui.ctx()))
        .on_disabled_hover_text("No scan is open")
        .clicked()
}
