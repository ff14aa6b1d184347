//! What the editor does when it is asked, and what it does with the results of jobs and dialogs.

use std::time::Duration;

use normend_core::{Document, Edit, Start};
use normend_render::DisplayMode;

use crate::app::{App, Leaving};
use crate::command::{Action, Command};
use crate::crash;
use crate::dialogs::{DialogAnswer, DialogPurpose};
use crate::job::JobError;
use crate::panels::export::ExportWindow;
use crate::panels::modal::Modal;
use crate::panels::open_path::OpenPathWindow;
use crate::panels::palette::PaletteWindow;
use crate::panels::preferences::next_scale;
use crate::panels::status_bar;
use crate::scene_sync::Scene;
use crate::session::Session;
use crate::settings::{Purpose, SPLAT_SCALES};
use crate::theme;
use crate::work::{ScanOrigin, Uploaded, Work};

const ZOOM_STEP: f32 = 1.25;
/// Pointer motion that one press of an arrow key stands for, in points.
const ORBIT_STEP: f32 = 24.0;
/// As above, with Shift.
const PAN_STEP: f32 = 40.0;
const SPLAT_STEP: f32 = 1.15;

impl App {
    /// Does what was asked for.
    pub fn act(&mut self, action: Action) {
        match action {
            Action::Run(command) => match self.availability(command) {
                Ok(()) => self.run(command),
                // A key that does nothing now says why.
                Err(reason) => {
                    let name = command.label().trim_end_matches('…');
                    self.messages.note(format!("{name}: {reason}."));
                }
            },
            Action::OpenScan(path) => self.leave(Leaving::Open(ScanOrigin::File(path))),
            Action::Display(mode) => self.mode = mode,
            Action::ClearRecent => self.settings.settings.recent.clear(),
            Action::Propagate(parameters) => {
                if let Some(session) = &mut self.session {
                    session.draft = parameters;
                    session.requested = parameters;
                    let uploader = self.scene.as_ref().map(Scene::uploader);
                    let work = Work::propagate(&self.ctx, &session.document, parameters, true, uploader);
                    self.work = Some(work);
                }
            }
            Action::GoToStep(n_steps) => self.go_to_step(n_steps),
            Action::SelectSource { point, extend } => self.select(point, extend),
            Action::FlyTo(point) => {
                if let Some(cloud) = self.document().map(|document| document.cloud().clone())
                    && let Some(&position) = cloud.positions().get(point as usize)
                {
                    self.viewport.fly_to(position, cloud.diagonal() * 0.25, None);
                }
            }
            Action::FlipSources(points) => self.apply_edit(Edit::FlipSources(points)),
            Action::RemoveSources(points) => self.apply_edit(Edit::RemoveSources(points)),
            Action::CancelJob => {
                if let Some(work) = &self.work {
                    work.cancel();
                }
            }
            Action::BrowseExport => {
                if let Some(Modal::Export(window)) = &self.windows.modal {
                    self.dialogs.pick_target(&self.ctx, std::path::Path::new(window.path()));
                }
            }
            Action::ExportTo { path, overwrite_input } => {
                let Some(session) = self.session.as_ref().filter(|_| self.work.is_none()) else {
                    self.messages
                        .error("Nothing was exported: other work is running. Wait for it, or cancel it.");
                    return;
                };
                // A relative path means the folder that the editor was started in; the message names it in full.
                let path = std::path::absolute(&path).unwrap_or(path);
                self.work = Work::export(&self.ctx, session, &path, overwrite_input);
            }
        }
    }

