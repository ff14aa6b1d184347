//! The command palette: a few letters find every command, recent scan, way of coloring, theme and size of the interface.

use std::path::PathBuf;

use egui::{Button, Id, Key, Modifiers, RichText, ScrollArea, TextEdit, Ui, Vec2};

use super::preferences::SCALES;
use super::{Availability, modal};
use crate::coloring::Coloring;
use crate::command::{Action, Command};
use crate::settings::ThemeChoice;
use crate::theme::{self, SPACE_S, SPACE_XS};

const WIDTH: f32 = 560.0;
/// Rows that are seen at once.
const N_ROWS: usize = 11;
const ROW_HEIGHT: f32 = 28.0;

/// The window: what was typed, and which row is chosen.
#[derive(Clone, Debug, Default)]
pub struct PaletteWindow {
    text: String,
    chosen: usize,
    focused_once: bool,
}

/// What the user decided.
#[derive(Clone, Debug, PartialEq)]
pub enum Decision {
    /// Not yet.
    Wait,
    /// Nothing is done.
    Close,
    /// Do this.
    Act(Action),
}

/// What the palette offers besides commands.
pub struct Offers<'a> {
    /// Which commands can be run now.
    pub availability: &'a Availability<'a>,
    /// Names of commands chosen before, newest first.
    pub recent_commands: &'a [String],
    /// Scans opened last, newest first.
    pub recent_scans: &'a [PathBuf],
    /// The way of coloring in force; `None` when no scan is open.
    pub mode: Option<Coloring>,
}

struct Entry {
    title: String,
    /// Searched too, but finds less surely than the title.
    details: String,
    keys: String,
    action: Action,
    /// Why it cannot be done now.
    blocked: Option<&'static str>,
}

impl PaletteWindow {
    /// Shows the window.
    pub fn ui(&mut self, ui: &Ui, offers: &Offers<'_>) -> Decision {
        modal::show(ui, "Find a command", WIDTH, |ui| self.content(ui, offers))
    }

    fn content(&mut self, ui: &mut Ui, offers: &Offers<'_>) -> Decision {
        let n_steps = ui.input_mut(|input| {
            let mut pressed = |key| input.count_and_consume_key(Modifiers::NONE, key) as isize;
            pressed(Key::ArrowDown) - pressed(Key::ArrowUp)
                + (N_ROWS as isize - 1) * (pressed(Key::PageDown) - pressed(Key::PageUp))
        });
        let before = self.text.clone();
        let field = TextEdit::singleline(&mut self.text)
            .id(Id::unique("palette"))
            .hint_text("Type a few letters of what you want to do")
            .desired_width(f32::INFINITY);
        let field = ui.add(field);
        field.widget_info(|| {
            let mut info = egui::WidgetInfo::labeled(egui::accesskit::Role::TextInput, true, "Find a command");
            info.current_text_value = Some(self.text.clone());
            info
        });
        // The field gives the focus away on Enter.
        let entered = field.lost_focus() && ui.input(|input| input.key_pressed(Key::Enter));
        if !self.focused_once || entered {
            field.request_focus();
            self.focused_once = true;
        }
        let found = found(&self.text, entries(ui.ctx(), offers), offers.recent_commands);
        if self.text != before {
            self.chosen = 0;
        }
        self.chosen = self
            .chosen
            .saturating_add_signed(n_steps)
            .min(found.len().saturating_sub(1));
        ui.add_space(SPACE_S);
        let mut decision = Decision::Wait;
        let height = N_ROWS as f32 * (ROW_HEIGHT + SPACE_XS);
        ScrollArea::vertical()
            .max_height(height)
            .min_scrolled_height(height)
            .auto_shrink([false, false])
            .show(ui, |ui| {
                ui.spacing_mut().item_spacing.y = SPACE_XS;
                if found.is_empty() {
                    ui.label(RichText::new("Nothing has these letters.").weak());
                }
                for (index, entry) in found.iter().enumerate() {
                    let is_chosen = index == self.chosen;
                    let response = row(ui, entry, is_chosen);
                    if is_chosen && (n_steps != 0 || self.text != before) {
                        response.scroll_to_me(None);
                    }
                    let meant = response.clicked() || (entered && is_chosen);
                    if meant && entry.blocked.is_none() {
                        decision = Decision::Act(entry.action.clone());
                    }
                }
            });
        ui.add_space(SPACE_XS);
        ui.label(RichText::new("Up and Down choose · Enter does it · Esc closes").weak());
        decision
    }
}

