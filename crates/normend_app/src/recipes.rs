//! What the editor does with journals and recipes: offers, restoring, saving, opening.
//!
//! Here the answers of windows and jobs meet the session; the format is [`normend_io::recipe`], the file of edits as they happen
//! [`crate::journal`].

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;

use egui::Ui;
use normend_io::io_words;
use normend_io::recipe::{self, End, Recipe};

use crate::app::App;
use crate::command::{Action, Command};
use crate::crash::{self, Edits};
use crate::job::{Job, JobError};
use crate::journal::found::{self, Findings, Offer};
use crate::journal::{News, RETRY_DELAY};
use crate::panels::export::{self, ExportWindow};
use crate::panels::modal::Modal;
use crate::panels::restore;
use crate::settings::Purpose;
use crate::theme;
use crate::work::{ScanOrigin, Work};

/// How long an editor that restores without asking waits for the one before it to end.
const PATIENCE: Duration = Duration::from_secs(5);

/// Where journals are looked for when a scan is opened, and how patiently.
#[derive(Clone, Debug)]
pub(crate) struct JournalFolder {
    pub(crate) path: PathBuf,
    pub(crate) patience: Duration,
}

/// Recipes and journals that are being read or written; one at a time.
pub(crate) enum RecipeJob {
    /// The journals of a scan that is opened in place of one with the same content, which held its own until then.
    Find(Job<Findings>),
    Open {
        job: Job<Recipe>,
        path: PathBuf,
    },
    Save {
        job: Job<()>,
        path: PathBuf,
        /// The journal that it is written from, in place of the present state.
        offer: Option<Box<Offer>>,
        /// The user closed the editor meanwhile.
        closes: bool,
    },
}

impl App {
    /// Opens a scan as the editor starts. Where `restores`, the newest journal of it is restored without asking.
    pub fn open_at_start(&mut self, scan: ScanOrigin, restores: bool) {
        self.restores_unasked = restores;
        self.open(scan);
    }

    /// Where the next scan's journals are.
    pub(crate) fn journal_folder(&self) -> Option<JournalFolder> {
        Some(JournalFolder {
            path: self.settings.journals_folder()?,
            patience: if self.restores_unasked {
                PATIENCE
            } else {
                Duration::ZERO
            },
        })
    }

    /// Begins to keep a journal of the scan that was just opened.
    pub(crate) fn begin_journal(&mut self) {
        if let (Some(session), Some(folder)) = (&mut self.session, self.settings.journals_folder()) {
            session.keep_journal(&folder);
        }
    }

    /// Offers the journals of the open scan that were found.
    pub(crate) fn take_findings(&mut self, findings: Findings) {
        let Some(session) = &mut self.session else { return };
        for problem in findings.problems {
            self.messages.error(problem);
        }
        // Not the journal of the scan that this editor had open until now.
        if findings.held.iter().any(|path| found::is_held(path)) {
            self.messages.note(
                "Another editor has edits of this scan: each exports only its own, so export to different files.",
            );
        }
        session.offers = findings.offers.into();
        let is_same = session.offers.front().is_some_and(|offer| offer.is_same);
        if std::mem::take(&mut self.restores_unasked) && is_same {
            self.restore_first();
            // Others are offered when the scan is opened once more.
            self.decide_later();
        }
    }

    /// In each frame: says what the journal says, asks what was found, takes what became of a recipe.
    pub(crate) fn keep_journal(&mut self) {
        let journal = self.session.as_mut().and_then(|session| session.journal.as_mut());
        if let Some(journal) = journal {
            match journal.news() {
                None => {}
                Some(News::Works) => self.messages.info("Edits are being journaled again, the ones before too."),
                Some(News::Failing(reason)) => self.messages.error(format!(
                    "Edits are not being journaled: {reason}. Editing goes on, and it is tried again; export or save a recipe to be sure."
                )),
            }
            if !journal.is_kept() {
                self.ctx.request_repaint_after(RETRY_DELAY);
            }
        }
        crash::set_edits(match &self.session {
            Some(session) if session.is_unsaved() => {
                if session.is_kept() {
                    Edits::Kept
                } else {
                    Edits::Lost
                }
            }
            _ => Edits::None,
        });
        self.offer_journals();
        self.take_recipe_job();
    }

