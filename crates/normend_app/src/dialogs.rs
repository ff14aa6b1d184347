//! The system's file dialogs, awaited beside the window.

use std::path::{Path, PathBuf};
use std::sync::mpsc;
use std::thread;
use std::time::{Duration, Instant};

use normend_io::FileFormat;

/// What a dialog is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DialogPurpose {
    /// A scan to open.
    Open,
    /// The target of an export.
    Export,
}

/// What became of a dialog.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum DialogAnswer {
    /// The user picked a file.
    Picked(PathBuf),
    /// The user cancelled.
    Cancelled,
    /// No dialog came up: neither a desktop portal nor zenity answered.
    Unavailable,
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

    /// Asks for a scan to open. Does nothing while another dialog is open.
    pub fn pick_scan(&mut self, ctx: &egui::Context, folder: Option<&Path>) {
        let all: Vec<&str> = FileFormat::ALL
            .iter()
            .flat_map(|format| format.extensions())
            .copied()
            .collect();
        let mut dialog = rfd::AsyncFileDialog::new()
            .set_title("Open a scan")
            .add_filter("Point clouds", &all);
        for format in FileFormat::ALL {
            dialog = dialog.add_filter(format.label(), format.extensions());
        }
        dialog = dialog.add_filter("All files", &["*"]);
        if let Some(folder) = folder {
            dialog = dialog.set_directory(folder);
        }
        self.show(ctx, DialogPurpose::Open, || dialog.pick_file());
    }

    /// Asks for the target of an export, with `suggested` as the start. Does nothing while another dialog is open.
    pub fn pick_target(&mut self, ctx: &egui::Context, suggested: &Path) {
        let mut dialog = rfd::AsyncFileDialog::new().set_title("Export");
        if let Some(folder) = suggested.parent().filter(|folder| folder.is_dir()) {
            dialog = dialog.set_directory(folder);
        }
        if let Some(name) = suggested.file_name() {
            dialog = dialog.set_file_name(name.to_string_lossy());
        }
        self.show(ctx, DialogPurpose::Export, || dialog.save_file());
    }

    fn show<F>(&mut self, ctx: &egui::Context, purpose: DialogPurpose, start: impl FnOnce() -> F)
    where
        F: Future<Output = Option<rfd::FileHandle>> + Send + 'static,
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
                Some(file) => DialogAnswer::Picked(file.path().to_path_buf()),
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

impl Default for Dialogs {
    fn default() -> Self {
        Self::new()
    }
}
