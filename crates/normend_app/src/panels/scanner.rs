//! The places of the scanner, as a list with what each says of the points, and the field to type another.

use egui::{Button, Key, Label, RichText, ScrollArea, TextEdit, Ui, Vec2};

use crate::command::Action;
use crate::scanner_view::{PlaceRow, ScannerAction, ScannerView};
use crate::session::Session;
use crate::theme::{self, SPACE_S, SPACE_XS};

/// What the section is.
pub const ABOUT: &str = "Where the scanner was: it saw each point that it measured, so normals face it. Places come from the file \
                         (E57, PTX, PCD), from a table or trajectory beside it, or are typed here in the file's coordinates.";

const ROW_HEIGHT: f32 = 24.0;
const LIST_HEIGHT: f32 = 180.0;

/// The section. `blocked` says why nothing can be oriented again now.
pub fn ui(ui: &mut Ui, session: &mut Session, blocked: Option<&str>) -> Option<Action> {
    theme::section_about(ui, "Scanner places", ABOUT, |ui| {
        let mut action = None;
        if let Some(words) = session.scanner.places.words() {
            let mut counts = !session.document.state().scanner.without_file;
            let words = theme::elided(&words, 48);
            if ui
                .checkbox(&mut counts, words)
                .on_hover_text("Let them say which side is right")
                .changed()
            {
                action = Some(ScannerAction::UseFile(counts).into());
            }
        }
        let rows = ScannerView::rows(session);
        if rows.is_empty() {
            ui.add(Label::new(RichText::new("None is used.").weak()).wrap());
        }
        action = list(ui, &rows).or(action);
        ui.add_enabled_ui(blocked.is_none(), |ui| add(ui, session))
            .inner
            .or(action)
    })
}

/// The rows; only those in sight are laid out.
fn list(ui: &mut Ui, rows: &[PlaceRow]) -> Option<Action> {
    let mut action = None;
    let area = ScrollArea::vertical()
        .id_salt("scanner places")
        .max_height(LIST_HEIGHT)
        .auto_shrink([false, true]);
    area.show_rows(ui, ROW_HEIGHT, rows.len(), |ui, range| {
        for row in &rows[range] {
            ui.horizontal(|ui| {
                ui.set_min_height(ROW_HEIGHT);
                ui.spacing_mut().item_spacing.x = SPACE_XS;
                let name = Button::selectable(false, theme::elided(&row.name, 20));
                let name = ui.add(name).on_hover_text(about(row));
                if let Some(place) = row.place.filter(|_| name.clicked()) {
                    action = Some(ScannerAction::Show(place).into());
                }
                ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
                    if let Some(own) = row.own {
                        let remove = ui.add(Button::new("Remove").small());
                        let remove = remove.accessible_name(format!("Remove {}", row.name));
                        if remove.on_hover_text("Remove this place").clicked() {
                            action = Some(ScannerAction::Remove(own).into());
                        }
                    }
                    ui.label(RichText::new(words(row)).weak()).on_hover_text(
                        "Points that it saw well, and those of them whose normal faces away from it. Grazed points are not counted.",
                    );
                });
            });
        }
    });
    action
}

/// What a place says of the points.
fn words(row: &PlaceRow) -> String {
    match row.tally {
        None => "…".to_owned(),
        Some(tally) => format!(
            "{}, {} against",
            theme::thousands(tally.n_votes),
            theme::thousands(tally.n_against)
        ),
    }
}

fn about(row: &PlaceRow) -> String {
    match row.place {
        Some(place) => {
            let [x, y, z] = place.to_array().map(theme::coordinate);
            format!("{}: {x}, {y}, {z}\nClick to bring it into view", row.name)
        }
        None => "The way of a scanner that moved".to_owned(),
    }
}

/// The field and the buttons for another place.
fn add(ui: &mut Ui, session: &mut Session) -> Option<Action> {
    let mut action = None;
    let n_selected = session.document.selected().len();
    let scanner = &mut session.scanner;
    scanner.for_selected &= n_selected > 0;
    let for_selected = scanner.for_selected;
    let place = ScannerView::parse(&scanner.typed);
    ui.horizontal(|ui| {
        ui.spacing_mut().item_spacing.x = SPACE_XS;
        ui.spacing_mut().button_padding.x = SPACE_S;
        let width = theme::content_width(ui) - 56.0;
        let field = TextEdit::singleline(&mut scanner.typed)
            .hint_text("x y z")
            .desired_width(width);
        let field = ui.add_sized(Vec2::new(width, ui.spacing().interact_size.y), field);
        let field = field.accessible_name("Scanner place");
        let is_entered = field.lost_focus() && ui.input(|input| input.key_pressed(Key::Enter));
        field.on_hover_text("Where the scanner stood, in the file's coordinates, such as 1.5 0 -2");
        let button = ui.add_enabled(place.is_some(), Button::new("Add"));
        let button = button.accessible_name("Add scanner place");
        let button = button.on_hover_text("Let normals face this place");
        let is_clicked = button.on_disabled_hover_text("Type three numbers first").clicked();
        if let Some(place) = place.filter(|_| is_clicked || is_entered) {
            action = Some(ScannerAction::Add { place, for_selected }.into());
        }
    });
    ui.horizontal(|ui| {
        let here = ui.button("Add where I look from");
        if here.on_hover_text("Add the place of the camera").clicked() {
            action = Some(ScannerAction::AddHere { for_selected }.into());
        }
    });
    let words = match n_selected {
        0 => "For the selected points alone".to_owned(),
        n => format!("For the {} selected points alone", theme::thousands(n)),
    };
    let only = ui.add_enabled(
        n_selected > 0,
        egui::Checkbox::new(&mut session.scanner.for_selected, words),
    );
    only.on_hover_text("Else a new place is that of all points")
        .on_disabled_hover_text("Select points first; else a new place is that of all points");
    action
}
