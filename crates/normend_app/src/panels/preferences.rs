//! The window of preferences: how the editor looks, and which keys give which command.

use egui::{Align, Align2, Button, ComboBox, Event, Key, KeyboardShortcut, Layout, Modifiers, RichText, ScrollArea};
use egui::{TextEdit, Ui, Vec2};

use crate::command::{Command, Keymap, Menu, is_modifier, shortcut_text};
use crate::settings::{PaletteChoice, Settings, ThemeChoice};
use crate::theme::{self, SPACE_M, SPACE_S, SPACE_XS};

const SIZE: Vec2 = Vec2::new(640.0, 440.0);
/// Width of a command's name, in points.
const NAME_WIDTH: f32 = 208.0;
/// Scales of the interface that can be chosen; the commands go from one to the next.
pub const SCALES: [f32; 9] = [0.8, 0.9, 1.0, 1.1, 1.25, 1.5, 1.75, 2.0, 2.5];

/// A part of the window.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum Tab {
    #[default]
    General,
    Keys,
}

impl Tab {
    const ALL: [Self; 2] = [Self::General, Self::Keys];

    fn label(self) -> &'static str {
        match self {
            Self::General => "General",
            Self::Keys => "Keys",
        }
    }
}

/// A key that the user is about to press.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Recording {
    command: Command,
    /// The key that the new one replaces; `None` adds one.
    replaces: Option<KeyboardShortcut>,
}

/// A pressed key that another command has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Conflict {
    wanted: Recording,
    key: KeyboardShortcut,
    owner: Command,
}

/// The window's state.
#[derive(Clone, Debug, Default)]
pub struct Preferences {
    tab: Tab,
    search: String,
    recording: Option<Recording>,
    conflict: Option<Conflict>,
    /// Why the last key was not taken.
    refusal: Option<&'static str>,
}

impl Preferences {
    /// While a key is recorded, takes it and all others from the input; says whether it did. Ctrl, Shift and the like are waited
    /// through: they are part of the key that follows.
    pub fn take_key(&mut self, ctx: &egui::Context, keys: &mut Keymap) -> bool {
        let Some(recording) = self.recording else { return false };
        let pressed = ctx.input_mut(|input| {
            let pressed = input.events.iter().find_map(|event| match event {
                Event::Key {
                    key,
                    pressed: true,
                    repeat: false,
                    modifiers,
                    ..
                } if !is_modifier(*key) => Some(Ok(shortcut_of(*key, *modifiers))),
                Event::Copy | Event::Cut | Event::Paste(_) => Some(Err(FOR_TEXT)),
                _ => None,
            });
            input.events.retain(|event| {
                let is_key = matches!(event, Event::Key { .. } | Event::Text(_));
                !is_key && !matches!(event, Event::Copy | Event::Cut | Event::Paste(_))
            });
            pressed
        });
        if pressed.is_some() {
            self.refusal = None;
        }
        match pressed {
            None => {}
            Some(Err(reason)) => self.refusal = Some(reason),
            Some(Ok(key)) if key.logical_key == Key::Escape => self.recording = None,
            Some(Ok(key)) if key.logical_key == Key::Tab => self.refusal = Some(FOR_FOCUS),
            Some(Ok(key)) => {
                self.recording = None;
                match keys.owner(key) {
                    // It has it already, so nothing changes.
                    Some(owner) if owner == recording.command => {}
                    Some(owner) => {
                        self.conflict = Some(Conflict {
                            wanted: recording,
                            key,
                            owner,
                        });
                    }
                    None => give(keys, recording, key),
                }
            }
        }
        true
    }

    /// Stops recording, as when the window closes.
    pub fn rest(&mut self) {
        (self.recording, self.conflict, self.refusal) = (None, None, None);
    }

    /// The window.
    pub fn ui(&mut self, ui: &Ui, open: &mut bool, settings: &mut Settings) {
        let before = *open;
        egui::Window::new("Preferences")
            .open(open)
            .collapsible(false)
            .resizable(false)
            .anchor(Align2::CENTER_CENTER, Vec2::ZERO)
            .show(ui.ctx(), |ui| {
                let room = ui.ctx().content_rect().size() - Vec2::new(64.0, 112.0);
                let size = SIZE.min(room);
                ui.set_width(size.x);
                ui.set_height(size.y);
                ui.horizontal(|ui| {
                    for tab in Tab::ALL {
                        if ui
                            .add(Button::selectable(self.tab == tab, tab.label()).min_size(Vec2::new(96.0, 0.0)))
                            .clicked()
                        {
                            self.tab = tab;
                            self.rest();
                        }
                    }
                });
                ui.separator();
                ui.add_space(SPACE_XS);
                match self.tab {
                    Tab::General => general(ui, settings),
                    Tab::Keys => self.keys(ui, &mut settings.keys),
                }
            });
        if before && !*open {
            self.rest();
        }
    }

