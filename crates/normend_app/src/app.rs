//! The editor's state, and what happens in a frame: take results, draw, take commands, act.

use std::path::PathBuf;
use std::sync::mpsc;

use egui::{CentralPanel, Panel, ScrollArea, Ui, UiBuilder};
use normend_core::Document;
use normend_render::{DrawSettings, SplatRenderer};

use crate::command::{Action, Command, Keymap, take_shortcuts};
use crate::compare::Comparing;
use crate::crash;
use crate::dialogs::{self, Dialogs};
use crate::layers::Added;
use crate::messages::Messages;
use crate::paint::Display;
use crate::panels::modal::Modal;
use crate::panels::proposal::Reply;
use crate::panels::side::SideTab;
use crate::panels::{
    empty, hints, history, layers, menu_bar, messages, orient, progress, proposal, side, sources, status_bar, suspects,
    tool_bar, view,
};
use crate::popup_keys;
use crate::recipes::RecipeJob;
use crate::run;
use crate::scene_sync::Scene;
use crate::selection::Selecting;
use crate::session::Session;
use crate::settings::{SettingsStore, WindowPlace};
use crate::source_kinds::SourceKind;
use crate::suspect_pictures::SuspectPictures;
use crate::suspects_list::Standing;
use crate::theme;
use crate::tools::Tool;
use crate::tools::painting::Painting;
use crate::tools::point_tool::PointTool;
use crate::verbs::Proposal;
use crate::viewport::{Pixel, Viewport};
use crate::windows::Windows;
use crate::work::{ScanOrigin, Work};

/// A step that leaves the present document behind.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Leaving {
    /// Close the editor.
    Quit,
    /// Open another scan.
    Open(ScanOrigin),
}

/// The editor.
pub struct App {
    pub(crate) ctx: egui::Context,
    pub(crate) settings: SettingsStore,
    pub(crate) scene: Option<Scene>,
    pub(crate) adapter: String,
    pub(crate) session: Option<Session>,
    pub(crate) viewport: Viewport,
    pub(crate) tool: Tool,
    pub(crate) point_tool: PointTool,
    pub(crate) painting: Painting,
    pub(crate) selecting: Selecting,
    /// Tools that draw select only what is seen; else also what is behind.
    pub(crate) visible_only: bool,
    /// In points.
    pub(crate) brush_radius: f32,
    pub(crate) proposal: Option<Proposal>,
    /// The pixel that the open menu of the view is about.
    pub(crate) menu_pixel: Option<Pixel>,
    pub(crate) display: Display,
    pub(crate) comparing: Comparing,
    pub(crate) work: Option<Work>,
    pub(crate) dialogs: Dialogs,
    pub(crate) windows: Windows,
    pub(crate) messages: Messages,
    /// What files are being added to the open scan.
    pub(crate) added: Option<Added>,
    /// What to do once the running export is written.
    pub(crate) after_export: Option<Leaving>,
    /// The recipe that is being read or written.
    pub(crate) recipe_job: Option<RecipeJob>,
    /// The next scan's newest journal is restored without asking.
    pub(crate) restores_unasked: bool,
    /// The user has decided to close the editor.
    pub(crate) quitting: bool,
    /// The revision that the last click in the view made; the second click of a double-click takes it back.
    pub(crate) clicked_revision: Option<u64>,
    pub(crate) suspect_pictures: SuspectPictures,
    /// The user stepped to a suspect, forward or back, before the list was there.
    pub(crate) steps_to_suspect: Option<bool>,
    /// The suspect whose points are outlined in the view: which list, which row.
    pub(crate) outlined_suspect: Option<(u64, usize)>,
    pub(crate) hovered: Option<Pixel>,
    pub(crate) hint_pace: hints::Pace,
    gpu_errors: mpsc::Receiver<String>,
    title: String,
    window_place: WindowPlace,
}