    /// Asks what becomes of the journals that were found, unless there are edits already that they would be mixed with.
    fn offer_journals(&mut self) {
        let Some(session) = self.session.as_ref().filter(|session| !session.offers.is_empty()) else {
            return;
        };
        let is_asked = matches!(self.windows.modal, Some(Modal::Restore));
        if !is_asked && (self.windows.modal.is_some() || self.recipe_job.is_some()) {
            return;
        }
        let is_new = session.document.steps().next().is_none();
        self.windows.modal = is_new.then_some(Modal::Restore);
        if !is_new {
            self.decide_later();
            self.messages
                .note("There are edits of before, but this scan has new ones already: open it again to restore those.");
        }
    }

    /// Lets go of the journals that are offered; they are offered again when the scan is opened the next time.
    pub(crate) fn decide_later(&mut self) {
        if let Some(session) = &mut self.session {
            session.offers.clear();
        }
    }

    /// Asks what becomes of the first journal that is offered.
    pub(crate) fn ask_offer(&mut self, ui: &Ui) {
        let Some(session) = &self.session else { return };
        let Some(offer) = session.offers.front() else { return };
        let n_more = session.offers.len() - 1;
        match restore::ui(ui, &session.name, session.scan.cloud.n_points(), offer, n_more) {
            restore::Decision::Wait => self.windows.modal = Some(Modal::Restore),
            restore::Decision::Later => self.decide_later(),
            restore::Decision::Other => {
                if let Some(session) = &mut self.session {
                    session.offers.rotate_left(1);
                }
                self.windows.modal = Some(Modal::Restore);
            }
            restore::Decision::Restore => {
                self.restore_first();
                self.decide_later();
            }
            restore::Decision::Remove => {
                let offer = self.session.as_mut().and_then(|session| session.offers.pop_front());
                if let Some(Err(error)) = offer.map(Offer::remove) {
                    self.messages
                        .error(format!("The journal was not removed: {}.", io_words(&error)));
                }
            }
            restore::Decision::Keep => {
                let suggested = session.suggested_recipe(self.settings.settings.folder(Purpose::Recipe));
                let suggested = suggested.with_extension(format!("before.{}", recipe::EXTENSION));
                self.show_save_window(&suggested, true);
            }
        }
    }

    /// Restores the first journal that is offered.
    fn restore_first(&mut self) {
        let Some(session) = &mut self.session else { return };
        let Some(offer) = session.offers.pop_front() else {
            return;
        };
        let n_edits = theme::counted(offer.n_edits() as u64, "edit", "edits");
        let damage = offer.damage().map(|damage| {
            let copy = match offer.keep_damaged() {
                Ok(copy) => format!("The damaged file is kept as {}", copy.display()),
                Err(error) => format!("The damaged file could not be kept beside it ({error})"),
            };
            format!("The journal was damaged, and what came after that is not restored: {damage}. {copy}.")
        });
        match session.restore(offer) {
            Ok(()) => self.messages.info(format!("Restored {n_edits}.")),
            Err(error) => self.messages.error(format!(
                "The edits were not restored: {error}. Their journal stays as it is."
            )),
        }
        if let Some(damage) = damage {
            self.messages.error(damage);
        }
        if let (Some(scene), Some(session)) = (&mut self.scene, &mut self.session) {
            scene.show_state(session);
        }
        self.orient_as_wanted();
    }

    /// Orients the document with the parameters that it wants after its state was changed as a whole.
    pub(crate) fn orient_as_wanted(&mut self) {
        let Some(session) = &mut self.session else { return };
        let wanted = session.document.parameters();
        session.draft = wanted;
        let is_on_its_way = match &self.work {
            Some(Work::Propagate { parameters, .. }) => *parameters == wanted,
            _ => session
                .document
                .propagation()
                .is_some_and(|propagation| propagation.parameters == wanted),
        };
        if !is_on_its_way && !matches!(self.work, Some(Work::Export { .. })) {
            self.act(Action::Propagate(wanted));
        }
    }