    fn keys(&mut self, ui: &mut Ui, keys: &mut Keymap) {
        ui.horizontal(|ui| {
            let field = TextEdit::singleline(&mut self.search)
                .hint_text("Search a command or a key")
                .desired_width(280.0);
            let field = ui.add(field);
            name(&field, egui::accesskit::Role::TextInput, "Search a command or a key");
            ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
                let all = ui.add_enabled(!keys.is_default(), Button::new("Reset all"));
                let all = all.on_hover_text("Give every command the keys it came with");
                if all.on_disabled_hover_text("No key was changed").clicked() {
                    keys.reset_all();
                    self.rest();
                }
            });
        });
        self.notice(ui, keys);
        ui.add_space(SPACE_XS);
        let search = self.search.to_lowercase();
        let ctx = ui.ctx().clone();
        ScrollArea::vertical().auto_shrink([false, false]).show(ui, |ui| {
            for menu in Menu::ALL {
                let commands: Vec<Command> = menu
                    .commands()
                    .filter(|command| {
                        let keys: Vec<_> = keys.keys(*command).iter().map(|key| shortcut_text(&ctx, key)).collect();
                        let text = format!("{} {} {}", command.label(), command.tooltip(), keys.join(" "));
                        text.to_lowercase().contains(&search)
                    })
                    .collect();
                if commands.is_empty() {
                    continue;
                }
                theme::section(ui, menu.label(), |ui| {
                    for command in commands {
                        self.command(ui, keys, command);
                    }
                });
            }
        });
    }

    /// What a pressed key led to, over the list.
    fn notice(&mut self, ui: &mut Ui, keys: &mut Keymap) {
        ui.add_space(SPACE_XS);
        ui.horizontal(|ui| {
            ui.set_min_height(ui.spacing().interact_size.y);
            if let Some(Conflict { wanted, key, owner }) = self.conflict {
                let key_text = shortcut_text(ui.ctx(), &key);
                let text = format!("{key_text} is the key of “{}”.", owner.label());
                ui.label(RichText::new(text).color(ui.visuals().warn_fg_color));
                if ui.button(format!("Take it for “{}”", wanted.command.label())).clicked() {
                    give(keys, wanted, key);
                    self.conflict = None;
                }
                if ui.button("Leave it").clicked() {
                    self.conflict = None;
                }
            } else if let Some(reason) = self.refusal {
                ui.label(RichText::new(reason).color(ui.visuals().warn_fg_color));
            } else if let Some(recording) = self.recording {
                let text = format!(
                    "Press the key for “{}”. Esc leaves it as it is.",
                    recording.command.label()
                );
                ui.label(RichText::new(text).color(theme::accent(ui)));
            } else {
                ui.label(RichText::new("Click a key to change it, + to add one, × to remove it.").weak());
            }
        });
    }

    fn command(&mut self, ui: &mut Ui, keys: &mut Keymap, command: Command) {
        ui.horizontal(|ui| {
            ui.spacing_mut().item_spacing.x = SPACE_XS;
            let size = Vec2::new(NAME_WIDTH, ui.spacing().interact_size.y);
            ui.allocate_ui_with_layout(size, Layout::left_to_right(Align::Center), |ui| {
                ui.set_min_width(NAME_WIDTH);
                ui.add(egui::Label::new(command.label()).truncate())
                    .on_hover_text(command.tooltip());
            });
            if command == Command::Cancel {
                ui.label(RichText::new("Escape").weak())
                    .on_hover_text("Escape always cancels; it is no other command's key");
                return;
            }
            for shortcut in keys.keys(command).to_vec() {
                let recording = Recording {
                    command,
                    replaces: Some(shortcut),
                };
                let text = shortcut_text(ui.ctx(), &shortcut);
                let key =
                    ui.add(Button::selectable(self.recording == Some(recording), &text).frame_when_inactive(true));
                named_button(&key, &format!("Change {text} of {}", command.label()));
                if key.on_hover_text("Click, then press another key").clicked() {
                    self.rest();
                    self.recording = Some(recording);
                }
                let remove = ui.add(Button::new("×").frame(false));
                named_button(&remove, &format!("Remove {text} from {}", command.label()));
                if remove.on_hover_text("Remove this key").clicked() {
                    keys.remove(command, shortcut);
                    self.rest();
                }
                ui.add_space(SPACE_S);
            }
            let recording = Recording {
                command,
                replaces: None,
            };
            let add = ui.add(Button::selectable(self.recording == Some(recording), "+").frame_when_inactive(true));
            named_button(&add, &format!("Add a key to {}", command.label()));
            if add.on_hover_text("Click, then press the key to add").clicked() {
                self.rest();
                self.recording = Some(recording);
            }
            if keys.is_changed(command) {
                ui.add_space(SPACE_M);
                let reset = ui.add(Button::new(RichText::new("Reset").weak()).frame(false));
                named_button(&reset, &format!("Reset the keys of {}", command.label()));
                if reset.on_hover_text("Back to the keys it came with").clicked() {
                    keys.reset(command);
                    self.rest();
                }
            }
        });
    }
}

