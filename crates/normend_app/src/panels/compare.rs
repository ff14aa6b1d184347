//! Comparing with the input, the automatic result or a reference.

use egui::{Button, ComboBox, Label, RichText, Slider, Ui};
use normend_core::Document;

use crate::command::{Action, Command};
use crate::compare::{Comparing, NONE_WRONG, Other, Style};
use crate::theme::{self, SPACE_XS};

/// What the section is for.
pub const ABOUT: &str = "Shows what the input or the automatic method says beside what is shown now.\n\
                         Against a reference file, wrong points are marked and counted.";
/// Wrong regions that are listed.
const N_ROWS: usize = 6;

/// The section.
pub fn ui(ui: &mut Ui, document: &Document, comparing: &mut Comparing) -> Option<Action> {
    let mut action = None;
    theme::rows(ui, "compare", |ui| {
        let tooltip = format!(
            "How the two are shown\n{}\n{}",
            Command::CompareSplit.tooltip_with_keys(ui.ctx()),
            Command::CompareBlink.tooltip_with_keys(ui.ctx())
        );
        let any = Other::ALL
            .into_iter()
            .any(|other| comparing.availability(other, document).is_ok());
        theme::input_row(ui, "Compare", &tooltip, |ui| {
            ComboBox::from_id_salt("compare style")
                .selected_text(comparing.style.label())
                .show_ui(ui, |ui| {
                    for each in Style::ALL {
                        let button = Button::selectable(comparing.style == each, each.label());
                        let row = ui.add_enabled(any || each == Style::Off, button);
                        if row.on_disabled_hover_text("The scan is not oriented yet").clicked()
                            && comparing.style != each
                        {
                            action = Some(Action::Compare(each));
                        }
                    }
                })
                .response
        });
        let mut other = comparing.other;
        theme::input_row(ui, "With", "What the present signs are compared with", |ui| {
            ComboBox::from_id_salt("compare with")
                .selected_text(other.label())
                .show_ui(ui, |ui| {
                    for each in Other::ALL {
                        let blocked = comparing.availability(each, document).err();
                        let button = Button::selectable(other == each, each.label());
                        let row = ui.add_enabled(blocked.is_none(), button);
                        if row.on_disabled_hover_text(blocked.unwrap_or_default()).clicked() {
                            other = each;
                        }
                    }
                })
                .response
        });
        comparing.other = other;
        if comparing.style == Style::Split {
            theme::input_row(ui, "Line, %", "Where the line is; drag it in the view too", |ui| {
                let mut percent = 100.0 * comparing.split;
                let slider = ui.add(Slider::new(&mut percent, 0.0..=100.0).fixed_decimals(0));
                if slider.changed() {
                    comparing.split = percent / 100.0;
                }
                slider
            });
        }
    });
    if comparing.style != Style::Off && !comparing.is_ready() {
        ui.label(RichText::new("Preparing the comparison…").weak());
    }
    ui.add_space(SPACE_XS);
    let judged = against_reference(ui, comparing);
    action.or(judged)
}

/// The counts, and the largest wrong regions.
fn against_reference(ui: &mut Ui, comparing: &mut Comparing) -> Option<Action> {
    let Some(reference) = comparing.reference() else {
        let button = ui.button(Command::OpenReference.label());
        let tooltip = Command::OpenReference.tooltip_with_keys(ui.ctx());
        return button
            .on_hover_text(tooltip)
            .clicked()
            .then_some(Command::OpenReference.into());
    };
    let name = theme::elided(&reference.name, 26);
    let Some(live) = comparing.judged() else {
        ui.label(RichText::new("Counting wrong points…").weak());
        return None;
    };
    theme::facts(ui, "against the reference", |ui| {
        let share = |n: u64| 100.0 * n as f64 / live.n_judged().max(1) as f64;
        let count = |n: u64| format!("{} ({:.2} %)", theme::thousands(n), share(n));
        theme::row(ui, "Reference", name);
        theme::row(ui, "Wrong points", count(live.n_wrong()));
        theme::row(ui, "With best flips", count(live.n_wrong_component_flip()));
    });
    let mut action = None;
    if let Some((_, regions)) = comparing.regions() {
        for (index, region) in regions.iter().take(N_ROWS).enumerate() {
            let text = format!("{} wrong", theme::counted(region.n_points as u64, "point", "points"));
            let is_there = comparing.at_region() == Some(index);
            let row =
                ui.add(Button::selectable(is_there, text).min_size(egui::Vec2::new(theme::content_width(ui), 0.0)));
            if row.on_hover_text("Fly there").clicked() {
                action = Some(Action::ShowWrong(index));
            }
        }
        if regions.is_empty() {
            ui.add(Label::new(RichText::new("No point is wrong against the reference.").weak()).wrap());
        }
    }
    let mut closes = false;
    ui.horizontal(|ui| {
        let next = ui.add_enabled(live.n_wrong() > 0, Button::new(Command::NextWrong.label()));
        let tooltip = Command::NextWrong.tooltip_with_keys(ui.ctx());
        let next = next.on_hover_text(tooltip).on_disabled_hover_text(NONE_WRONG);
        if next.clicked() {
            action = Some(Command::NextWrong.into());
        }
        closes = ui
            .button("Close reference")
            .on_hover_text("Compare with no reference any more")
            .clicked();
    });
    if closes {
        comparing.close_reference();
    }
    action
}
