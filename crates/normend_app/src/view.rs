//! The 3D view in a frame: what the pointer does becomes clicks, strokes and menus, and those become edits.

use egui::{CursorIcon, Ui};
use normend_core::Document;
use normend_render::DrawSettings;

use crate::app::App;
use crate::command::{Action, Command};
use crate::panels::{context_menu, split_line};
use crate::scene_sync::Target;
use crate::theme;
use crate::tools::point_tool::Means;
use crate::tools::{Combine, Tool, ToolEvent};
use crate::viewport::{Pixel, PointerOnView};

const POINT_FIRST: &str = "Point at the scan first, or give the view the keyboard with Tab.";

impl App {
    pub(crate) fn view(&mut self, ui: &mut Ui, draw_settings: &mut DrawSettings) -> Option<Action> {
        let Some(scene) = &mut self.scene else {
            ui.centered_and_justified(|ui| ui.label("There is no graphics adapter to show the scan."));
            return None;
        };
        let under_pointer = self.point_tool.target().map(|target| target.position());
        let preferences = &self.settings.settings;
        self.viewport
            .set_preferences(preferences.navigation, preferences.reduce_motion);
        self.viewport.set_draws(self.tool.paints());
        let width = self.viewport.size_in_pixels().x;
        draw_settings.compare = self.comparing.compare(width);
        draw_settings.hair = self.settings.settings.display.hair(ui.pixels_per_point());
        let mut pointer = self.viewport.ui(ui, scene, draw_settings, under_pointer);
        split_line::ui(ui, self.viewport.rect, &mut self.comparing);
        self.settings.settings.splat_scale = draw_settings.splat_scale.clamp(
            *crate::settings::SPLAT_SCALES.start(),
            *crate::settings::SPLAT_SCALES.end(),
        );
        let action = self.menu(&mut pointer);
        self.point_tool.step(pointer.steps);
        self.draw(&pointer);
        let (Some(scene), Some(session)) = (&self.scene, &self.session) else {
            return action;
        };
        let document = &session.document;
        let means = Means::of(self.tool, pointer.modifiers);
        if pointer.clicked.is_some() {
            // Until this click has done something, there is nothing of it to take back.
            self.clicked_revision = None;
        }
        let asked = match (pointer.clicked.zip(means), pointer.pivot) {
            (_, Some(pixel)) => self.point_tool.pivot(scene, document, pixel),
            (Some((pixel, means)), None) => self.point_tool.click(scene, document, pixel, means, pointer.modifiers),
            (None, None) => None,
        };
        if pointer.by_double_click {
            self.take_back_click();
        }
        self.handle(asked);
        let (Some(scene), Some(session)) = (&mut self.scene, &self.session) else {
            return action;
        };
        let hovered = pointer.hovered;
        if self.proposal.is_some() {
            // What is proposed is highlighted, and nothing else.
            pointer.hovered = None;
        }
        let answered = self.point_tool.update(scene, session, &pointer, self.tool);
        self.handle(answered);
        self.hovered = hovered;
        self.take_answers();
        if self.point_tool.is_picking() {
            ui.request_repaint();
        }
        self.paint_pointer(ui, &pointer);
        action
    }

    /// Follows the main button for the tools that draw.
    fn draw(&mut self, pointer: &PointerOnView) {
        self.size_brush(pointer.sizing);
        let view = self.viewport.view_place();
        let strokes = self
            .painting
            .follow(self.tool, self.brush_radius, &pointer.drawn, &view);
        for stroke in strokes {
            self.take_stroke(stroke);
        }
    }

    /// What the pointer draws, and words beside it.
    fn paint_pointer(&self, ui: &Ui, pointer: &PointerOnView) {
        let view = self.viewport.view_place();
        if self.tool.paints() {
            self.painting
                .paint(ui, &view, self.tool, self.brush_radius, pointer.position);
            if pointer.position.is_some() && !ui.input(|input| input.pointer.secondary_down()) {
                ui.set_cursor_icon(CursorIcon::Crosshair);
            }
        }
        if let Some(place) = pointer.crosshair {
            self.viewport.crosshair(ui, place);
        }
        let place = pointer.position.or(pointer.crosshair);
        if let (Some(position), Some((sign, text))) = (place, self.badge(pointer)) {
            self.viewport.badge(ui, position, sign, &text);
        }
    }