    /// Asks where the recipe goes.
    pub(crate) fn ask_recipe_target(&mut self) {
        if let Some(session) = &self.session {
            let suggested = session.suggested_recipe(self.settings.settings.folder(Purpose::Recipe));
            self.show_save_window(&suggested, false);
        }
    }

    fn show_save_window(&mut self, suggested: &Path, of_offer: bool) {
        let input = self.session.as_ref().and_then(|session| session.scan.path().cloned());
        let window = ExportWindow::for_recipe(suggested, input);
        self.windows.modal = Some(Modal::SaveRecipe { window, of_offer });
    }

    /// Shows the window that asks where a recipe goes.
    pub(crate) fn ask_save(&mut self, ui: &Ui, mut window: ExportWindow, of_offer: bool) {
        match window.ui(ui) {
            export::Decision::Wait => self.windows.modal = Some(Modal::SaveRecipe { window, of_offer }),
            // A journal that is offered is asked about again.
            export::Decision::Close => {}
            export::Decision::Browse => {
                self.dialogs.pick_recipe_target(&self.ctx, Path::new(window.path()));
                self.windows.modal = Some(Modal::SaveRecipe { window, of_offer });
            }
            export::Decision::Export(order) => self.save_recipe(&order.path, of_offer),
        }
    }

    /// Starts to write the present state as a recipe, or the first journal that is offered.
    pub(crate) fn save_recipe(&mut self, path: &Path, of_offer: bool) {
        let Some(session) = self.session.as_mut().filter(|_| self.recipe_job.is_none()) else {
            return;
        };
        let path = std::path::absolute(path).unwrap_or_else(|_| path.to_path_buf());
        let offer = if of_offer { session.offers.pop_front() } else { None };
        if of_offer && offer.is_none() {
            return;
        }
        let offer = offer.map(Box::new);
        let recipe = match &offer {
            Some(offer) => offer.reading.recipe.clone(),
            None => Recipe::of_document(session.identity(), &session.document),
        };
        let target = path.clone();
        let job = Job::start(&self.ctx, "recipe", "Writing the recipe", move |_| {
            recipe
                .write(&target)
                .map_err(|error| JobError::Failed(error.to_string()))
        });
        self.recipe_job = Some(RecipeJob::Save {
            job,
            path,
            offer,
            closes: false,
        });
    }

    /// Whether a recipe is being written, which closing and opening wait for.
    pub(crate) fn is_saving(&self) -> bool {
        matches!(self.recipe_job, Some(RecipeJob::Save { .. }))
    }

    /// Where a recipe is being written, closes the editor only after that; says whether that is so.
    pub(crate) fn closes_when_saved(&mut self) -> bool {
        let Some(RecipeJob::Save { closes, .. }) = &mut self.recipe_job else {
            return false;
        };
        *closes = true;
        self.messages.note("The editor closes when the recipe is written.");
        true
    }

    /// Starts to read a recipe for the open scan.
    pub(crate) fn open_recipe(&mut self, path: &Path) {
        if self.session.is_none() {
            self.messages
                .error("The recipe was not opened: open its scan first, then the recipe.");
            return;
        }
        if let Err(reason) = self.availability(Command::OpenRecipe) {
            self.messages.error(format!("The recipe was not opened: {reason}."));
            return;
        }
        let path = std::path::absolute(path).unwrap_or_else(|_| path.to_path_buf());
        let target = path.clone();
        let job = Job::start(&self.ctx, "recipe", "Reading the recipe", move |_| {
            let reading = recipe::read(&target).map_err(|error| JobError::Failed(error.to_string()))?;
            match reading.end {
                End::Whole => Ok(reading.recipe),
                // What a journal or an interrupted copy lacks is a part of a line; all before it is sure.
                End::CutOff if !reading.recipe.events.is_empty() => Ok(reading.recipe),
                End::CutOff => Err(JobError::Failed(format!("{} is cut off", target.display()))),
                End::Damaged(broken) => Err(JobError::Failed(format!("{}, {broken}", target.display()))),
            }
        });
        self.recipe_job = Some(RecipeJob::Open { job, path });
    }