fn row(ui: &mut Ui, entry: &Entry, is_chosen: bool) -> egui::Response {
    let right = match entry.blocked {
        Some(reason) => reason,
        None if entry.keys.is_empty() => "",
        None => &entry.keys,
    };
    let button = Button::selectable(is_chosen, &entry.title)
        .shortcut_text(right)
        .min_size(Vec2::new(ui.available_width(), ROW_HEIGHT));
    // The reason must stay readable, so what cannot be done is not disabled but weak.
    let button = if entry.blocked.is_some() {
        Button::selectable(is_chosen, RichText::new(&entry.title).weak())
            .shortcut_text(RichText::new(right).weak())
            .min_size(Vec2::new(ui.available_width(), ROW_HEIGHT))
    } else {
        button
    };
    let response = ui.add(button);
    let name = match entry.blocked {
        Some(reason) => format!("{}: {reason}", entry.title),
        None => entry.title.clone(),
    };
    response.widget_info(|| {
        egui::WidgetInfo::selected(
            egui::accesskit::Role::ListBoxOption,
            entry.blocked.is_none(),
            is_chosen,
            &name,
        )
    });
    response.on_hover_text(&entry.details)
}

fn entries(ctx: &egui::Context, offers: &Offers<'_>) -> Vec<Entry> {
    let commands = Command::ALL
        .iter()
        .filter(|&&command| command != Command::Palette)
        .map(|&command| Entry {
            title: command.label().to_owned(),
            details: format!("{} ({})", command.tooltip(), command.menu().label()),
            keys: command.keys_text(ctx),
            action: command.into(),
            blocked: (offers.availability)(command).err(),
        });
    let modes = offers.mode.into_iter().flat_map(|present| {
        Coloring::ALL
            .into_iter()
            .filter(move |&mode| mode != present)
            .map(|mode| Entry {
                title: format!("Display: {}", mode.label()),
                details: mode.tooltip().to_owned(),
                keys: String::new(),
                action: Action::Display(mode),
                blocked: None,
            })
    });
    let scans = offers.recent_scans.iter().map(|path| Entry {
        title: format!(
            "Open {}",
            theme::elided(&path.file_name().unwrap_or(path.as_os_str()).to_string_lossy(), 40)
        ),
        details: path.display().to_string(),
        keys: String::new(),
        action: Action::OpenScan(path.clone()),
        blocked: (offers.availability)(Command::Open).err(),
    });
    let looks = ThemeChoice::ALL.into_iter().map(|theme| Entry {
        title: format!("Theme: {}", theme.label()),
        details: "Light or dark".to_owned(),
        keys: String::new(),
        action: Action::Theme(theme),
        blocked: None,
    });
    let sizes = SCALES.into_iter().map(|scale| Entry {
        title: format!("Interface size: {:.0} %", scale * 100.0),
        details: "Text, buttons and panels".to_owned(),
        keys: String::new(),
        action: Action::InterfaceScale(scale),
        blocked: None,
    });
    commands.chain(modes).chain(looks).chain(sizes).chain(scans).collect()
}

/// The entries that have the letters, the best first; all of them for no letters, those chosen lately first.
fn found(text: &str, entries: Vec<Entry>, recent: &[String]) -> Vec<Entry> {
    let recency = |entry: &Entry| match &entry.action {
        Action::Run(command) => recent.iter().position(|name| name == command.name()),
        _ => None,
    };
    let mut scored: Vec<_> = entries
        .into_iter()
        .filter_map(|entry| {
            let score: Option<u32> = text
                .split_whitespace()
                .map(|word| score(word, &entry.title, &format!("{} {}", entry.details, entry.keys)))
                .sum();
            score.map(|score| (score, entry))
        })
        .collect();
    // The sort is stable, so equals stay in the order of the menus.
    scored.sort_by_key(|(score, entry)| {
        let recency = recency(entry).unwrap_or(usize::MAX);
        (std::cmp::Reverse(*score), entry.blocked.is_some(), recency)
    });
    scored.into_iter().map(|(_, entry)| entry).collect()
}

