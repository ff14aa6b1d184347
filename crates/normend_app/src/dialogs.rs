//! The system's file dialogs, awaited beside the window.

use std::path::{Path, PathBuf};
use std::sync::{LazyLock, mpsc};
use std::thread;
use std::time::{Duration, Instant};

use normend_io::{FileFormat, recipe};

use crate::app::App;
use crate::command::Action;
use crate::panels::modal::Modal;
use crate::panels::open_path::{OpenPathWindow, What};

/// What to say where files cannot be dropped on the window.
pub const NO_DROP: &str = "On Wayland, files cannot be dropped on this window.";

/// Whether files can be dropped on the window: winit 0.30 hands none on from Wayland.
pub fn can_drop() -> bool {
    static CAN_DROP: LazyLock<bool> = LazyLock::new(|| {
        let is_set = |variable| std::env::var_os(variable).is_some_and(|name| !name.is_empty());
        // winit takes Wayland wherever one of these is set.
        !(is_set("WAYLAND_DISPLAY") || is_set("WAYLAND_SOCKET"))
    });
    *CAN_DROP
}

/// What a dialog is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DialogPurpose {
    /// A scan to open, of one file or of several.
    Open,
    /// Files to add to the open scan.
    Add,
    /// The folder that the files of a scan are exported to.
    ExportFolder,
    /// The target of an export.
    Export,
    /// A recipe for the open scan.
    OpenRecipe,
    /// Where a recipe is saved.
    SaveRecipe,
    /// A scan to compare with.
    OpenReference,
}

/// What became of a dialog.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum DialogAnswer {
    /// The user picked a file, or a folder.
    Picked(PathBuf),
    /// The user picked several files.
    Several(Vec<PathBuf>),
    /// The user cancelled.
    Cancelled,
    /// No dialog came up: neither a desktop portal nor zenity answered.
    Unavailable,
}

/// What a dialog gives.
trait Picked {
    fn answer(self) -> DialogAnswer;
}

impl Picked for rfd::FileHandle {
    fn answer(self) -> DialogAnswer {
        DialogAnswer::Picked(self.path().to_path_buf())
    }
}

impl Picked for Vec<rfd::FileHandle> {
    fn answer(self) -> DialogAnswer {
        match &self[..] {
            [] => DialogAnswer::Cancelled,
            [file] => DialogAnswer::Picked(file.path().to_path_buf()),
            files => DialogAnswer::Several(files.iter().map(|file| file.path().to_path_buf()).collect()),
        }
    }
}

/// Nobody cancels a dialog faster than this; an answer that comes sooner says that there was none.
const TOO_QUICK: Duration = Duration::from_millis(400);

/// Dialogs that are open, and their answers.
pub struct Dialogs {
    sender: mpsc::Sender<(DialogPurpose, DialogAnswer)>,
    answers: mpsc::Receiver<(DialogPurpose, DialogAnswer)>,
    is_open: bool,
}

impl Dialogs {
    /// No dialog yet.
    pub fn new() -> Self {
        let (sender, answers) = mpsc::channel();
        Self {
            sender,
            answers,
            is_open: false,
        }
    }

    /// Asks for a scan to open, of one file or of several, or for files to add to one. Does nothing while another dialog is open.
    pub fn pick_scans(&mut self, ctx: &egui::Context, folder: Option<&Path>, adds: bool) {
        let all: Vec<&str> = FileFormat::ALL
            .iter()
            .flat_map(|format| format.extensions())
            .copied()
            .collect();
        let mut dialog = rfd::AsyncFileDialog::new()
            .set_title(if adds { "Add files" } else { "Open a scan" })
            .add_filter("Point clouds", &all);
        for format in FileFormat::ALL {
            dialog = dialog.add_filter(format.label(), format.extensions());
        }
        dialog = dialog.add_filter("All files", &["*"]);
        if let Some(folder) = folder {
            dialog = dialog.set_directory(folder);
        }
        let purpose = if adds { DialogPurpose::Add } else { DialogPurpose::Open };
        self.show(ctx, purpose, || dialog.pick_files());
    }