    fn run(&mut self, command: Command) {
        match command {
            Command::Open => self
                .dialogs
                .pick_scan(&self.ctx, self.settings.settings.folder(Purpose::Open)),
            Command::OpenPath => self.windows.modal = Some(Modal::OpenPath(OpenPathWindow::new(None))),
            Command::OpenSample => self.leave(Leaving::Open(ScanOrigin::Sample)),
            Command::Export => {
                if let Some(session) = &self.session {
                    let suggested = session.suggested_export(self.settings.settings.folder(Purpose::Export));
                    let window = ExportWindow::new(&suggested, session.scan.path().cloned());
                    self.windows.modal = Some(Modal::Export(window));
                }
            }
            Command::Quit => self.ctx.send_viewport_cmd(egui::ViewportCommand::Close),
            Command::Undo => self.step_history(Session::undo),
            Command::Redo => self.step_history(Session::redo),
            Command::MendHere => self.click_here(egui::Modifiers::NONE),
            Command::MendAlongTreeHere => self.click_here(egui::Modifiers::ALT),
            Command::LargerPatch => self.mend.step(1),
            Command::SmallerPatch => self.mend.step(-1),
            Command::TurnWholeHere => self.click_here(egui::Modifiers::COMMAND),
            Command::SetPivot => {
                let pixel = self.meant_pixel();
                if let (Some(scene), Some(session)) = (&self.scene, &self.session) {
                    let event = self.mend.pivot(scene, &session.document, pixel);
                    self.handle(event);
                }
            }
            Command::SelectAllSources => {
                if let Some(session) = &mut self.session {
                    session.selected = session.document.sources().iter().map(|source| source.point).collect();
                }
                self.show_sources();
            }
            Command::FlipSources => self.act(Action::FlipSources(self.selected_points())),
            Command::RemoveSources => self.act(Action::RemoveSources(self.selected_points())),
            Command::Propagate => {
                if let Some(parameters) = self.session.as_ref().map(|session| session.draft) {
                    self.act(Action::Propagate(parameters));
                }
            }
            Command::Cancel => self.cancel(),
            Command::Frame => self.frame(),
            Command::FrameAll => {
                if let Some(session) = &self.session {
                    self.viewport.frame_all(session.document.cloud());
                }
            }
            Command::ViewFront
            | Command::ViewBack
            | Command::ViewRight
            | Command::ViewLeft
            | Command::ViewTop
            | Command::ViewBottom
            | Command::ViewCorner => {
                if let Some(view) = command.standard_view() {
                    self.viewport.look_along(view);
                }
            }
            Command::ToggleOrthographic => self.viewport.toggle_orthographic(),
            Command::ZoomIn => self.viewport.zoom(ZOOM_STEP),
            Command::ZoomOut => self.viewport.zoom(1.0 / ZOOM_STEP),
            Command::OrbitLeft => self.viewport.orbit(egui::Vec2::new(-ORBIT_STEP, 0.0)),
            Command::OrbitRight => self.viewport.orbit(egui::Vec2::new(ORBIT_STEP, 0.0)),
            Command::OrbitUp => self.viewport.orbit(egui::Vec2::new(0.0, -ORBIT_STEP)),
            Command::OrbitDown => self.viewport.orbit(egui::Vec2::new(0.0, ORBIT_STEP)),
            Command::PanLeft => self.viewport.pan(egui::Vec2::new(-PAN_STEP, 0.0)),
            Command::PanRight => self.viewport.pan(egui::Vec2::new(PAN_STEP, 0.0)),
            Command::PanUp => self.viewport.pan(egui::Vec2::new(0.0, -PAN_STEP)),
            Command::PanDown => self.viewport.pan(egui::Vec2::new(0.0, PAN_STEP)),
            Command::Fly => self.viewport.toggle_fly(),
            Command::ClipBox => self.viewport.toggle_clip_box(),
            Command::CutDeeper => self.viewport.cut_deeper(1.0),
            Command::CutLess => self.viewport.cut_deeper(-1.0),
            Command::LargerSplats => self.scale_splats(SPLAT_STEP),
            Command::SmallerSplats => self.scale_splats(1.0 / SPLAT_STEP),
            Command::NextDisplayMode => {
                let all = DisplayMode::ALL;
                let at = all.iter().position(|&mode| mode == self.mode).unwrap_or_default();
                self.mode = all[(at + 1) % all.len()];
            }
            Command::LargerInterface => self.scale_interface(true),
            Command::SmallerInterface => self.scale_interface(false),
            Command::UsualInterface => self.settings.settings.ui_scale = 1.0,
            Command::Preferences => {
                self.windows.preferences = !self.windows.preferences;
                self.windows.preferences_view.rest();
            }
            Command::Palette => self.windows.modal = Some(Modal::Palette(PaletteWindow::default())),
            Command::ShowHints => self.settings.settings.dismissed_hints.clear(),
            Command::Shortcuts => {
                let is_open = self.windows.shortcuts.is_some();
                self.windows.shortcuts = (!is_open).then(String::new);
            }
            Command::Log => self.windows.log = !self.windows.log,
            Command::About => self.windows.about = !self.windows.about,
        }
    }

