//! What is open, and how it is oriented.

use egui::{Button, ComboBox, DragValue, RichText, Ui, Vec2};
use normend_core::propagation::{ETA, VIEWS};
use normend_core::{EdgeRule, Estimator, Method, Parameters, Preset, SideRule, SourceRule, Start};

use crate::command::{Action, Command};
use crate::session::Session;
use crate::theme::{self, SPACE_XS};

const K_NORMALS: std::ops::RangeInclusive<usize> = 3..=64;
const K_GRAPH: std::ops::RangeInclusive<usize> = 1..=32;

/// The tab. `propagating` says that a propagation runs, `blocked` why none can be started.
pub fn ui(ui: &mut Ui, session: &mut Session, propagating: bool, blocked: Option<&str>) -> Option<Action> {
    theme::section(ui, "Scan", |ui| scan(ui, session));
    theme::section(ui, "Propagation", |ui| propagation(ui, session, propagating, blocked))
}

fn scan(ui: &mut Ui, session: &Session) {
    theme::facts(ui, "scan", |ui| {
        theme::row(
            ui,
            "File",
            format!("{} ({})", theme::elided(&session.name, 24), session.scan.label()),
        );
        theme::row(ui, "Points", theme::thousands(session.scan.cloud.n_points() as u64));
        if session.scan.n_left_out > 0 {
            ui.label(RichText::new("Left out").weak());
            ui.label(theme::counted(session.scan.n_left_out as u64, "row", "rows"))
                .on_hover_text("Rows with a coordinate that is not finite. They stay in the file.");
            ui.end_row();
        }
        let (min, max) = session.scan.cloud.bounding_box();
        let size = max - min;
        theme::row(
            ui,
            "Size",
            format!("{:.4} × {:.4} × {:.4}", Short(size.x), Short(size.y), Short(size.z)),
        );
        // What the propagation in force made of them.
        let start = session.document.propagation().map(|found| found.parameters.start);
        let normals = match (session.scan.given_normals.is_some(), start) {
            (true, Some(Start::Estimate)) => "Estimated (the file has some)",
            (true, _) => "In the file",
            (false, Some(_)) => "Estimated (none in the file)",
            (false, None) => "None in the file",
        };
        theme::row(ui, "Normals", normals);
    });
}

/// A length with about four significant digits.
struct Short(f32);

impl std::fmt::Display for Short {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let value = self.0;
        if value != 0.0 && !(1e-3..1e6).contains(&value.abs()) {
            return write!(f, "{value:.2e}");
        }
        let digits = (3 - value.abs().max(1e-3).log10().floor() as i32).clamp(0, 6) as usize;
        write!(f, "{value:.digits$}")
    }
}

fn propagation(ui: &mut Ui, session: &mut Session, propagating: bool, blocked: Option<&str>) -> Option<Action> {
    let has_normals = session.scan.given_normals.is_some();
    let draft = &mut session.draft;
    // Only what has an effect is shown: the automatic method chooses for itself, and given normals say their side.
    theme::rows(ui, "propagation", |ui| {
        start_row(ui, draft, has_normals);
        let keeps = draft.start == Start::Keep;
        if !keeps {
            preset_row(ui, draft);
            side_row(ui, draft, has_normals);
        }
        if !keeps && draft.method == Method::Agglomeration {
            return;
        }
        if !keeps || session.n_without_normal > 0 {
            estimator_rows(ui, draft);
        }
        graph_rows(ui, draft);
        if !keeps {
            source_rows(ui, draft);
        }
    });
    let never_ran = session.document.propagation().is_none() && !propagating;
    let changed = *draft != session.requested;
    let mut action = None;
    ui.add_space(SPACE_XS);
    ui.horizontal(|ui| {
        let button = if changed || never_ran {
            theme::primary_button(ui, "Propagate")
        } else {
            Button::new("Propagate")
        };
        let response = ui.add_enabled(blocked.is_none(), button);
        let tooltip = Command::Propagate.tooltip_with_keys(ui.ctx());
        if response
            .on_hover_text(tooltip)
            .on_disabled_hover_text(blocked.unwrap_or_default())
            .clicked()
        {
            action = Some(Action::Propagate(*draft));
        }
        let revert = ui.add_enabled(changed, Button::new("Revert"));
        let revert = revert.on_hover_text("Back to the parameters in force");
        if revert.on_disabled_hover_text("Nothing is changed").clicked() {
            *draft = session.requested;
        }
    });
    // The line is there with or without words, so that what stands below stays where it is.
    let hint = if changed { "Changed, not applied yet" } else { "" };
    ui.label(RichText::new(hint).color(ui.visuals().warn_fg_color));
    action
}

fn start_row(ui: &mut Ui, draft: &mut Parameters, has_normals: bool) {
    ui.label(RichText::new("Start").weak())
        .on_hover_text("Where the first normals come from");
    ui.horizontal(|ui| {
        let widths = theme::filling(ui, Start::ALL.map(Start::label), theme::value_width(ui), SPACE_XS);
        ui.spacing_mut().item_spacing.x = SPACE_XS;
        ui.spacing_mut().button_padding.x = 0.0;
        for (each, width) in Start::ALL.into_iter().zip(widths) {
            let possible = each != Start::Keep || has_normals;
            let button = Button::selectable(draft.start == each, each.label()).min_size(Vec2::new(width, 0.0));
            let response = ui.add_enabled(possible, button);
            let tooltip = match each {
                Start::Estimate => "Fit normals to the points and orient them",
                Start::Keep => "Take the file's normals and their sides as they are, to mend them",
            };
            let response = response
                .on_hover_text(tooltip)
                .on_disabled_hover_text("This file has no normals to keep");
            if response.clicked() {
                draft.start = each;
            }
        }
    });
    ui.end_row();
}