impl App {
    /// The editor with the user's settings; opens `scan` when one is given.
    pub fn new(cc: &eframe::CreationContext<'_>, scan: Option<PathBuf>) -> Self {
        let (settings, problem) = SettingsStore::load();
        Self::with_settings(cc, scan, settings, problem)
    }

    /// The editor with other settings than the user's. `problem` is said at the start.
    pub fn with_settings(
        cc: &eframe::CreationContext<'_>,
        scan: Option<PathBuf>,
        settings: SettingsStore,
        problem: Option<String>,
    ) -> Self {
        theme::apply(&cc.egui_ctx);
        cc.egui_ctx.set_theme(settings.settings.theme.preference());
        settings.settings.keys.clone().install(&cc.egui_ctx);
        let window_place = settings.settings.window;
        let mut messages = Messages::default();
        if let Some(problem) = problem {
            messages.error(problem);
        }
        let (sender, gpu_errors) = mpsc::channel();
        let (scene, adapter) = match &cc.wgpu_render_state {
            Some(state) => {
                let ctx = cc.egui_ctx.clone();
                state.device.set_device_lost_callback(move |_, reason| {
                    crash::set_lost(&reason);
                    ctx.request_repaint();
                });
                let ctx = cc.egui_ctx.clone();
                state.device.on_uncaptured_error(std::sync::Arc::new(move |error| {
                    // The editor may be gone; then nobody needs the message.
                    let _ = sender.send(error.to_string());
                    ctx.request_repaint();
                }));
                let info = state.adapter.get_info();
                let scene = match SplatRenderer::check_adapter(&state.adapter) {
                    Ok(()) => Some(Scene::new(state.clone())),
                    Err(error) => {
                        messages.error(format!("Scans can be opened and exported, but not shown: {error}."));
                        None
                    }
                };
                (scene, format!("{} ({})", info.name, info.backend))
            }
            None => {
                messages.error("There is no graphics adapter: scans can be opened and exported, but not shown.");
                (None, "No graphics adapter".to_owned())
            }
        };
        let mut app = Self {
            ctx: cc.egui_ctx.clone(),
            settings,
            scene,
            adapter,
            session: None,
            viewport: Viewport::new(),
            tool: Tool::default(),
            point_tool: PointTool::default(),
            painting: Painting::default(),
            selecting: Selecting::default(),
            visible_only: true,
            brush_radius: 24.0,
            proposal: None,
            menu_pixel: None,
            display: Display::default(),
            comparing: Comparing::default(),
            work: None,
            dialogs: Dialogs::new(),
            windows: Windows::default(),
            messages,
            added: None,
            after_export: None,
            recipe_job: None,
            restores_unasked: false,
            quitting: false,
            clicked_revision: None,
            suspect_pictures: SuspectPictures::default(),
            steps_to_suspect: None,
            outlined_suspect: None,
            hovered: None,
            hint_pace: hints::Pace::default(),
            gpu_errors,
            title: String::new(),
            window_place,
        };
        if let Some(path) = scan {
            app.open(ScanOrigin::File(path));
        }
        app
    }

    /// The document of the open scan.
    pub fn document(&self) -> Option<&Document> {
        self.session.as_ref().map(|session| &session.document)
    }

    /// Whether a job runs.
    pub fn is_busy(&self) -> bool {
        self.work.is_some()
    }

    /// Whether there are mends that no exported file has.
    pub fn is_unsaved(&self) -> bool {
        self.session.as_ref().is_some_and(Session::is_unsaved)
    }

    /// How many points a click at the pointer would turn; `None` when it is not on the scan or not known yet.
    pub fn n_would_turn(&self) -> Option<u64> {
        self.point_tool.n_would_turn()
    }

    /// Which of the offered patches a click at the pointer would turn, the smallest is 1, and how many are offered.
    pub fn patch_level(&self) -> Option<(usize, usize)> {
        self.point_tool.level()
    }

    /// What the pointer is for in the 3D view.
    pub fn tool(&self) -> Tool {
        self.tool
    }

