//! Going through the suspects: what the editor does when the user steps to one, flips or accepts it.

use normend_render::{DisplayMode, DrawSettings};

use crate::app::App;
use crate::panels::side::SideTab;
use crate::suspect_pictures::{self, Look};
use crate::suspects_list::{Standing, SuspectAction, SuspectsList};

impl App {
    /// The suspects of the open scan.
    pub fn suspects(&self) -> Option<&SuspectsList> {
        self.session.as_ref().map(|session| &session.suspects)
    }

    /// How many small pictures of suspects are there.
    pub fn n_suspect_pictures(&self) -> usize {
        self.suspect_pictures.len()
    }

    /// Keeps the list and the pictures up to date; starts to look where that is quick or the list is in sight.
    pub(crate) fn keep_suspects(&mut self) {
        let is_in_sight = self.settings.settings.side_tab == SideTab::Suspects;
        let Some(session) = &mut self.session else { return };
        // What runs first may install another propagation.
        if self.work.is_none() {
            session.suspects.keep(
                &self.ctx,
                &session.document,
                is_in_sight || self.steps_to_suspect.is_some(),
            );
        }
        if let Some(forward) = self.steps_to_suspect
            && session.suspects.status().is_none()
        {
            self.steps_to_suspect = None;
            self.step_suspect(forward);
        }
        self.outline_suspect();
        self.keep_suspect_pictures();
    }

    fn keep_suspect_pictures(&mut self) {
        let (Some(scene), Some(session)) = (&self.scene, &self.session) else {
            return;
        };
        let dark = self.ctx.theme() == egui::Theme::Dark;
        let scale = self.ctx.pixels_per_point();
        let pixels = (suspect_pictures::SIZE * scale).ceil();
        let look = Look {
            generation: session.suspects.generation(),
            dark,
            pixels: [pixels.x as u32, pixels.y as u32],
        };
        let settings = DrawSettings {
            mode: DisplayMode::Facing,
            spheres: false,
            ..self.draw_settings(dark)
        };
        let mut camera = *self.viewport.camera();
        self.suspect_pictures.keep(&self.ctx, look, |index| {
            let row = session.suspects.row(index)?;
            if let Some(direction) = row.right_side() {
                camera.look_from(direction);
            }
            camera.frame_points(row.close_frame(), pixels.x / pixels.y);
            let maker = scene.picture_maker(&camera, look.pixels, scale, &settings);
            Some(maker.with_highlight(row.outline().ranges()))
        });
    }

    /// Outlines the suspect in focus, in the view.
    fn outline_suspect(&mut self) {
        let (Some(scene), Some(session)) = (&mut self.scene, &self.session) else {
            return;
        };
        let focus = session.suspects.focus();
        let key = focus.map(|index| (session.suspects.generation(), index));
        if key != self.outlined_suspect {
            self.outlined_suspect = key;
            let row = focus.and_then(|index| session.suspects.row(index));
            scene.outline(row.map(|row| row.outline().clone()));
        }
    }

    /// Does what is asked for about suspects.
    pub(crate) fn review(&mut self, action: SuspectAction) {
        match action {
            SuspectAction::Look => {
                if let Some(session) = &mut self.session {
                    session.suspects.look(&self.ctx, &session.document);
                }
            }
            SuspectAction::Stop => {
                self.steps_to_suspect = None;
                if let Some(session) = &self.session {
                    session.suspects.stop();
                }
            }
            SuspectAction::Next => self.step_suspect(true),
            SuspectAction::Previous => self.step_suspect(false),
            SuspectAction::Focus(index) => self.focus_suspect(index),
            SuspectAction::Flip(index) => {
                let edit = self.session.as_ref().and_then(|session| session.suspects.flip(index));
                self.settle_suspect(index, edit);
            }
            SuspectAction::Accept(index) => {
                let accept =
                    |session: &crate::session::Session| session.suspects.accept(&session.document, index, true);
                let edit = self.session.as_ref().and_then(accept);
                self.settle_suspect(index, edit);
            }
            SuspectAction::TakeBack(index) => {
                let edit = (self.session.as_ref())
                    .and_then(|session| session.suspects.accept(&session.document, index, false));
                if let Some(edit) = edit {
                    self.apply_edit(edit);
                }
            }
            SuspectAction::Leave => {
                if let Some(session) = &mut self.session {
                    session.suspects.set_focus(None);
                }
            }
        }
    }

    /// The suspect in focus, which the keys for suspects mean.
    pub(crate) fn suspect_in_focus(&self) -> Option<usize> {
        self.session.as_ref()?.suspects.focus()
    }

    /// Makes the edit that settles a suspect, and goes on to the next.
    fn settle_suspect(&mut self, index: usize, edit: Option<normend_core::Edit>) {
        let Some(edit) = edit else { return };
        let Some(before) = self.document().map(normend_core::Document::signs_revision) else {
            return;
        };
        self.apply_edit(edit);
        let Some(session) = &mut self.session else { return };
        session.suspects.follow_flip(before, &session.document);
        session.suspects.follow(&session.document);
        let is_settled = session
            .suspects
            .rows()
            .nth(index)
            .is_some_and(|(_, standing)| standing != Standing::Open);
        if !is_settled {
            return;
        }
        session.suspects.set_focus(Some(index));
        match session.suspects.neighbor(true) {
            Some(next) => self.focus_suspect(next),
            None => self
                .messages
                .info("That was the last suspect. Look again to see what follows."),
        }
    }

    fn step_suspect(&mut self, forward: bool) {
        let Some(session) = &mut self.session else { return };
        let list = &mut session.suspects;
        list.follow(&session.document);
        // A list of another state says nothing; nor does one that is all settled by now.
        let is_spent =
            list.is_stale(&session.document) || (list.is_old(&session.document) && list.neighbor(forward).is_none());
        if !list.is_known() || is_spent {
            if let Some(Some(reason)) = list.stopped() {
                self.messages.error(format!("{reason} No suspects were looked for."));
                return;
            }
            // It goes there as soon as the list is there.
            self.steps_to_suspect = Some(forward);
            if list.status().is_none() {
                list.look(&self.ctx, &session.document);
            }
            return;
        }
        match list.neighbor(forward) {
            Some(index) => self.focus_suspect(index),
            None => self.messages.note("Nothing is suspected; the tab Suspects says why."),
        }
    }

    fn focus_suspect(&mut self, index: usize) {
        let Some(session) = &mut self.session else { return };
        session.suspects.set_focus(Some(index));
        let Some(row) = session.suspects.row(index) else { return };
        let (middle, direction, frame) = (row.middle(), row.right_side(), row.frame());
        self.viewport.fly_to(middle, 0.0, direction);
        self.viewport.frame_points(frame);
    }
}