    fn take_recipe_job(&mut self) {
        let was_saving = self.is_saving();
        self.take_recipe_outcome();
        if was_saving && !self.is_saving() {
            // A scan that was read meanwhile is waiting.
            self.ctx.request_repaint();
        }
    }

    fn take_recipe_outcome(&mut self) {
        match self.recipe_job.take() {
            None => {}
            Some(RecipeJob::Open { job, path }) => match job.poll() {
                None => self.recipe_job = Some(RecipeJob::Open { job, path }),
                Some(Ok(recipe)) => {
                    self.settings.settings.remember_folder(Purpose::Recipe, &path);
                    self.judge_recipe(recipe, &ScanOrigin::File(path).name());
                }
                Some(Err(JobError::Failed(reason))) => {
                    self.messages.error(format!("The recipe was not opened. {reason}."));
                }
                Some(Err(JobError::Cancelled)) => self.messages.note("The recipe was not opened: cancelled."),
            },
            Some(RecipeJob::Find(job)) => match job.poll() {
                None => self.recipe_job = Some(RecipeJob::Find(job)),
                Some(Ok(findings)) => self.take_findings(findings),
                Some(Err(JobError::Failed(reason))) => {
                    self.messages
                        .error(format!("Edits of before were not looked for. {reason}"));
                }
                Some(Err(JobError::Cancelled)) => {}
            },
            Some(RecipeJob::Save {
                job,
                path,
                offer,
                closes,
            }) => match job.poll() {
                None => {
                    self.recipe_job = Some(RecipeJob::Save {
                        job,
                        path,
                        offer,
                        closes,
                    });
                }
                Some(Ok(())) => {
                    self.settings.settings.remember_folder(Purpose::Recipe, &path);
                    self.messages.info(format!("Saved the recipe to {}.", path.display()));
                    // It is kept under its own name now.
                    if let Some(Err(error)) = offer.map(|offer| offer.remove()) {
                        self.messages
                            .error(format!("The journal was not removed: {}.", io_words(&error)));
                    }
                    if closes {
                        self.ctx.send_viewport_cmd(egui::ViewportCommand::Close);
                    }
                }
                Some(Err(error)) => {
                    // The user hears of it, and decides once more.
                    self.quitting = false;
                    let reason = match error {
                        JobError::Failed(reason) => reason,
                        JobError::Cancelled => "cancelled".to_owned(),
                    };
                    self.messages.error(format!("The recipe was not saved. {reason}."));
                    if let (Some(session), Some(offer)) = (&mut self.session, offer) {
                        session.offers.push_front(*offer);
                    }
                }
            },
        }
    }

    /// Takes a recipe of this very scan, asks about one of another content, refuses one of another number of points.
    fn judge_recipe(&mut self, recipe: Recipe, name: &str) {
        let Some(session) = &self.session else { return };
        let (of, here) = (&recipe.head.scan, session.identity());
        if of.is_same_content(&here) {
            self.apply_recipe(&recipe, name);
        } else if of.n_points == here.n_points {
            self.windows.modal = Some(Modal::OtherScan {
                recipe: Arc::new(recipe),
                name: name.to_owned(),
            });
        } else {
            self.messages.error(format!(
                "{name} was not applied: it is of {} with {}, and this scan has {}. Open the scan that it was made for.",
                of.name,
                theme::counted(of.n_points, "point", "points"),
                theme::thousands(here.n_points)
            ));
        }
    }

    /// Asks whether a recipe of another content is meant.
    pub(crate) fn ask_other_scan(&mut self, ui: &Ui, recipe: Arc<Recipe>, name: String) {
        let here = self.session.as_ref().map_or("this scan", |session| &session.name);
        match restore::other_scan_ui(ui, &name, &recipe.head.scan, here) {
            None => self.windows.modal = Some(Modal::OtherScan { recipe, name }),
            Some(true) => self.apply_recipe(&recipe, &name),
            Some(false) => {}
        }
    }