/// How well `word` is found; in the title better than in the details. `None` when it is in neither.
fn score(word: &str, title: &str, details: &str) -> Option<u32> {
    let in_title = letters_in_order(word, title).map(|score| 4 * score);
    let lower = |text: &str| text.to_lowercase().chars().collect();
    // In a long text runs of letters are chance too, so there a word must begin with all of them.
    let in_details = || {
        let (word, details): (Vec<char>, Vec<char>) = (lower(word), lower(details));
        let is_there = |at: usize| begins_word(&details, at) && details[at..].starts_with(&word);
        (0..details.len()).any(is_there).then_some(2 * word.len() as u32)
    };
    in_title.or_else(in_details)
}

/// How well the letters of `word` are found in `text` in their order: in runs that begin a word of the text or have two letters
/// or more, since single letters strewn over a text are chance. Long runs and beginnings count more. `None` when there is no such
/// way. Takes the product of both lengths, times the longest run.
fn letters_in_order(word: &str, text: &str) -> Option<u32> {
    let word: Vec<char> = word.to_lowercase().chars().collect();
    let text: Vec<char> = text.to_lowercase().chars().collect();
    // The best score of the letters from one on in the text from one place on, found from the ends.
    let mut best = vec![vec![None; text.len() + 1]; word.len() + 1];
    best[word.len()].fill(Some(0));
    for letter in (0..word.len()).rev() {
        for at in (0..text.len()).rev() {
            let begins = begins_word(&text, at);
            let longest = std::iter::zip(&word[letter..], &text[at..])
                .take_while(|(a, b)| a == b)
                .count();
            let runs = (1..=longest)
                .filter(|&length| begins || length > 1)
                .filter_map(|length| {
                    let rest: Option<u32> = best[letter + length][at + length];
                    Some(rest? + 3 * length as u32 - 2 + 3 * u32::from(begins))
                });
            best[letter][at] = runs.max().max(best[letter][at + 1]);
        }
    }
    best[0][0]
}

fn begins_word(text: &[char], at: usize) -> bool {
    at == 0 || !text[at - 1].is_alphanumeric()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn titles(text: &str, recent: &[&str]) -> Vec<String> {
        let recent: Vec<String> = recent.iter().map(|&name| name.to_owned()).collect();
        let scans = [PathBuf::from("/scans/church.ply")];
        let offers = Offers {
            availability: &|command| if command == Command::Undo { Err("no") } else { Ok(()) },
            recent_commands: &recent,
            recent_scans: &scans,
            mode: Some(Coloring::Facing),
        };
        let entries = entries(&egui::Context::default(), &offers);
        found(text, entries, &recent)
            .into_iter()
            .map(|entry| entry.title)
            .collect()
    }

    #[test]
    fn letters_find_commands() {
        let check = |text: &str, expect: &str| assert_eq!(titles(text, &[])[0], expect, "{text}");
        check("expo", "Export…");
        check("undo", "Undo");
        check("REDO", "Redo");
        check("tap", "Turn around this point");
        check("front", "Front");
        check("church", "Open church.ply");
        check("ctrl+e", "Export…");
        check("whole region", "Turn whole region here");
        check("dark", "Theme: Dark");
        check("size 125", "Interface size: 125 %");
        assert!(titles("qqqq", &[]).is_empty());
        // No letters strewn over a name.
        let themes = titles("theme", &[]);
        assert_eq!(themes.len(), ThemeChoice::ALL.len(), "{themes:?}");
        assert!(
            titles("opmple", &[]).contains(&"Open the sample".to_owned()),
            "runs of letters"
        );
        assert!(!titles("onsp", &[]).contains(&"Open the sample".to_owned()));
    }

    #[test]
    fn everything_is_offered_and_what_was_chosen_lately_comes_first() {
        let all = titles("", &["About", "FrameAll"]);
        assert_eq!(all[..2], ["About Normend".to_owned(), "Frame all".to_owned()]);
        // All commands but the palette itself, the other ways of coloring, how the editor looks, and the scan.
        let n_looks = ThemeChoice::ALL.len() + SCALES.len();
        assert_eq!(
            all.len(),
            Command::ALL.len() - 1 + Coloring::ALL.len() - 1 + n_looks + 1
        );
        assert_eq!(all.last().unwrap(), "Undo", "what cannot be done comes last");
    }
}