    /// Whether tools that draw select only what is seen.
    pub fn selects_visible_only(&self) -> bool {
        self.visible_only
    }

    /// Whether the answer to a stroke or another wish for points is awaited.
    pub fn is_selecting(&self) -> bool {
        self.selecting.is_busy()
    }

    /// How many points the edit that is shown and waits for an answer would turn.
    pub fn n_proposed(&self) -> Option<u64> {
        self.proposal.as_ref().map(|proposal| proposal.n_points)
    }

    /// Clicks, strokes and verbs so far.
    pub fn n_interactions(&self) -> u64 {
        self.session.as_ref().map_or(0, |session| session.n_interactions)
    }

    /// Bytes uploaded to the graphics adapter so far.
    pub fn bytes_uploaded(&self) -> u64 {
        self.scene.as_ref().map_or(0, Scene::bytes_uploaded)
    }

    /// Where the 3D view is seen from.
    pub fn camera(&self) -> &normend_render::Camera {
        self.viewport.camera()
    }

    /// What is cut away in the 3D view.
    pub fn clip(&self) -> &normend_render::Clip {
        &self.viewport.clip
    }

    /// The 3D view's place in the window, in points.
    pub fn view_rect(&self) -> egui::Rect {
        self.viewport.rect
    }

    /// Reads the 3D view's picture back: width, height, and RGBA rows from the top. Blocks.
    pub fn picture(&self) -> Option<([u32; 2], Vec<u8>)> {
        self.scene.as_ref()?.read_picture()
    }

    /// Reads back which point the 3D view's picture shows at each of its pixels: width, height, and rows from the top. Blocks.
    pub fn seen_points(&self) -> Option<([u32; 2], Vec<Option<u32>>)> {
        self.scene.as_ref()?.read_points()
    }

    /// All messages of this run, oldest first.
    pub fn messages(&self) -> &Messages {
        &self.messages
    }

    pub(crate) fn draw_settings(&self, dark: bool) -> DrawSettings {
        DrawSettings {
            mode: self.display.coloring().mode(),
            palette: theme::palette(self.settings.settings.palette, dark),
            splat_scale: self.settings.settings.splat_scale,
            spheres: self.settings.settings.display.spheres,
            eye_dome: self.settings.settings.display.eye_dome,
            ..DrawSettings::default()
        }
    }

    fn take_gpu_errors(&mut self) {
        while let Ok(error) = self.gpu_errors.try_recv() {
            let first_line = error
                .lines()
                .find(|line| !line.trim().is_empty())
                .unwrap_or("no reason given")
                .trim();
            tracing::error!("{error}");
            self.messages
                .error(format!("The graphics adapter reports an error: {first_line}"));
        }
    }

    fn take_drops(&mut self) {
        let dropped: Vec<PathBuf> = self.ctx.input(|input| {
            input
                .raw
                .dropped_files
                .iter()
                .map(|file| file.path().to_path_buf())
                .collect()
        });
        if dropped.len() > 1 && self.windows.modal.is_none() {
            return self.act(Action::OpenFiles(dropped));
        }
        if let Some(path) = dropped.into_iter().next() {
            if self.windows.modal.is_some() {
                let name = ScanOrigin::File(path).name();
                self.messages
                    .note(format!("{name} was not opened: answer the open window first."));
                return;
            }
            let is_recipe = path
                .extension()
                .is_some_and(|extension| extension == normend_io::recipe::EXTENSION);
            self.act(if is_recipe {
                Action::OpenRecipe(path)
            } else {
                Action::OpenScan(path)
            });
        }
    }