const FOR_TEXT: &str = "Ctrl+C, Ctrl+X and Ctrl+V stay with text. Press another key.";
const FOR_FOCUS: &str = "Tab moves between buttons. Press another key.";

fn give(keys: &mut Keymap, recording: Recording, key: KeyboardShortcut) {
    if let Some(former) = recording.replaces {
        keys.remove(recording.command, former);
    }
    keys.add(recording.command, key);
}

/// The shortcut that a press stands for. Shift is part of the signs that need it, so it is not asked for twice.
fn shortcut_of(key: Key, held: Modifiers) -> KeyboardShortcut {
    let needs_shift = matches!(
        key,
        Key::Plus
            | Key::Questionmark
            | Key::Exclamationmark
            | Key::Colon
            | Key::Pipe
            | Key::OpenCurlyBracket
            | Key::CloseCurlyBracket
    );
    let mut modifiers = Modifiers::NONE;
    modifiers.alt = held.alt;
    modifiers.command = held.command || held.ctrl;
    modifiers.shift = held.shift && !needs_shift;
    KeyboardShortcut::new(modifiers, key)
}

fn name(response: &egui::Response, role: egui::accesskit::Role, name: &str) {
    response.widget_info(|| egui::WidgetInfo::labeled(role, true, name));
}

fn named_button(response: &egui::Response, text: &str) {
    name(response, egui::accesskit::Role::Button, text);
}

fn general(ui: &mut Ui, settings: &mut Settings) {
    theme::section(ui, "Look", |ui| {
        theme::rows(ui, "look", |ui| {
            theme::input_row(ui, "Theme", "Light or dark", |ui| {
                ComboBox::from_id_salt("theme")
                    .selected_text(settings.theme.label())
                    .show_ui(ui, |ui| {
                        for each in ThemeChoice::ALL {
                            ui.selectable_value(&mut settings.theme, each, each.label());
                        }
                    })
                    .response
            });
            theme::input_row(ui, "Colors", "The colors of front and back", |ui| {
                ComboBox::from_id_salt("palette")
                    .selected_text(settings.palette.label())
                    .show_ui(ui, |ui| {
                        for each in PaletteChoice::ALL {
                            ui.selectable_value(&mut settings.palette, each, each.label());
                        }
                    })
                    .response
            });
            let percent = |scale: f32| format!("{:.0} %", scale * 100.0);
            theme::input_row(ui, "Interface size", "Text, buttons and panels", |ui| {
                ComboBox::from_id_salt("scale")
                    .selected_text(percent(settings.ui_scale))
                    .show_ui(ui, |ui| {
                        for each in SCALES {
                            ui.selectable_value(&mut settings.ui_scale, each, percent(each));
                        }
                    })
                    .response
            });
        });
        ui.add_space(SPACE_XS);
        ui.checkbox(&mut settings.reduce_motion, "Reduce motion")
            .on_hover_text("The view jumps to its place instead of gliding there");
    });
    theme::section(ui, "Hints", |ui| {
        ui.checkbox(&mut settings.shows_hints, "Show hints")
            .on_hover_text("Small cards in the view that help with the first steps");
        let any = settings.shows_hints && !settings.dismissed_hints.is_empty();
        let again = ui.add_enabled(any, Button::new(Command::ShowHints.label()));
        let again = again.on_hover_text(Command::ShowHints.tooltip_with_keys(ui.ctx()));
        if again
            .on_disabled_hover_text("No hint was dismissed yet, or hints are off")
            .clicked()
        {
            settings.dismissed_hints.clear();
        }
    });
}

/// The next larger or smaller scale of the interface than `scale`.
pub fn next_scale(scale: f32, larger: bool) -> f32 {
    // A hair beyond, since a scale may come from a file with fewer digits.
    let next = if larger {
        SCALES.into_iter().find(|&each| each > scale + 1e-3)
    } else {
        SCALES.into_iter().rev().find(|&each| each < scale - 1e-3)
    };
    next.unwrap_or(scale)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scales_go_step_by_step_and_end() {
        assert_eq!(next_scale(1.0, true), 1.1);
        assert_eq!(next_scale(1.0, false), 0.9);
        assert_eq!(next_scale(1.2, true), 1.25);
        assert_eq!(next_scale(2.5, true), 2.5);
        assert_eq!(next_scale(0.7, false), 0.7);
    }

    #[test]
    fn shift_is_not_asked_for_twice() {
        let check = |key, held, expect| assert_eq!(shortcut_of(key, held), KeyboardShortcut::new(expect, key));
        check(Key::Questionmark, Modifiers::SHIFT, Modifiers::NONE);
        check(
            Key::Z,
            Modifiers::CTRL | Modifiers::SHIFT,
            Modifiers::COMMAND | Modifiers::SHIFT,
        );
        check(Key::A, Modifiers::NONE, Modifiers::NONE);
    }
}