    fn click_here(&mut self, modifiers: egui::Modifiers) {
        let pixel = self.meant_pixel();
        if let (Some(scene), Some(session)) = (&self.scene, &self.session) {
            let event = self.mend.click(scene, &session.document, pixel, modifiers);
            self.handle(event);
        }
    }

    /// Shows what is selected, or else the whole scan.
    fn frame(&mut self) {
        let Some(session) = &self.session else { return };
        let cloud = session.document.cloud();
        if session.selected.is_empty() {
            self.viewport.frame_all(cloud);
        } else {
            let points = session.selected.iter();
            self.viewport
                .frame_points(points.map(|&point| cloud.positions()[point as usize]));
        }
    }

    fn scale_splats(&mut self, factor: f32) {
        let scale = &mut self.settings.settings.splat_scale;
        *scale = (*scale * factor).clamp(*SPLAT_SCALES.start(), *SPLAT_SCALES.end());
    }

    fn scale_interface(&mut self, larger: bool) {
        let scale = &mut self.settings.settings.ui_scale;
        *scale = next_scale(*scale, larger);
    }

    /// Escape: the first of these that applies.
    fn cancel(&mut self) {
        let windows = &mut self.windows;
        if let Some(modal) = windows.modal.take() {
            if matches!(modal, Modal::Export(_)) {
                self.after_export = None;
            }
        } else if windows.close() {
        } else if self.viewport.cancel() {
            // It was something in the view.
        } else if let Some(work) = &self.work {
            work.cancel();
        } else {
            self.deselect();
        }
    }

    fn selected_points(&self) -> Vec<u32> {
        self.session
            .iter()
            .flat_map(|session| session.selected.iter().copied())
            .collect()
    }

    fn select(&mut self, point: u32, extend: bool) {
        if let Some(session) = &mut self.session {
            if !extend {
                session.selected.clear();
            }
            if !session.selected.remove(&point) {
                session.selected.insert(point);
            }
        }
        self.show_sources();
    }

    pub(crate) fn deselect(&mut self) {
        if let Some(session) = &mut self.session {
            session.selected.clear();
        }
        self.show_sources();
    }

    fn show_sources(&mut self) {
        if let (Some(scene), Some(session)) = (&mut self.scene, &self.session) {
            scene.show_sources(session);
        }
    }

    pub(crate) fn apply_edit(&mut self, edit: Edit) {
        let Some(session) = &mut self.session else { return };
        match session.apply(edit) {
            Ok(change) => {
                if let Some(scene) = &mut self.scene {
                    scene.apply(&change, session);
                }
            }
            Err(error) => self.messages.error(format!("This edit was not applied: {error}.")),
        }
    }

    fn step_history(&mut self, step: impl FnOnce(&mut Session) -> Option<normend_core::Change>) {
        let Some(session) = &mut self.session else { return };
        if let Some(change) = step(session)
            && let Some(scene) = &mut self.scene
        {
            scene.apply(&change, session);
        }
    }

    /// Takes steps back, or does them again, until so many are done.
    fn go_to_step(&mut self, n_steps: usize) {
        loop {
            let n_done = self.document().map_or(n_steps, Document::n_done);
            let n_known = self.document().map_or(n_steps, |document| document.steps().count());
            match n_done.cmp(&n_steps.min(n_known)) {
                std::cmp::Ordering::Less => self.step_history(Session::redo),
                std::cmp::Ordering::Equal => return,
                std::cmp::Ordering::Greater => self.step_history(Session::undo),
            }
        }
    }

    /// Orients again when the document wants other parameters than those in force, as after they were taken back.
    pub(crate) fn keep_oriented(&mut self) {
        let Some(session) = &mut self.session else { return };
        let wanted = session.document.parameters();
        let Some(in_force) = session.document.propagation().map(|propagation| propagation.parameters) else {
            return;
        };
        match &self.work {
            None if wanted != in_force && wanted != session.requested => {}
            // The running one is for parameters that were taken back meanwhile.
            Some(Work::Propagate {
                parameters,
                is_asked: false,
                ..
            }) if *parameters != wanted => {}
            _ => return,
        }
        (session.draft, session.requested) = (wanted, wanted);
        self.work = None;
        if wanted != in_force {
            let uploader = self.scene.as_ref().map(Scene::uploader);
            let work = Work::propagate(&self.ctx, &session.document, wanted, false, uploader);
            self.work = Some(work);
        }
    }