    fn take_keys(&mut self) {
        let keys = &mut self.settings.settings.keys;
        if self.windows.preferences && self.windows.preferences_view.take_key(&self.ctx, keys) {
            return;
        }
        // An open menu or list has the keyboard: Escape closes it, arrows move in it.
        if egui::Popup::is_any_open(&self.ctx) {
            popup_keys::take(&self.ctx);
            return;
        }
        if popup_keys::open_focused(&self.ctx) {
            return;
        }
        if self.windows.modal.is_some() {
            self.viewport.take_keys(&self.ctx, true);
            let escape = |input: &mut egui::InputState| input.consume_key(egui::Modifiers::NONE, egui::Key::Escape);
            if self.ctx.input_mut(escape) {
                self.act(Command::Cancel.into());
            }
            return;
        }
        let typing = self.ctx.text_edit_focused();
        let focused = self.ctx.memory(|memory| memory.focused());
        let widget_focused = focused.is_some() && focused != self.viewport.id();
        self.viewport.take_keys(&self.ctx, typing);
        for command in take_shortcuts(&self.ctx, typing, widget_focused) {
            self.act(command.into());
        }
    }

    fn bars(&mut self, ui: &mut Ui) -> Option<Action> {
        let mut action = None;
        let frame = theme::panel_frame(ui.style());
        Panel::top("menus").frame(frame).show(ui, |ui| {
            let availability = |command| self.availability(command);
            action = menu_bar::menus(ui, &availability, &self.settings.settings.recent);
        });
        Panel::top("toolbar").frame(frame).show(ui, |ui| {
            let document = self.document();
            let undo = document.and_then(Document::next_undo).map(|step| step.kind().label());
            let redo = document.and_then(Document::next_redo).map(|step| step.kind().label());
            let availability = |command| self.availability(command);
            let tool = document.map(|_| self.tool);
            let tools = |ui: &mut Ui| tool_bar::ui(ui, tool, self.visible_only);
            if let Some(chosen) = menu_bar::toolbar(ui, &availability, undo, redo, tools) {
                action = Some(chosen);
            }
        });
        Panel::bottom("status").frame(frame).show(ui, |ui| {
            status_bar::ui(
                ui,
                self.session.as_ref(),
                self.point_tool.n_would_turn(),
                self.point_tool.level(),
                self.session.as_ref().map(|_| self.tool),
                self.comparing.judged(),
                &self.adapter,
            );
        });
        action
    }

    /// The side panel, in a window that has `room` points for it and the view.
    fn side_panel(&mut self, ui: &mut Ui, room: f32) -> Option<Action> {
        let blocked = self.availability(Command::Propagate).err();
        let propagating = matches!(self.work, Some(Work::Propagate { .. }));
        let session = self.session.as_mut()?;
        let settings = &mut self.settings.settings;
        let palette = theme::palette(settings.palette, ui.visuals().dark_mode);
        let (display, comparing, viewport) = (&mut self.display, &mut self.comparing, &mut self.viewport);
        let pictures = &mut self.suspect_pictures;
        let frame = egui::Frame::new()
            .fill(ui.visuals().panel_fill)
            .inner_margin(egui::Margin::symmetric(theme::SPACE_M as i8, theme::SPACE_M as i8));
        let width = side::shown_width(settings.side_width, room);
        Panel::right("side")
            .frame(frame)
            .resizable(false)
            .exact_size(width)
            .show(ui, |ui| {
                side::edge(ui, width, &mut settings.side_width);
                ScrollArea::vertical()
                    .auto_shrink([false, false])
                    .show(ui, |ui| {
                        theme::fit_side_panel(ui, width);
                        side::tabs(ui, &mut settings.side_tab);
                        match settings.side_tab {
                            SideTab::Orient => {
                                let of_layers = layers::ui(ui, session);
                                of_layers.or(orient::ui(ui, session, propagating, blocked))
                            }
                            SideTab::Sources => sources::ui(ui, session, blocked),
                            SideTab::Suspects => {
                                let list = |ui: &mut Ui| suspects::ui(ui, session, pictures);
                                theme::section_about(ui, "Suspects", suspects::ABOUT, list)
                            }
                            SideTab::View => view::ViewTab {
                                document: &session.document,
                                settings,
                                display,
                                viewport,
                                comparing,
                                palette,
                                scanner: session
                                    .has_scanner()
                                    .then(|| session.kinds.is_shown(SourceKind::Scanner)),
                            }
                            .ui(ui),
                            SideTab::History => history::ui(ui, session),
                        }
                    })
                    .inner
            })
            .inner
    }