    /// Asks for the folder that the files of a scan are exported to. Does nothing while another dialog is open.
    pub fn pick_export_folder(&mut self, ctx: &egui::Context, suggested: &Path) {
        let mut dialog = rfd::AsyncFileDialog::new().set_title("Export to this folder");
        if suggested.is_dir() {
            dialog = dialog.set_directory(suggested);
        }
        self.show(ctx, DialogPurpose::ExportFolder, || dialog.pick_folder());
    }

    /// Asks for the target of an export, with `suggested` as the start. Does nothing while another dialog is open.
    pub fn pick_target(&mut self, ctx: &egui::Context, suggested: &Path) {
        let dialog = rfd::AsyncFileDialog::new().set_title("Export");
        self.save(ctx, DialogPurpose::Export, dialog, suggested);
    }

    /// Asks for a recipe to open. Does nothing while another dialog is open.
    pub fn pick_recipe(&mut self, ctx: &egui::Context, folder: Option<&Path>) {
        let mut dialog = rfd::AsyncFileDialog::new()
            .set_title("Open a recipe")
            .add_filter("Recipes", &[recipe::EXTENSION])
            .add_filter("All files", &["*"]);
        if let Some(folder) = folder {
            dialog = dialog.set_directory(folder);
        }
        self.show(ctx, DialogPurpose::OpenRecipe, || dialog.pick_file());
    }

    /// Asks for a scan to compare with. Does nothing while another dialog is open.
    pub fn pick_reference(&mut self, ctx: &egui::Context, folder: Option<&Path>) {
        let mut dialog = rfd::AsyncFileDialog::new().set_title("Compare with a reference");
        for format in FileFormat::ALL {
            dialog = dialog.add_filter(format.label(), format.extensions());
        }
        if let Some(folder) = folder {
            dialog = dialog.set_directory(folder);
        }
        self.show(ctx, DialogPurpose::OpenReference, || dialog.pick_file());
    }

    /// Asks where a recipe is saved, with `suggested` as the start. Does nothing while another dialog is open.
    pub fn pick_recipe_target(&mut self, ctx: &egui::Context, suggested: &Path) {
        let dialog = rfd::AsyncFileDialog::new()
            .set_title("Save recipe")
            .add_filter("Recipes", &[recipe::EXTENSION]);
        self.save(ctx, DialogPurpose::SaveRecipe, dialog, suggested);
    }

    fn save(
        &mut self,
        ctx: &egui::Context,
        purpose: DialogPurpose,
        mut dialog: rfd::AsyncFileDialog,
        suggested: &Path,
    ) {
        if let Some(folder) = suggested.parent().filter(|folder| folder.is_dir()) {
            dialog = dialog.set_directory(folder);
        }
        if let Some(name) = suggested.file_name() {
            dialog = dialog.set_file_name(name.to_string_lossy());
        }
        self.show(ctx, purpose, || dialog.save_file());
    }

    fn show<F, P: Picked>(&mut self, ctx: &egui::Context, purpose: DialogPurpose, start: impl FnOnce() -> F)
    where
        F: Future<Output = Option<P>> + Send + 'static,
    {
        if self.is_open {
            return;
        }
        // Some systems create dialogs on the thread of the window only; waiting for the answer happens elsewhere.
        let future = start();
        let (sender, ctx) = (self.sender.clone(), ctx.clone());
        let started = Instant::now();
        let spawned = thread::Builder::new().name("normend dialog".to_owned()).spawn(move || {
            let answer = match pollster::block_on(future) {
                Some(picked) => picked.answer(),
                None if started.elapsed() < TOO_QUICK => DialogAnswer::Unavailable,
                None => DialogAnswer::Cancelled,
            };
            // The editor may be gone; then nobody needs the answer.
            let _ = sender.send((purpose, answer));
            ctx.request_repaint();
        });
        self.is_open = spawned.is_ok();
    }