    /// Leaves the document behind, after asking if it has mends that no exported file has.
    fn leave(&mut self, leaving: Leaving) {
        if self.is_unsaved() {
            self.windows.modal = Some(Modal::Unsaved(leaving));
        } else {
            self.leave_now(leaving);
        }
    }

    pub(crate) fn leave_now(&mut self, leaving: Leaving) {
        match leaving {
            Leaving::Quit => {
                self.quitting = true;
                self.ctx.send_viewport_cmd(egui::ViewportCommand::Close);
            }
            Leaving::Open(origin) => self.open(origin),
        }
    }

    /// Starts to read a scan; the present one stays until that succeeds.
    pub(crate) fn open(&mut self, origin: ScanOrigin) {
        if let Err(reason) = self.availability(Command::Open) {
            self.messages
                .error(format!("{} was not opened: {reason}.", origin.name()));
            return;
        }
        // A job that runs is dropped here, so its result cannot arrive.
        let uploader = self.scene.as_ref().map(Scene::uploader);
        self.work = Some(Work::open(&self.ctx, origin, uploader));
    }

    pub(crate) fn take_dialogs(&mut self) {
        while let Some((purpose, answer)) = self.dialogs.poll() {
            let note = "This system shows no file dialog (it needs a desktop portal or zenity). Type the path instead.";
            match (purpose, answer) {
                (_, DialogAnswer::Cancelled) => {}
                (DialogPurpose::Open, _) if self.windows.modal.is_some() => {
                    self.messages.note("No scan was opened: answer the open window first.");
                }
                (DialogPurpose::Open, DialogAnswer::Picked(path)) => self.act(Action::OpenScan(path)),
                (DialogPurpose::Open, DialogAnswer::Unavailable) => {
                    self.windows.modal = Some(Modal::OpenPath(OpenPathWindow::new(Some(note.to_owned()))));
                }
                (DialogPurpose::Export, DialogAnswer::Picked(path)) => {
                    if let Some(Modal::Export(window)) = &mut self.windows.modal {
                        window.set_path(&path);
                    }
                }
                (DialogPurpose::Export, DialogAnswer::Unavailable) => self.messages.note(note),
            }
        }
    }

    pub(crate) fn take_work(&mut self) {
        match self.work.take() {
            None => {}
            Some(Work::Open { job, origin }) => match job.poll() {
                None => self.work = Some(Work::Open { job, origin }),
                Some(Ok(scan)) => self.show_scan(scan, &origin),
                Some(Err(error)) => {
                    self.say_why(&format!("{} was not opened", theme::elided(&origin.name(), 48)), error)
                }
            },
            Some(Work::Propagate {
                job,
                parameters,
                is_asked,
            }) => match job.poll() {
                None => {
                    self.work = Some(Work::Propagate {
                        job,
                        parameters,
                        is_asked,
                    });
                }
                Some(Ok(propagation)) => self.install(propagation),
                Some(Err(error)) => {
                    self.say_why("The scan was not oriented", error);
                    if let Some(session) = &mut self.session
                        && is_asked
                        && let Some(propagation) = session.document.propagation()
                    {
                        session.requested = propagation.parameters;
                    }
                }
            },
            Some(Work::Export { job, path, revision }) => match job.poll() {
                None => {
                    self.work = Some(Work::Export { job, path, revision });
                }
                Some(Ok(())) => {
                    self.settings.settings.remember_folder(Purpose::Export, &path);
                    if let Some(session) = &mut self.session {
                        session.mark_saved(revision);
                        let n_points = theme::counted(session.scan.cloud.n_points() as u64, "point", "points");
                        self.messages
                            .info(format!("Exported {n_points} to {}.", path.display()));
                    }
                    if let Some(leaving) = self.after_export.take() {
                        self.leave(leaving);
                    }
                }
                Some(Err(JobError::Failed(reason))) if self.windows.modal.is_none() && self.session.is_some() => {
                    self.export_again(&path, &reason);
                }
                Some(Err(error)) => {
                    self.after_export = None;
                    self.say_why("Nothing was exported", error);
                }
            },
        }
    }

