//! What the editor does when it is asked, and what it does with the results of jobs and dialogs.

use std::sync::Arc;
use std::time::Duration;

use normend_core::{Edit, Propagation, Start};

use crate::app::{App, Leaving};
use crate::command::{Action, Command};
use crate::compare::Style;
use crate::crash;
use crate::job::JobError;
use crate::panels::export::ExportOrder;
use crate::panels::modal::Modal;
use crate::panels::open_path::{OpenPathWindow, What};
use crate::panels::palette::PaletteWindow;
use crate::panels::preferences::next_scale;
use crate::panels::status_bar;
use crate::scene_sync::Scene;
use crate::session::Session;
use crate::settings::{Purpose, SPLAT_SCALES};
use crate::suspects_list::SuspectAction;
use crate::theme;
use crate::tools::point_tool::Means;
use crate::work::{Opened, ScanOrigin, Uploaded, Work};

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
            Action::Run(command) if self.take_for_what_is_under_way(command) => {}
            Action::Run(command) => match self.availability(command) {
                Ok(()) => self.run(command),
                // A key that does nothing now says why.
                Err(reason) => {
                    let name = command.label().trim_end_matches('…');
                    self.messages.note(format!("{name}: {reason}."));
                }
            },
            Action::OpenRecipe(path) => self.open_recipe(&path),
            Action::OpenScan(path) => self.leave(Leaving::Open(ScanOrigin::File(path))),
            Action::OpenFiles(paths) => self.open_files(paths),
            Action::AddFiles(paths) => self.add_files(paths),
            Action::Layers(action) => self.act_on_layers(action),
            Action::Display(coloring) => self.set_coloring(coloring),
            Action::SelectValues { range, modifiers } => self.select_values(range, modifiers),
            Action::Compare(style) => self.toggle_compare(style),
            Action::OpenReference(path) => self.open_reference(&path),
            Action::ShowWrong(index) => self.show_wrong(index),
            Action::Theme(theme) => self.settings.settings.theme = theme,
            Action::InterfaceScale(scale) => self.settings.settings.ui_scale = scale,
            Action::ClearRecent => self.settings.settings.recent.clear(),
            Action::Propagate(parameters) => {
                if let Some(session) = &mut self.session {
                    session.draft = parameters;
                    session.requested = parameters;
                    session.requested_viewpoints = Arc::clone(&session.document.state().viewpoints);
                    session.requested_scanner = session.document.state().scanner.clone();
                    let uploader = self.scene.as_ref().map(Scene::uploader);
                    let work = Work::propagate(&self.ctx, session, parameters, true, uploader);
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
            Action::Point { pixel, means } => self.click_at(pixel, means),
            Action::Pivot(pixel) => self.pivot_at(pixel),
            Action::FlipSources(points) => self.apply_edit(Edit::FlipSources(points)),
            Action::RemoveSources(points) => self.apply_edit(Edit::RemoveSources(points)),
            Action::ProposeParameters(parameters) => self.propagate_if_possible(Action::Propagate(parameters)),
            Action::ShowKind(kind, shown) => {
                if let Some(session) = &mut self.session {
                    session.kinds.show(kind, shown);
                }
                self.show_sources();
            }
            Action::DropKind(kind) => self.drop_kind(kind),
            Action::Viewpoints(action) => self.act_on_viewpoints(action),
            Action::Scanner(action) => self.act_on_scanner(action),
            Action::Components(action) => self.act_on_components(action),
            Action::Suspects(action) => self.review(action),
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
            Action::ExportTo(order) => {
                if let Err(reason) = self.availability(Command::Export) {
                    self.messages.error(format!("Nothing was exported: {reason}."));
                    return;
                }
                let Some(session) = &self.session else { return };
                self.work = Work::export(&self.ctx, session, order.absolute());
            }
        }
    }

    pub(crate) fn run(&mut self, command: Command) {
        match command {
            Command::Open => self
                .dialogs
                .pick_scans(&self.ctx, self.settings.settings.folder(Purpose::Open), false),
            Command::AddFiles => self
                .dialogs
                .pick_scans(&self.ctx, self.settings.settings.folder(Purpose::Open), true),
            Command::OpenPath => {
                self.windows.modal = Some(Modal::OpenPath(OpenPathWindow::new(What::Scan, None)));
            }
            Command::OpenRecipe => self
                .dialogs
                .pick_recipe(&self.ctx, self.settings.settings.folder(Purpose::Recipe)),
            Command::OpenRecipePath => {
                self.windows.modal = Some(Modal::OpenPath(OpenPathWindow::new(What::Recipe, None)));
            }
            Command::SaveRecipe => self.ask_recipe_target(),
            Command::OpenSample => self.leave(Leaving::Open(ScanOrigin::Sample)),
            Command::Export => self.ask_export_target(),
            Command::Quit => self.ctx.send_viewport_cmd(egui::ViewportCommand::Close),
            Command::Undo => self.step_history(Session::undo),
            Command::Redo => self.step_history(Session::redo),
            Command::MendHere => match self.suspect_in_focus() {
                Some(index) => self.review(SuspectAction::Flip(index)),
                None => self.at_meant_pixel(|app, pixel| app.click_at(pixel, Means::Patch)),
            },
            Command::NextSuspect => self.review(SuspectAction::Next),
            Command::PreviousSuspect => self.review(SuspectAction::Previous),
            Command::FindSuspects => self.review(SuspectAction::Look),
            Command::FlipSuspect | Command::AcceptSuspect => {
                if let Some(index) = self.suspect_in_focus() {
                    self.review(match command {
                        Command::FlipSuspect => SuspectAction::Flip(index),
                        _ => SuspectAction::Accept(index),
                    });
                }
            }
            Command::MendAlongTreeHere => self.at_meant_pixel(|app, pixel| app.click_at(pixel, Means::Tree)),
            Command::LargerPatch => self.point_tool.step(1),
            Command::SmallerPatch => self.point_tool.step(-1),
            Command::TurnWholeHere => self.at_meant_pixel(|app, pixel| app.click_at(pixel, Means::Whole)),
            Command::SelectPatchHere => self.at_meant_pixel(|app, pixel| app.click_at(pixel, Means::SelectPatch)),
            Command::SelectComponentHere => {
                self.at_meant_pixel(|app, pixel| app.click_at(pixel, Means::SelectComponent))
            }
            Command::BrushTool
            | Command::LassoTool
            | Command::RectangleTool
            | Command::PolygonTool
            | Command::PatchTool
            | Command::ComponentTool
            | Command::MendTool
            | Command::VisibleOnly
            | Command::SelectAll
            | Command::SelectNone
            | Command::InvertSelection
            | Command::GrowSelection
            | Command::ShrinkSelection
            | Command::SelectBacks
            | Command::SelectPinned
            | Command::SelectUndecided
            | Command::HideSelected
            | Command::Isolate
            | Command::ShowAll
            | Command::Flip
            | Command::SelectionFacesMe
            | Command::WhatISeeFacesMe
            | Command::Pin
            | Command::Unpin
            | Command::PropagateFrom
            | Command::PropagateInside => self.run_for_points(command),
            Command::SetPivot => self.at_meant_pixel(Self::pivot_at),
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
            Command::NextDisplayMode => self.next_coloring(true),
            Command::PreviousDisplayMode => self.next_coloring(false),
            Command::ToggleHair => self.settings.settings.display.hair ^= true,
            Command::ToggleSpheres => self.settings.settings.display.spheres ^= true,
            Command::Section => self.viewport.toggle_section(),
            Command::CompareSplit => self.toggle_compare(Style::Split),
            Command::CompareBlink => self.toggle_compare(Style::Blink),
            Command::OpenReference => self
                .dialogs
                .pick_reference(&self.ctx, self.settings.settings.folder(Purpose::Reference)),
            Command::OpenReferencePath => {
                self.windows.modal = Some(Modal::OpenPath(OpenPathWindow::new(What::Reference, None)));
            }
            Command::Columns => self.ask_columns(),
            Command::Screenshot => self.ask_picture(false),
            Command::Turntable => self.ask_picture(true),
            Command::NextWrong => self.next_wrong(true),
            Command::PreviousWrong => self.next_wrong(false),
            Command::LargerInterface => self.scale_interface(true),
            Command::SmallerInterface => self.scale_interface(false),
            Command::UsualInterface => self.settings.settings.ui_scale = 1.0,
            Command::Preferences => {
                self.windows.preferences = !self.windows.preferences;
                self.windows.preferences_view.rest();
            }
            Command::Palette => self.windows.modal = Some(Modal::Palette(PaletteWindow::default())),
            Command::ShowHints => {
                self.settings.settings.dismissed_hints.clear();
                self.settings.settings.shows_hints = true;
                self.hint_pace.restart();
            }
            Command::Shortcuts => {
                let is_open = self.windows.shortcuts.is_some();
                self.windows.shortcuts = (!is_open).then(String::new);
            }
            Command::Log => self.windows.log = !self.windows.log,
            Command::About => self.windows.about = !self.windows.about,
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
            match modal {
                Modal::Export(_) | Modal::ExportLayers(_) => self.after_export = None,
                Modal::Restore => self.decide_later(),
                _ => {}
            }
        } else if windows.close() {
        } else if self.viewport.cancel() {
            // It was something in the view.
        } else if self.suspect_in_focus().is_some() {
            self.review(SuspectAction::Leave);
        } else if let Some(work) = &self.work {
            work.cancel();
        } else {
            self.deselect_first();
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
        self.apply_edit_or_say(edit);
    }

    /// Applies an edit and shows it; returns what turned, or says why it cannot be made.
    pub(crate) fn apply_edit_or_say(&mut self, edit: Edit) -> Option<normend_core::Change> {
        let session = self.session.as_mut()?;
        match session.apply(edit) {
            Ok(change) => {
                if let Some(scene) = &mut self.scene {
                    scene.apply(&change, session);
                }
                Some(change)
            }
            Err(error) => {
                self.refuse(&error);
                None
            }
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
        // Shown once, however far it goes.
        self.step_history(|session| session.go_to_step(n_steps));
    }

    /// Orients again when the document wants other parameters than those in force, as after they were taken back.
    pub(crate) fn keep_oriented(&mut self) {
        let Some(session) = &mut self.session else { return };
        if session.document.propagation().is_none() {
            return;
        }
        let (wanted, is_due) = (session.document.parameters(), session.is_due());
        let places = &session.document.state().viewpoints;
        let scanner = &session.document.state().scanner;
        let are_new = *places != session.requested_viewpoints || *scanner != session.requested_scanner;
        match &self.work {
            None if wanted != session.requested => {}
            None if is_due && are_new => {}
            Some(Work::Propagate { is_asked: false, .. }) if are_new => {}
            // The running one is for parameters that were taken back meanwhile.
            Some(Work::Propagate {
                parameters,
                is_asked: false,
                ..
            }) if *parameters != wanted => {}
            _ => return,
        }
        (session.draft, session.requested) = (wanted, wanted);
        session.requested_viewpoints = Arc::clone(places);
        session.requested_scanner = scanner.clone();
        self.work = None;
        if is_due {
            let uploader = self.scene.as_ref().map(Scene::uploader);
            let work = Work::propagate(&self.ctx, session, wanted, false, uploader);
            self.work = Some(work);
        }
    }

    /// Leaves the document behind, after asking if it has mends that no exported file has.
    pub(crate) fn leave(&mut self, leaving: Leaving) {
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
        let files = origin.paths().iter().cloned().map(ScanOrigin::File);
        let options = files.map(|file| self.settings.settings.read_options(&file)).collect();
        self.added = None;
        self.work = Some(Work::open(&self.ctx, origin, options, self.journal_folder(), uploader));
    }

    pub(crate) fn take_work(&mut self) {
        match self.work.take() {
            None => {}
            // What is saved is of the scan that is open until then.
            Some(work @ Work::Open { .. }) if self.is_saving() => self.work = Some(work),
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
                // What the document wanted may have been undone in the last frame; as a step it would end what can be done again.
                Some(Ok(propagation)) if !is_asked && !self.is_wanted(&propagation.result) => {}
                Some(Ok(propagation)) => self.install(propagation),
                Some(Err(error)) => {
                    self.say_why("The scan was not oriented", error);
                    if let Some(session) = &mut self.session
                        && is_asked
                    {
                        session.requested = session.document.parameters();
                    }
                }
            },
            Some(Work::Pictures { job, target }) => match job.poll() {
                None => self.work = Some(Work::Pictures { job, target }),
                Some(outcome) => self.take_pictures(outcome, &target),
            },
            Some(Work::Export { job, order, revision }) => match job.poll() {
                None => {
                    self.work = Some(Work::Export { job, order, revision });
                }
                Some(Ok(())) => {
                    self.settings.settings.remember_folder(Purpose::Export, &order.path);
                    if let Some(session) = &mut self.session {
                        session.mark_saved(revision);
                        let n_points = theme::counted(session.scan.cloud.n_points() as u64, "point", "points");
                        let paths: Vec<String> = order.paths().map(|path| path.display().to_string()).collect();
                        self.messages
                            .info(format!("Exported {n_points} to {}.", paths.join(", ")));
                    }
                    if let Some(leaving) = self.after_export.take() {
                        self.leave(leaving);
                    }
                }
                Some(Err(JobError::Failed(reason))) if self.windows.modal.is_none() && self.session.is_some() => {
                    self.export_again(&order, &reason);
                }
                Some(Err(error)) => {
                    self.after_export = None;
                    self.say_why("Nothing was exported", error);
                }
            },
        }
    }

    /// Asks for the target once more after an export failed, with the same path and the reason.
    fn export_again(&mut self, order: &ExportOrder, reason: &str) {
        let name = order.words();
        let not_written = if order.further.is_empty() {
            "was not written"
        } else {
            "were not all written"
        };
        let problem = format!("{} {} {not_written}.", sentence(reason), theme::elided(&name, 48));
        self.messages.log_error(problem.clone());
        let Some(session) = &self.session else { return };
        self.windows.modal = Some(Self::export_window_after(session, order, problem));
    }

    fn say_why(&mut self, what: &str, error: JobError) {
        match error {
            JobError::Cancelled => self.messages.note(format!("{what}: cancelled.")),
            JobError::Failed(reason) => {
                self.messages.error(format!("{} {what}.", sentence(&reason)));
            }
        }
    }

    fn show_scan(&mut self, opened: Uploaded<Opened>, origin: &ScanOrigin) {
        for path in origin.paths() {
            self.settings.settings.remember_scan(path);
        }
        let Opened { scan, places, findings } = opened.result;
        let mut session = Session::new(scan, origin.name());
        for note in &places.notes {
            self.messages.note(format!("{}.", sentence(note).trim_end_matches('.')));
        }
        if let Some(words) = places.words() {
            self.messages.info(format!(
                "{}: normals face them.",
                sentence(&words).trim_end_matches('.')
            ));
        }
        session.scanner.places = places;
        self.recipe_job = None;
        let carried = self.state_to_carry(origin, &session.scan);
        let before = self.session.take();
        let is_again = (before.as_ref()).is_some_and(|before| before.identity().is_same_content(&session.identity()));
        if let Some(before) = before {
            before.finish();
        }
        self.viewport.look_at(session.document.cloud());
        self.display.show_scan(&session.scan);
        self.comparing.show_scan();
        self.clicked_revision = None;
        self.forget_what_is_under_way();
        if let Some(scene) = &mut self.scene
            && let Err(error) = scene.show_points(session.document.cloud(), opened.cloud)
        {
            self.messages
                .error(format!("The scan is open but cannot be shown: {error}."));
        }
        if session.scan.n_left_out > 0 {
            let rows = theme::counted(session.scan.n_left_out as u64, "row", "rows");
            self.messages.note(format!(
                "{rows} with a coordinate that is not finite are left out; they stay in the file."
            ));
        }
        let parameters = session.draft;
        crash::set_scan(origin.clone());
        self.session = Some(session);
        self.act(Action::Propagate(parameters));
        self.begin_journal();
        if let Some(state) = &carried {
            self.carry_on(state);
        }
        if is_again {
            // These hold the locks of those that are to be found.
            drop(findings);
            self.find_again();
        } else {
            self.take_findings(findings);
        }
        self.ask_doubtful_columns();
    }

    /// Whether a propagation is made as the document wants it now.
    fn is_wanted(&self, propagation: &Propagation) -> bool {
        self.session.as_ref().is_some_and(|session| {
            let document = &session.document;
            let has_places =
                document.state().viewpoints == propagation.viewpoints && session.has_places_of(propagation);
            document.parameters() == propagation.parameters && has_places
        })
    }

    /// Shows the open scan as another propagation of it orients it, just as a finished job does.
    pub fn show_propagation(&mut self, propagation: Propagation) {
        self.install(Uploaded {
            result: propagation,
            cloud: None,
        });
    }

    fn install(&mut self, propagation: Uploaded<Propagation>) {
        self.forget_what_is_under_way();
        let Some(session) = &mut self.session else { return };
        let Uploaded {
            result: propagation,
            cloud,
        } = propagation;
        let secs: f64 = propagation.seconds.iter().map(|(_, secs)| secs).sum();
        let is_from_one_place = propagation.found_station.is_some();
        let drops_given = session.requested.start == Start::Estimate
            && session.document.given_normals().is_some()
            && (session.document.propagation()).is_some_and(|former| former.parameters.start == Start::Keep);
        session.install(propagation);
        if let Some(scene) = &mut self.scene {
            if crash::is_loss_asked_for() {
                scene.lose_device();
            }
            self.display.points_changed();
            self.comparing.points_changed();
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
                (Start::Estimate, _) if drops_given => format!(
                    "Oriented {n_points} in {time:.1} s with normals estimated anew: those of the file are not kept. Undo brings them back."
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