    /// The next answer. Never blocks.
    pub fn poll(&mut self) -> Option<(DialogPurpose, DialogAnswer)> {
        let answer = self.answers.try_recv().ok();
        if answer.is_some() {
            self.is_open = false;
        }
        answer
    }
}

impl App {
    /// Does what was answered in the system's dialogs.
    pub(crate) fn take_dialogs(&mut self) {
        while let Some((purpose, answer)) = self.dialogs.poll() {
            let note = "This system shows no file dialog (it needs a desktop portal or zenity). Type the path instead.";
            match (purpose, answer) {
                (_, DialogAnswer::Cancelled) => {}
                (DialogPurpose::Open | DialogPurpose::Add, _) if self.windows.modal.is_some() => {
                    self.messages.note("No scan was opened: answer the open window first.");
                }
                (DialogPurpose::Open, DialogAnswer::Picked(path)) => self.act(Action::OpenScan(path)),
                (DialogPurpose::Open, DialogAnswer::Several(paths)) => self.act(Action::OpenFiles(paths)),
                (DialogPurpose::Add, DialogAnswer::Picked(path)) => self.act(Action::AddFiles(vec![path])),
                (DialogPurpose::Add, DialogAnswer::Several(paths)) => self.act(Action::AddFiles(paths)),
                (DialogPurpose::Add, DialogAnswer::Unavailable) => {
                    self.windows.modal = Some(Modal::OpenPath(OpenPathWindow::new(What::Layer, Some(note.to_owned()))));
                }
                (DialogPurpose::ExportFolder, DialogAnswer::Picked(folder)) => {
                    if let Some(Modal::ExportLayers(window)) = &mut self.windows.modal {
                        window.set_folder(&folder);
                    }
                }
                // Only scans are picked several at a time.
                (_, DialogAnswer::Several(_)) => {}
                (DialogPurpose::Open, DialogAnswer::Unavailable) => {
                    self.windows.modal = Some(Modal::OpenPath(OpenPathWindow::new(What::Scan, Some(note.to_owned()))));
                }
                (DialogPurpose::OpenRecipe, _) if self.windows.modal.is_some() => {
                    self.messages
                        .note("No recipe was opened: answer the open window first.");
                }
                (DialogPurpose::OpenRecipe, DialogAnswer::Picked(path)) => self.act(Action::OpenRecipe(path)),
                (DialogPurpose::OpenRecipe, DialogAnswer::Unavailable) => {
                    self.windows.modal = Some(Modal::OpenPath(OpenPathWindow::new(
                        What::Recipe,
                        Some(note.to_owned()),
                    )));
                }
                (DialogPurpose::OpenReference, _) if self.windows.modal.is_some() => {
                    self.messages
                        .note("No reference was opened: answer the open window first.");
                }
                (DialogPurpose::OpenReference, DialogAnswer::Picked(path)) => self.act(Action::OpenReference(path)),
                (DialogPurpose::OpenReference, DialogAnswer::Unavailable) => {
                    let window = OpenPathWindow::new(What::Reference, Some(note.to_owned()));
                    self.windows.modal = Some(Modal::OpenPath(window));
                }
                (DialogPurpose::SaveRecipe, DialogAnswer::Picked(path)) => {
                    if let Some(Modal::SaveRecipe { window, .. }) = &mut self.windows.modal {
                        window.set_path(&path);
                    }
                }
                (DialogPurpose::Export, DialogAnswer::Picked(path)) => {
                    if let Some(Modal::Export(window)) = &mut self.windows.modal {
                        window.set_path(&path);
                    }
                }
                (
                    DialogPurpose::Export | DialogPurpose::ExportFolder | DialogPurpose::SaveRecipe,
                    DialogAnswer::Unavailable,
                ) => self.messages.note(note),
            }
        }
    }
}

impl Default for Dialogs {
    fn default() -> Self {
        Self::new()
    }
}
