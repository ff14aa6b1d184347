//! The menus and the toolbar, both built from the table of commands.

use std::path::PathBuf;

use egui::{Button, ScrollArea, Ui};

use super::Availability;
use crate::command::{Action, Command, Menu};
use crate::dialogs;
use crate::theme::{self, SPACE_S, SPACE_XS};

/// Least height of an open menu, in points: a few entries, even where the window has less room.
const MIN_HEIGHT: f32 = 96.0;

/// The menu bar; a menu that is longer than the window scrolls. `recent` are the scans opened last.
pub fn menus(ui: &mut Ui, availability: &Availability<'_>, recent: &[PathBuf]) -> Option<Action> {
    let mut action = None;
    let bar_bottom = ui.cursor().top() + ui.spacing().interact_size.y;
    egui::MenuBar::new().ui(ui, |ui| {
        for menu in Menu::ALL {
            let button = ui.menu_button(menu.label(), |ui| {
                ui.set_min_width(232.0);
                ui.style_mut().wrap_mode = Some(egui::TextWrapMode::Extend);
                // Below the bar, so that the names of the other menus stay in reach; the frame is around it.
                let frame = egui::Frame::menu(ui.style()).total_margin().sum().y;
                let room = ui.ctx().content_rect().bottom() - bar_bottom - frame - SPACE_S;
                let height = room.max(MIN_HEIGHT);
                // Also where the menu would take less than the window has.
                ScrollArea::vertical()
                    .max_height(height)
                    .min_scrolled_height(height)
                    .show(ui, |ui| entries(ui, menu, availability, recent))
                    .inner
            });
            action = button.inner.flatten().or(action.take());
        }
    });
    action
}

fn entries(ui: &mut Ui, menu: Menu, availability: &Availability<'_>, recent: &[PathBuf]) -> Option<Action> {
    let mut action = None;
    let mut group = None;
    for command in menu.commands() {
        if group.is_some_and(|group| group != command.group()) {
            ui.separator();
        }
        group = Some(command.group());
        if item(ui, command, availability) {
            action = Some(command.into());
        }
        if command == Command::OpenSample
            && let Some(chosen) = recent_menu(ui, recent)
        {
            action = Some(chosen);
        }
    }
    action
}

fn item(ui: &mut Ui, command: Command, availability: &Availability<'_>) -> bool {
    let available = availability(command);
    let mut button = Button::new(command.label());
    if let Some(keys) = command.key_text(ui.ctx()) {
        button = button.shortcut_text(keys);
    }
    let response = ui.add_enabled(available.is_ok(), button);
    if response.gained_focus() {
        // The arrow keys go on where the menu is cut off.
        response.scroll_to_me(None);
    }
    match available {
        Ok(()) => response.on_hover_text(command.tooltip()).clicked(),
        Err(reason) => response.on_disabled_hover_text(reason).clicked(),
    }
}

fn recent_menu(ui: &mut Ui, recent: &[PathBuf]) -> Option<Action> {
    let mut action = None;
    ui.add_enabled_ui(!recent.is_empty(), |ui| {
        ui.menu_button("Open recent", |ui| {
            for path in recent {
                let name = path
                    .file_name()
                    .unwrap_or(path.as_os_str())
                    .to_string_lossy()
                    .into_owned();
                let folder = path.parent().unwrap_or(path).display().to_string();
                let button = Button::new(theme::elided(&name, 40)).shortcut_text(theme::elided(&folder, 40));
                if ui.add(button).on_hover_text(path.display().to_string()).clicked() {
                    action = Some(Action::OpenScan(path.clone()));
                }
            }
            ui.separator();
            if ui.button("Clear this list").clicked() {
                action = Some(Action::ClearRecent);
            }
        });
    });
    action
}

/// The toolbar: the commands used most. `undo` and `redo` name the edits that would be undone and redone; `tools` adds the tools.
pub fn toolbar(
    ui: &mut Ui,
    availability: &Availability<'_>,
    undo: Option<&str>,
    redo: Option<&str>,
    tools: impl FnOnce(&mut Ui) -> Option<Action>,
) -> Option<Action> {
    let mut action = None;
    ui.horizontal_wrapped(|ui| {
        ui.spacing_mut().item_spacing.x = SPACE_XS;
        for (index, (command, of)) in [
            (Command::Open, None),
            (Command::Export, None),
            (Command::Undo, undo),
            (Command::Redo, redo),
        ]
        .into_iter()
        .enumerate()
        {
            if index == 2 {
                divider(ui);
            }
            let available = availability(command);
            let response = ui.add_enabled(available.is_ok(), Button::new(command.label()));
            let mut tooltip = command.tooltip_with_keys(ui.ctx());
            if let Some(edit) = of {
                tooltip = format!("{edit}: {tooltip}");
            }
            if command == Command::Open && !dialogs::can_drop() {
                tooltip = format!("{tooltip}. {}", dialogs::NO_DROP);
            }
            let clicked = match available {
                Ok(()) => response.on_hover_text(tooltip).clicked(),
                Err(reason) => response.on_disabled_hover_text(reason).clicked(),
            };
            if clicked {
                action = Some(command.into());
            }
        }
        divider(ui);
        action = tools(ui).or(action.take());
    });
    action
}

fn divider(ui: &mut Ui) {
    ui.add_space(SPACE_S);
    ui.separator();
    ui.add_space(SPACE_S);
}