    /// The menu of a right click.
    fn menu(&mut self, pointer: &mut PointerOnView) -> Option<Action> {
        let response = pointer.response.as_ref()?;
        if response.secondary_clicked()
            && let Some(position) = response.interact_pointer_pos()
        {
            self.menu_pixel = self.viewport.pixel(position);
        }
        let pixel = self.menu_pixel?;
        let mut action = None;
        let shown = egui::Popup::context_menu(response).show(|ui| {
            let target = self
                .scene
                .as_ref()
                .and_then(|scene| self.point_tool.target_at(scene, pixel));
            let place = (self.session.as_ref().zip(target.flatten()))
                .and_then(|(session, target)| session.scan.coordinates(target.point()));
            action = context_menu::ui(ui, pixel, target, place, &|command| self.availability(command));
        });
        if shown.is_none() {
            self.menu_pixel = None;
        } else if let Some(scene) = &self.scene {
            // What the menu is about stays what is known.
            pointer.hovered = Some(pixel);
            if self.point_tool.target_at(scene, pixel).is_none() {
                self.point_tool.look(scene, pixel);
            }
        }
        action
    }

    /// What a click or a stroke at the pointer would do: how it joins the selection, and words.
    fn badge(&self, pointer: &PointerOnView) -> Option<(&'static str, String)> {
        if self.selecting.is_busy() {
            return Some(("", "Selecting…".to_owned()));
        }
        let of_source = || {
            let session = self.session.as_ref()?;
            let Some(Target::Source { point, .. }) = self.point_tool.target() else {
                return None;
            };
            let source = session.document.sources().get(point)?;
            let state = if session.document.is_flipped(source) {
                "flipped"
            } else {
                "kept"
            };
            Some(format!(
                "Source at point {}, {state}",
                theme::thousands(u64::from(point))
            ))
        };
        let combine = self.painting.combine().unwrap_or(Combine::of(pointer.modifiers));
        let name = self.tool.label();
        let text = match self.tool {
            Tool::Mend => return Some(("", self.point_tool.badge().or_else(of_source)?)),
            Tool::Patch | Tool::Component => self.point_tool.badge().unwrap_or_else(|| name.to_owned()),
            _ if self.visible_only => name.to_owned(),
            _ => format!("{name}, through"),
        };
        Some((combine.sign(), text))
    }

    /// The first click of a double-click did something; the user meant the pivot.
    fn take_back_click(&mut self) {
        let revision = self.document().map(Document::revision);
        if self
            .clicked_revision
            .take()
            .is_some_and(|clicked| Some(clicked) == revision)
        {
            self.act(Command::Undo.into());
        }
    }

    pub(crate) fn handle(&mut self, event: Option<ToolEvent>) {
        match event {
            None => {}
            Some(ToolEvent::Edit(edit)) => self.click_edits(|app| app.apply_edit(edit)),
            Some(ToolEvent::Select { points, combine }) => {
                self.click_edits(|app| app.select_points(points, combine));
            }
            Some(ToolEvent::SelectSource { point, extend }) => {
                self.click_edits(|app| app.act(Action::SelectSource { point, extend }));
            }
            Some(ToolEvent::Deselect) => self.click_edits(Self::deselect),
            Some(ToolEvent::Pivot(point)) => self.viewport.set_pivot(point),
        }
    }

    /// Does what a click asks for, and remembers the edit it made for [`Self::take_back_click`]: a click that was refused or changed
    /// nothing made none, and what was done before it must stay.
    fn click_edits(&mut self, edit: impl FnOnce(&mut Self)) {
        let before = self.document().map(Document::revision);
        edit(self);
        let after = self.document().map(Document::revision);
        self.clicked_revision = after.filter(|_| after != before);
    }

    /// Does what a command says at the pixel that it means, under the pointer or at the crosshair; says how to point where there
    /// is none.
    pub(crate) fn at_meant_pixel(&mut self, act: impl FnOnce(&mut Self, Pixel)) {
        match self.hovered {
            Some(pixel) => act(self, pixel),
            None => self.messages.note(POINT_FIRST),
        }
    }

    /// A click at a pixel, for what `means` says.
    pub(crate) fn click_at(&mut self, pixel: Pixel, means: Means) {
        if let (Some(scene), Some(session)) = (&self.scene, &self.session) {
            let modifiers = egui::Modifiers::NONE;
            let event = self.point_tool.click(scene, &session.document, pixel, means, modifiers);
            self.handle(event);
        }
    }

    /// Shows the selected points, or else the selected sources, or else the whole scan.
    pub(crate) fn frame(&mut self) {
        let Some(session) = &self.session else { return };
        let (cloud, points) = (session.document.cloud(), session.document.selected());
        let place = |point: u32| cloud.positions()[point as usize];
        if !points.is_empty() {
            self.viewport.frame_some(points.len(), points.iter().map(place));
        } else if !session.selected.is_empty() {
            self.viewport.frame_points(session.selected.iter().copied().map(place));
        } else {
            self.viewport.frame_all(cloud);
        }
    }

    /// Turns the view around what is at a pixel.
    pub(crate) fn pivot_at(&mut self, pixel: Pixel) {
        if let (Some(scene), Some(session)) = (&self.scene, &self.session) {
            let event = self.point_tool.pivot(scene, &session.document, pixel);
            self.handle(event);
        }
    }
}
