//! Windows that have the keyboard and the pointer to themselves until they are closed; one at a time.

use std::sync::Arc;

use egui::{Id, Key, RichText, Ui};
use normend_io::recipe::Recipe;

use super::columns::ColumnsWindow;
use super::export::ExportWindow;
use super::export_layers::LayersWindow;
use super::open_path::OpenPathWindow;
use super::palette::PaletteWindow;
use super::screenshot::PictureWindow;
use crate::app::Leaving;
use crate::theme::{SPACE_L, SPACE_S};

/// The window that has to be answered before the editor goes on.
#[derive(Clone, Debug)]
pub(crate) enum Modal {
    /// Where the oriented scan goes.
    Export(ExportWindow),
    /// Where each file of it goes.
    ExportLayers(LayersWindow),
    /// Which scan to open.
    OpenPath(OpenPathWindow),
    /// Where the recipe goes; `of_offer` when it is made of a journal that is offered.
    SaveRecipe { window: ExportWindow, of_offer: bool },
    /// What becomes of a journal that was left behind.
    Restore,
    /// Whether a recipe of another file is meant.
    OtherScan { recipe: Arc<Recipe>, name: String },
    /// What the columns of the text are.
    Columns(ColumnsWindow),
    /// Pictures of the view.
    Picture(PictureWindow),
    /// What to do, found by a few letters.
    Palette(PaletteWindow),
    /// Whether mends may be lost.
    Unsaved(Leaving),
}

/// The button that closes such a window and changes nothing; says whether it was clicked.
pub(crate) fn cancel_button(ui: &mut Ui) -> bool {
    let button = ui.button("Cancel");
    button
        .on_hover_text("Close this window, change nothing (Escape)")
        .clicked()
}

/// Shows a window called `title` over a backdrop that takes every click beside it. Tab stays inside.
pub(crate) fn show<R>(ui: &Ui, title: &str, width: f32, content: impl FnOnce(&mut Ui) -> R) -> R {
    let room = ui.ctx().content_rect().width() - 4.0 * SPACE_L;
    egui::Modal::new(Id::unique(("modal", title)))
        .frame(egui::Frame::window(ui.style()))
        .show(ui.ctx(), |ui| {
            ui.set_width(width.min(room));
            ui.label(RichText::new(title).heading().color(ui.visuals().strong_text_color()));
            ui.add_space(SPACE_S);
            content(ui)
        })
        .inner
}

/// Whether Enter means the window's primary button: it does unless another widget has the focus and takes it. Asked
/// after the window's fields, which give the focus back on Enter.
pub(crate) fn enter_pressed(ui: &Ui) -> bool {
    ui.input(|input| input.key_pressed(Key::Enter)) && ui.memory(|memory| memory.focused().is_none())
}