    fn apply_recipe(&mut self, recipe: &Recipe, name: &str) {
        let Some(session) = &mut self.session else { return };
        match session.take_recipe(recipe) {
            Ok(change) => {
                self.messages.info(format!("Applied {name}; one undo takes it back."));
                if let Some(scene) = &mut self.scene {
                    scene.apply(&change, session);
                }
                self.orient_as_wanted();
            }
            Err(error) => self.messages.error(format!("{name} was not applied: {error}.")),
        }
    }

    /// Starts to look for the journals of the open scan, which is opened in place of one with the same content.
    pub(crate) fn find_again(&mut self) {
        let (Some(session), Some(folder)) = (&self.session, self.settings.journals_folder()) else {
            return;
        };
        let identity = session.identity();
        let job = Job::start(&self.ctx, "journals", "Looking for journals", move |_| {
            Ok(found::find(&folder, &identity, Duration::ZERO))
        });
        self.recipe_job = Some(RecipeJob::Find(job));
    }
}

#[cfg(test)]
mod tests {
    use std::sync::mpsc;

    use egui::{ViewportCommand, ViewportEvent, ViewportId};
    use egui_kittest::Harness;

    use super::*;
    use crate::settings::SettingsStore;

    /// The window's commands in the next frame, in which the desktop asks it to close or not.
    fn commands(harness: &mut Harness<'_, App>, closes: bool) -> Vec<ViewportCommand> {
        if closes {
            let window = harness.input_mut().viewports.entry(ViewportId::ROOT).or_default();
            window.events.push(ViewportEvent::Close);
        }
        harness.step();
        if let Some(window) = harness.input_mut().viewports.get_mut(&ViewportId::ROOT) {
            window.events.clear();
        }
        harness.output().viewport_output[&ViewportId::ROOT].commands.clone()
    }

    /// Begins to write a recipe, which ends as it is told to.
    fn save(harness: &mut Harness<'_, App>) -> mpsc::Sender<Result<(), JobError>> {
        let (end, told) = mpsc::channel();
        let app = harness.state_mut();
        let job = Job::start(&app.ctx, "recipe", "Writing the recipe", move |_| told.recv().unwrap());
        app.recipe_job = Some(RecipeJob::Save {
            job,
            path: PathBuf::from("a.normend"),
            offer: None,
            closes: false,
        });
        end
    }

    fn wait(harness: &mut Harness<'_, App>, what: &str, holds: impl Fn(&App, &[ViewportCommand]) -> bool) {
        for _ in 0..6000 {
            let commands = commands(harness, false);
            if holds(harness.state(), &commands) {
                return;
            }
            std::thread::sleep(Duration::from_millis(5));
        }
        panic!("never came: {what}");
    }

    #[test]
    fn closing_and_opening_wait_until_a_recipe_is_written() {
        let folder = tempfile::tempdir().unwrap();
        let (settings, problem) = SettingsStore::load_from(folder.path());
        let mut harness = Harness::builder().build_eframe(move |cc| App::with_settings(cc, None, settings, problem));

        let end = save(&mut harness);
        assert!(commands(&mut harness, true).contains(&ViewportCommand::CancelClose));
        end.send(Err(JobError::Failed("The disk is full".to_owned()))).unwrap();
        wait(&mut harness, "the failure", |app, commands| {
            assert!(
                !commands.contains(&ViewportCommand::Close),
                "the user decides once more"
            );
            let words = "The recipe was not saved. The disk is full.";
            app.messages.entries().iter().any(|entry| entry.text == words)
        });

        let end = save(&mut harness);
        assert!(commands(&mut harness, true).contains(&ViewportCommand::CancelClose));
        end.send(Ok(())).unwrap();
        wait(&mut harness, "the end", |_, commands| {
            commands.contains(&ViewportCommand::Close)
        });
        assert!(!commands(&mut harness, true).contains(&ViewportCommand::CancelClose));

        let end = save(&mut harness);
        harness.state_mut().open(ScanOrigin::Sample);
        for _ in 0..100 {
            harness.step();
            std::thread::sleep(Duration::from_millis(5));
            assert!(harness.state().session.is_none(), "the recipe is of what is open now");
        }
        end.send(Ok(())).unwrap();
        wait(&mut harness, "the scan", |app, _| app.session.is_some());
    }
}
