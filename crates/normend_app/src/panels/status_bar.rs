//! One line on how the tool is used; one about the scan, what a click would turn, and the graphics adapter.

use egui::text::{LayoutJob, TextFormat};
use egui::{Align, Layout, RichText, Ui};
use normend_core::LiveComparison;

use crate::command::Command;
use crate::session::Session;
use crate::theme::{self, SPACE_M};
use crate::tools::Tool;

/// The status bar. `level` says which of the offered patches a click would turn, and of how many.
pub fn ui(
    ui: &mut Ui,
    session: Option<&Session>,
    n_would_turn: Option<u64>,
    level: Option<(usize, usize)>,
    tool: Option<Tool>,
    judged: Option<&LiveComparison>,
    adapter: &str,
) {
    if let Some(tool) = tool {
        let propagation = session.and_then(|session| session.document.propagation());
        hint_line(
            ui,
            tool,
            propagation.is_some_and(|propagation| propagation.patches.is_some()),
        );
    }
    ui.horizontal(|ui| {
        ui.spacing_mut().item_spacing.x = SPACE_M;
        match session {
            Some(session) => {
                for (index, fact) in facts(session).into_iter().enumerate() {
                    if index > 0 {
                        ui.label(RichText::new("·").weak());
                    }
                    ui.label(fact);
                }
                if session.n_interactions > 0 {
                    ui.label(RichText::new("·").weak());
                    ui.label(theme::counted(session.n_interactions, "interaction", "interactions"))
                        .on_hover_text(INTERACTIONS);
                }
                if let Some(judged) = judged {
                    ui.label(RichText::new("·").weak());
                    let color = if judged.n_wrong() == 0 {
                        ui.visuals().text_color()
                    } else {
                        ui.visuals().warn_fg_color
                    };
                    let text = theme::counted(judged.n_wrong(), "wrong point", "wrong points");
                    ui.label(RichText::new(text).color(color)).on_hover_text(format!(
                        "Against the reference; {} when each component is flipped to its better side",
                        theme::thousands(judged.n_wrong_component_flip())
                    ));
                }
                let n_undecided = session.n_undecided();
                if n_undecided > 0 {
                    ui.label(RichText::new("·").weak());
                    ui.label(RichText::new(either_way(n_undecided)).color(ui.visuals().warn_fg_color))
                        .on_hover_text(EITHER_WAY);
                }
            }
            None => {
                ui.label(RichText::new("No scan is open").weak());
            }
        }
        ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
            ui.add(egui::Label::new(RichText::new(adapter).weak()).truncate())
                .on_hover_text("The graphics adapter that draws the view");
            if let Some(n_points) = n_would_turn {
                ui.label(RichText::new("·").weak());
                let mut text = format!("A click turns {}", theme::counted(n_points, "point", "points"));
                if let Some((level, n_levels)) = level {
                    text += &format!(" (patch size {level} of {n_levels}{})", keys_of_size(ui.ctx()));
                }
                ui.label(RichText::new(text).color(theme::accent(ui)));
            }
        });
    });
}

/// ", [ and ] change it" with the keys as they are, or nothing where the user took them away.
fn keys_of_size(ctx: &egui::Context) -> String {
    let keys = [Command::SmallerPatch, Command::LargerPatch].map(|command| command.key_text(ctx));
    match keys {
        [Some(smaller), Some(larger)] => format!(", {smaller} and {larger} change it"),
        _ => String::new(),
    }
}

/// How the tool is used, from its own rows; as many as there is room for.
fn hint_line(ui: &mut Ui, tool: Tool, has_patches: bool) {
    let font = egui::TextStyle::Small.resolve(ui.style());
    let mut line = LayoutJob::default();
    let mut add = |text: &str, color| line.append(text, 0.0, TextFormat::simple(font.clone(), color));
    let (weak, strong) = (ui.visuals().weak_text_color(), ui.visuals().text_color());
    let hints = tool.hints().iter().filter(|hint| has_patches || !hint.is_about_sizes());
    for (index, hint) in hints.enumerate() {
        let Some(how) = hint.how_text(ui.ctx()) else { continue };
        add(if index == 0 { tool.label() } else { "" }, theme::accent(ui));
        add(if index == 0 { "     " } else { "      " }, weak);
        add(&how, strong);
        add(&format!("  {}", hint.what), weak);
    }
    ui.add(egui::Label::new(line).truncate())
        .on_hover_text(Command::Shortcuts.tooltip_with_keys(ui.ctx()));
}

/// What is counted.
const INTERACTIONS: &str = "Clicks, strokes and commands that changed something, as in Liu et al., figure 8; undo does not take \
                            them back";

/// What to do about components that could face either way.
const EITHER_WAY: &str = "Nothing tells which side of them is the right one: they are seen from both sides, or from none.\n\
                          Ctrl-click turns a whole component; another rule for the right side may tell more.";

/// Says in words that so many components could face either way.
pub fn either_way(n_undecided: usize) -> String {
    format!(
        "{} could face either way",
        theme::counted(n_undecided as u64, "component", "components")
    )
}

fn facts(session: &Session) -> Vec<String> {
    let mut facts = vec![theme::counted(session.scan.cloud.n_points() as u64, "point", "points")];
    if session.scan.n_left_out > 0 {
        let rows = theme::counted(session.scan.n_left_out as u64, "row", "rows");
        facts.push(format!("{rows} left out (not finite)"));
    }
    if let Some(propagation) = session.document.propagation() {
        let n_components = propagation.tree.roots().len() as u64;
        facts.push(theme::counted(n_components, "component", "components"));
    }
    facts.push(theme::counted(
        session.document.sources().len() as u64,
        "source",
        "sources",
    ));
    let document = &session.document;
    for (set, what) in [(document.selected(), "selected"), (document.hidden(), "hidden")] {
        if !set.is_empty() {
            facts.push(format!("{} {what}", theme::thousands(set.len())));
        }
    }
    facts
}