    fn central(&mut self, ui: &mut Ui) -> Option<Action> {
        let dark = ui.visuals().dark_mode;
        let mut draw_settings = self.draw_settings(dark);
        let frame = egui::Frame::new().fill(ui.visuals().panel_fill);
        CentralPanel::no_frame()
            .frame(frame)
            .show(ui, |ui| {
                let area = ui.available_rect_before_wrap();
                let mut action = None;
                if self.session.is_some() {
                    action = self.view(ui, &mut draw_settings);
                    if let Some(session) = &self.session {
                        action = suspects::card(ui, area, &session.suspects).or(action);
                    }
                    self.scanner_marks(ui);
                    action = self.viewpoint_marks(ui).or(action);
                } else if self.work.is_none() {
                    action = empty::ui(ui, &self.settings.settings.recent, dialogs::can_drop());
                }
                self.overlays(ui, area);
                action
            })
            .inner
    }

    fn overlays(&mut self, ui: &Ui, area: egui::Rect) {
        if let Some(work) = &self.work
            && progress::ui(ui, area, &work.title(), &work.status())
        {
            work.cancel();
        }
        if !self.windows.log {
            messages::toasts(ui, area, &mut self.messages);
        }
        self.show_hint(ui, area);
        if let Some(reply) = self.n_proposed().and_then(|n_points| proposal::ui(ui, area, n_points)) {
            match reply {
                Reply::Apply => self.accept_proposal(),
                Reply::Leave => drop(self.drop_proposal()),
            }
        }
        if ui.input(|input| !input.raw.hovered_files.is_empty()) {
            let painter = ui
                .ctx()
                .layer_painter(egui::LayerId::new(egui::Order::Foreground, egui::Id::unique("drop")));
            let color = theme::accent(ui);
            painter.rect_filled(area, 0.0, ui.visuals().panel_fill.gamma_multiply(0.85));
            let frame = area.shrink(theme::SPACE_L);
            painter.rect_stroke(frame, 8.0, egui::Stroke::new(2.0, color), egui::StrokeKind::Inside);
            let font = egui::FontId::proportional(20.0);
            painter.text(area.center(), egui::Align2::CENTER_CENTER, "Drop to open", font, color);
        }
    }

    /// The hint that is due, if any; what the user has done by himself needs no hint any more.
    fn show_hint(&mut self, ui: &Ui, area: egui::Rect) {
        // The card that asks for an answer stands where the hint would, and who waits for work reads how far it is.
        if !self.settings.settings.shows_hints || self.proposal.is_some() || self.work.is_some() {
            return;
        }
        let document = self.document();
        let propagation = document.and_then(Document::propagation);
        let is_open = self.settings.settings.side_tab == SideTab::Suspects;
        let progress = hints::Progress {
            is_oriented: propagation.is_some(),
            n_steps: document.map_or(0, Document::n_done),
            has_patches: propagation.is_some_and(|propagation| propagation.patches.is_some()),
            lists_suspects: is_open && self.suspects().is_some_and(|list| list.count(Standing::Open) > 0),
            is_selecting: self.tool != Tool::default(),
            is_journaled: self.session.as_ref().is_some_and(Session::is_kept),
        };
        let dismissed = &mut self.settings.settings.dismissed_hints;
        let due = hints::due(dismissed, progress);
        let now = ui.input(|input| input.time);
        if let Some(card) = self.hint_pace.show(due, now)
            && hints::ui(ui, area, card)
        {
            dismissed.insert(card.name().to_owned());
        }
    }