fn preset_row(ui: &mut Ui, draft: &mut Parameters) {
    theme::input_row(
        ui,
        "Preset",
        "A whole method; what is set below replaces parts of it",
        |ui| {
            let present = Preset::of(draft);
            ComboBox::from_id_salt("preset")
                .selected_text(present.map_or("Set by hand", Preset::label))
                .show_ui(ui, |ui| {
                    for each in Preset::ALL {
                        if ui.selectable_label(present == Some(each), each.label()).clicked() {
                            *draft = Parameters {
                                start: draft.start,
                                rule: draft.rule,
                                ..each.parameters()
                            };
                        }
                    }
                })
                .response
        },
    );
}

/// The rule for the side of each component.
fn side_row(ui: &mut Ui, draft: &mut Parameters, has_normals: bool) {
    theme::input_row(ui, "Right side", "Where the normals of each part point", |ui| {
        ComboBox::from_id_salt("right side")
            .selected_text(draft.rule.label())
            .show_ui(ui, |ui| {
                for each in SideRule::ALL {
                    let missing = match each {
                        SideRule::TowardScanner => Some(
                            "No place of the scanner is known here; normend orient takes it with --scanner or --sensors",
                        ),
                        SideRule::Given if !has_normals => Some("This file has no normals"),
                        _ => None,
                    };
                    let button = Button::selectable(draft.rule == each, each.label());
                    let response = ui
                        .add_enabled(missing.is_none(), button)
                        .on_hover_text(side_meaning(each))
                        .on_disabled_hover_text(missing.unwrap_or_default());
                    if response.clicked() {
                        draft.rule = each;
                    }
                }
            })
            .response
    });
}

fn side_meaning(rule: SideRule) -> &'static str {
    match rule {
        SideRule::Automatic => "Toward the scanner where all was seen from one place, else out of the thing",
        SideRule::Outward => "Out of the thing: objects",
        SideRule::TowardScanner => "Toward the place that a point was scanned from",
        SideRule::Up => "Up along z: terrain",
        SideRule::IntoRoom => "To where one stands inside: rooms",
        SideRule::Given => "As most normals of the file do",
    }
}

/// How normals are fitted.
fn estimator_rows(ui: &mut Ui, draft: &mut Parameters) {
    theme::input_row(ui, "Estimator", "How a normal is fitted to its neighbors", |ui| {
        let before = draft.estimator;
        let response = ComboBox::from_id_salt("estimator")
            .selected_text(draft.estimator.label())
            .show_ui(ui, |ui| {
                for each in Estimator::ALL {
                    ui.selectable_value(&mut draft.estimator, each, each.label());
                }
            })
            .response;
        if draft.k_normals == before.usual_k() {
            draft.k_normals = draft.estimator.usual_k();
        }
        response
    });
    theme::input_row(ui, "k for normals", "Neighbors that a normal is fitted to", |ui| {
        ui.add(DragValue::new(&mut draft.k_normals).range(K_NORMALS).speed(0.1))
    });
}

/// What the spanning tree is grown on, which is what clicks go by.
fn graph_rows(ui: &mut Ui, draft: &mut Parameters) {
    theme::input_row(
        ui,
        "k for the graph",
        "Neighbors of each point in the Riemannian graph",
        |ui| ui.add(DragValue::new(&mut draft.k_graph).range(K_GRAPH).speed(0.1)),
    );
    theme::input_row(ui, "Edge rule", "How the normals of neighbors are compared", |ui| {
        ComboBox::from_id_salt("edge rule")
            .selected_text(draft.edge_rule.label())
            .show_ui(ui, |ui| {
                for each in EdgeRule::ALL {
                    ui.selectable_value(&mut draft.edge_rule, each, each.label());
                }
            })
            .response
    });
}

/// Who vouches for the first signs, and how many look.
fn source_rows(ui: &mut Ui, draft: &mut Parameters) {
    theme::input_row(
        ui,
        "First sources",
        "Who says which side is right, before you do",
        |ui| {
            ComboBox::from_id_salt("sources")
                .selected_text(draft.sources.label())
                .show_ui(ui, |ui| {
                    for each in SourceRule::ALL {
                        ui.selectable_value(&mut draft.sources, each, each.label());
                    }
                })
                .response
        },
    );
    if draft.sources != SourceRule::Highest {
        theme::input_row(ui, "Viewpoints", "8 are the corners of the bounding box", |ui| {
            ui.add(DragValue::new(&mut draft.views).range(VIEWS).speed(0.1))
        });
        let meaning = "How far from the surest votes sources are taken: in votes, or as a share for mended ones";
        theme::input_row(ui, "Eta", meaning, |ui| {
            ui.add(DragValue::new(&mut draft.eta).range(ETA).speed(0.005).max_decimals(3))
        });
    }
}

#[cfg(test)]
mod tests {
    use super::Short;

    #[test]
    fn lengths_have_about_four_digits() {
        let check = |value, expect: &str| assert_eq!(Short(value).to_string(), expect);
        check(0.0, "0.000000");
        check(1.0, "1.000");
        check(12.345_67, "12.35");
        check(0.012_346, "0.01235");
        check(123_456.0, "123456");
        check(1.5e-7, "1.50e-7");
        check(2.0e9, "2.00e9");
    }
}