    /// Asks for the target once more after an export failed, with the same path and the reason.
    fn export_again(&mut self, path: &std::path::Path, reason: &str) {
        let name = ScanOrigin::File(path.to_path_buf()).name();
        let problem = format!("{} {} was not written.", sentence(reason), theme::elided(&name, 48));
        self.messages.log_error(problem.clone());
        let input = self.session.as_ref().and_then(|session| session.scan.path().cloned());
        let window = ExportWindow::after_failure(path, input, problem);
        self.windows.modal = Some(Modal::Export(window));
    }

    fn say_why(&mut self, what: &str, error: JobError) {
        match error {
            JobError::Cancelled => self.messages.note(format!("{what}: cancelled.")),
            JobError::Failed(reason) => {
                self.messages.error(format!("{} {what}.", sentence(&reason)));
            }
        }
    }

    fn show_scan(&mut self, scan: Uploaded<normend_io::Scan>, origin: &ScanOrigin) {
        if let ScanOrigin::File(path) = origin {
            self.settings.settings.remember_scan(path);
        }
        let session = Session::new(scan.result, origin.name());
        self.viewport.look_at(session.document.cloud());
        self.clicked_revision = None;
        if let Some(scene) = &mut self.scene {
            self.mend.reset(scene);
            if let Err(error) = scene.show_points(session.document.cloud(), scan.cloud) {
                self.messages
                    .error(format!("The scan is open but cannot be shown: {error}."));
            }
        }
        if session.scan.n_left_out > 0 {
            let rows = theme::counted(session.scan.n_left_out as u64, "row", "rows");
            self.messages.note(format!(
                "{rows} with a coordinate that is not finite are left out; they stay in the file."
            ));
        }
        let parameters = session.draft;
        crash::set_scan(session.scan.path().map(std::path::PathBuf::as_path));
        self.session = Some(session);
        self.act(Action::Propagate(parameters));
    }

    /// Shows the open scan as another propagation of it orients it, just as a finished job does.
    pub fn show_propagation(&mut self, propagation: normend_core::Propagation) {
        self.install(Uploaded {
            result: propagation,
            cloud: None,
        });
    }

    fn install(&mut self, propagation: Uploaded<normend_core::Propagation>) {
        let Some(session) = &mut self.session else { return };
        let Uploaded {
            result: propagation,
            cloud,
        } = propagation;
        let secs: f64 = propagation.seconds.iter().map(|(_, secs)| secs).sum();
        let is_from_one_place = propagation.found_station.is_some();
        session.install(propagation);
        if let Some(scene) = &mut self.scene {
            self.mend.reset(scene);
            if crash::is_loss_asked_for() {
                scene.lose_device();
            }
            if let Err(error) = scene.show_document(session, cloud) {
                self.messages
                    .error(format!("The scan is oriented but cannot be shown: {error}."));
            }
        }
        let n_points = theme::counted(session.scan.cloud.n_points() as u64, "point", "points");
        let time = Duration::from_secs_f64(secs.max(0.0)).as_secs_f32();
        self.messages
            .info(match (session.requested.start, session.n_without_normal) {
                (Start::Keep, 0) => format!("Kept the given normals of {n_points} ({time:.1} s)."),
                (Start::Keep, n_fitted) => format!(
                    "Kept the given normals of {n_points}, {} of them fitted because the file has none ({time:.1} s).",
                    theme::thousands(n_fitted as u64)
                ),
                (Start::Estimate, _) => format!("Oriented {n_points} in {time:.1} s."),
            });
        if is_from_one_place {
            self.messages.note("Scanned from one place: normals face it.");
        }
        let n_undecided = session.n_undecided();
        if n_undecided > 0 {
            self.messages.note(format!(
                "{}: Ctrl-click turns one.",
                status_bar::either_way(n_undecided)
            ));
        }
    }
}

/// `text` with a capital letter and a full stop.
fn sentence(text: &str) -> String {
    let stop = if text.ends_with('.') { "" } else { "." };
    let mut letters = text.chars();
    let first = letters.next().map(|letter| letter.to_uppercase().to_string());
    format!("{}{}{stop}", first.unwrap_or_default(), letters.as_str())
}