    fn answer_close_request(&mut self) {
        if !self.ctx.input(|input| input.viewport().close_requested()) {
            return;
        }
        if self.closes_when_saved() {
            self.ctx.send_viewport_cmd(egui::ViewportCommand::CancelClose);
            return;
        }
        if self.quitting {
            return;
        }
        if matches!(self.work, Some(Work::Export { .. })) {
            self.ctx.send_viewport_cmd(egui::ViewportCommand::CancelClose);
            self.after_export = Some(Leaving::Quit);
            self.messages.note("The editor closes when the export is written.");
        } else if self.is_unsaved() {
            self.ctx.send_viewport_cmd(egui::ViewportCommand::CancelClose);
            // In place of another question: the window's own button comes through while one is open.
            self.after_export = None;
            self.windows.modal = Some(Modal::Unsaved(Leaving::Quit));
        }
    }

    fn keep_title(&mut self) {
        let title = match &self.session {
            Some(session) if session.is_unsaved() => format!("{}* – Normend", session.name),
            Some(session) => format!("{} – Normend", session.name),
            None => "Normend".to_owned(),
        };
        if title != self.title {
            self.ctx.send_viewport_cmd(egui::ViewportCommand::Title(title.clone()));
            self.title = title;
        }
    }

    fn save_settings(&mut self) {
        self.settings.settings.window = self.window_place;
        if let Err(problem) = self.settings.save_if_changed() {
            tracing::warn!("{problem}");
        }
    }

    fn keep_settings(&mut self) {
        self.ctx.set_theme(self.settings.settings.theme.preference());
        self.ctx.set_zoom_factor(self.settings.settings.ui_scale);
        let keys = &self.settings.settings.keys;
        if *Keymap::of(&self.ctx) != *keys {
            keys.clone().install(&self.ctx);
        }
        let pressed = self.ctx.input(|input| input.pointer.any_down());
        // Not in the middle of a drag: a slider would write the file with every step.
        if !pressed && let Err(problem) = self.settings.save_if_changed() {
            self.messages.error(problem);
        }
    }
}

impl eframe::App for App {
    fn ui(&mut self, ui: &mut Ui, _frame: &mut eframe::Frame) {
        if crash::lost().is_some() {
            // What the user set is kept; the edits are with the journal.
            self.save_settings();
            crash::leave_lost();
        }
        self.window_place = run::window_place(ui.ctx(), self.window_place);
        self.take_gpu_errors();
        self.take_dialogs();
        self.take_work();
        self.keep_journal();
        self.keep_oriented();
        self.keep_shown();
        self.keep_components();
        self.keep_scanner();
        self.keep_suspects();
        self.take_drops();
        self.take_keys();
        self.answer_close_request();
        let now = ui.input(|input| input.time);
        if let Some(secs) = self.messages.tick(now) {
            ui.request_repaint_after(std::time::Duration::from_secs_f64(secs.max(0.0)));
        }

        let mut actions = Vec::new();
        actions.extend(self.bars(ui));
        // The view is drawn before the panel beside it: Tab goes from the toolbar to the view, then to the panel.
        let area = ui.available_rect_before_wrap();
        // Widgets round their sizes; where the view and the panel leave a pixel between them, this is behind it.
        ui.painter().rect_filled(area, 0.0, ui.visuals().panel_fill);
        let mut view = area;
        if self.session.is_some() {
            view.max.x -= side::shown_width(self.settings.settings.side_width, area.width());
        }
        let mut view_ui = ui.new_child(UiBuilder::new().id_salt("view").max_rect(view));
        actions.extend(self.central(&mut view_ui));
        actions.extend(self.side_panel(ui, area.width()));
        self.show_windows(ui);
        popup_keys::note_focus(&self.ctx);
        for action in actions {
            self.act(action);
        }
        self.keep_title();
        self.keep_settings();
    }

    fn on_exit(&mut self) {
        self.save_settings();
        if let Some(session) = self.session.take() {
            session.finish();
        }
    }
}
