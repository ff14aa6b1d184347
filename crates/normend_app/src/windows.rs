//! The windows over the editor: which are open, what their answers do, and what Escape closes.

use egui::Ui;

use crate::app::App;
use crate::command::{Action, Command};
use crate::crash::{self, Edits};
use crate::journal::Journal;
use crate::panels::modal::Modal;
use crate::panels::preferences::Preferences;
use crate::panels::{about, export, export_layers, messages, open_path, palette, screenshot, shortcuts, unsaved};
use crate::session::Session;

/// The windows over the editor; `None` or `false` is closed.
#[derive(Default)]
pub(crate) struct Windows {
    /// While it is open, nothing else acts.
    pub(crate) modal: Option<Modal>,
    pub(crate) shortcuts: Option<String>,
    pub(crate) log: bool,
    pub(crate) log_view: messages::LogView,
    pub(crate) about: bool,
    pub(crate) preferences: bool,
    pub(crate) preferences_view: Preferences,
}

impl Windows {
    /// Closes all that leave the editor to itself; says whether any was open.
    pub(crate) fn close(&mut self) -> bool {
        let any = self.shortcuts.is_some() || self.about || self.log || self.preferences;
        self.shortcuts = None;
        (self.about, self.log, self.preferences) = (false, false, false);
        self.preferences_view.rest();
        any
    }
}

impl App {
    /// The window is up. Says what became of the last one: `news` is of a crash that the user was not told of yet.
    pub(crate) fn say_what_happened(&mut self, news: Option<crash::News>) {
        crash::start(&self.adapter);
        if crash::is_panic_asked_for() {
            std::panic::panic_any("this panic was asked for");
        }
        if let Some(news) = news {
            let edits = match news.edits {
                Some(Edits::Kept) => " Your edits are kept: open the scan again.",
                Some(Edits::Lost) => " The edits since the last export are lost: their journal could not be written.",
                Some(Edits::None) | None => "",
            };
            self.messages.error(format!(
                "Normend closed unexpectedly the last time.{edits} A report is at {}.",
                news.path.display()
            ));
        }
        let restarted = "The graphics device was lost, so Normend started again with your scan.";
        if crash::has_lost_edits() {
            self.messages.error(format!(
                "{restarted} The edits since the last export are lost: their journal could not be written."
            ));
        } else if crash::was_restarted() {
            self.messages.note(restarted);
        }
    }

    pub(crate) fn show_windows(&mut self, ui: &Ui) {
        if let Some(search) = &mut self.windows.shortcuts {
            let mut open = true;
            shortcuts::ui(ui, &mut open, search);
            if !open {
                self.windows.shortcuts = None;
            }
        }
        if self.windows.log {
            let running = self.work.as_ref().map(|work| (work.title(), work.status()));
            let windows = &mut self.windows;
            messages::log(ui, &mut windows.log, &mut windows.log_view, &mut self.messages, running);
        }
        if self.windows.about {
            about::ui(ui, &mut self.windows.about, &self.adapter);
        }
        if self.windows.preferences {
            let windows = &mut self.windows;
            let settings = &mut self.settings.settings;
            windows.preferences_view.ui(ui, &mut windows.preferences, settings);
        }
        self.show_modal(ui);
    }

    fn ask_palette(&self, ui: &Ui, window: &mut palette::PaletteWindow) -> palette::Decision {
        let settings = &self.settings.settings;
        let availability = |command: Command| self.availability(command);
        let offers = palette::Offers {
            availability: &availability,
            recent_commands: &settings.recent_commands,
            recent_scans: &settings.recent,
            mode: self.session.as_ref().map(|_| self.display.coloring()),
        };
        window.ui(ui, &offers)
    }

    fn show_modal(&mut self, ui: &Ui) {
        // What is decided may open the next window, so this one is closed first and put back while it waits.
        match self.windows.modal.take() {
            None => {}
            Some(Modal::Palette(mut window)) => match self.ask_palette(ui, &mut window) {
                palette::Decision::Wait => self.windows.modal = Some(Modal::Palette(window)),
                palette::Decision::Close => {}
                palette::Decision::Act(action) => {
                    if let Action::Run(command) = &action {
                        self.settings.settings.remember_command(command.name());
                    }
                    self.act(action);
                }
            },
            Some(Modal::Columns(mut window)) => {
                let decision = window.ui(ui);
                self.decide_columns(window, decision);
            }
            Some(Modal::Restore) => self.ask_offer(ui),
            Some(Modal::SaveRecipe { window, of_offer }) => self.ask_save(ui, window, of_offer),
            Some(Modal::OtherScan { recipe, name }) => self.ask_other_scan(ui, recipe, name),
            Some(Modal::Picture(mut window)) => match window.ui(ui) {
                screenshot::Decision::Wait => self.windows.modal = Some(Modal::Picture(window)),
                screenshot::Decision::Close => {}
                screenshot::Decision::Draw(order) => self.make_pictures(&order),
            },
            Some(Modal::OpenPath(mut window)) => match window.ui(ui) {
                open_path::Decision::Wait => self.windows.modal = Some(Modal::OpenPath(window)),
                open_path::Decision::Close => {}
                open_path::Decision::Open(path) => self.act(match window.what {
                    open_path::What::Scan => Action::OpenScan(path),
                    open_path::What::Layer => Action::AddFiles(vec![path]),
                    open_path::What::Recipe => Action::OpenRecipe(path),
                    open_path::What::Reference => Action::OpenReference(path),
                }),
            },
            Some(Modal::Export(mut window)) => match window.ui(ui) {
                export::Decision::Wait => self.windows.modal = Some(Modal::Export(window)),
                export::Decision::Close => self.after_export = None,
                export::Decision::Browse => {
                    self.windows.modal = Some(Modal::Export(window));
                    self.act(Action::BrowseExport);
                }
                export::Decision::Export(order) => self.act(Action::ExportTo(order)),
            },
            Some(Modal::ExportLayers(mut window)) => match window.ui(ui) {
                export_layers::Decision::Wait => self.windows.modal = Some(Modal::ExportLayers(window)),
                export_layers::Decision::Close => self.after_export = None,
                export_layers::Decision::Browse => {
                    self.dialogs
                        .pick_export_folder(&self.ctx, std::path::Path::new(window.folder()));
                    self.windows.modal = Some(Modal::ExportLayers(window));
                }
                export_layers::Decision::Export(order) => self.act(Action::ExportTo(order)),
            },
            Some(Modal::Unsaved(leaving)) => {
                let session = self.session.as_ref();
                let name = session.map_or("this scan", |session| &session.name);
                let mends = session.is_none_or(Session::has_unsaved_mends);
                let journal = session.and_then(|session| session.journal.as_ref());
                match unsaved::ui(ui, name, mends, journal.is_some_and(Journal::is_kept)) {
                    unsaved::Decision::Keep => self.leave_now(leaving),
                    unsaved::Decision::Wait => self.windows.modal = Some(Modal::Unsaved(leaving)),
                    unsaved::Decision::Export => {
                        self.act(Command::Export.into());
                        match &self.windows.modal {
                            Some(Modal::Export(_) | Modal::ExportLayers(_)) => self.after_export = Some(leaving),
                            _ => self.windows.modal = Some(Modal::Unsaved(leaving)),
                        }
                    }
                    unsaved::Decision::Discard => {
                        if let Some(session) = &mut self.session {
                            session.is_discarded = true;
                        }
                        self.leave_now(leaving);
                    }
                    unsaved::Decision::Cancel => {}
                }
            }
        }
    }
}
