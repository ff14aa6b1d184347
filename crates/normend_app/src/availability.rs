//! Which commands can be run now, and why the others cannot.

use normend_core::Document;
use normend_io::FileFormat;

use crate::app::App;
use crate::command::Command;
use crate::compare::NONE_WRONG;
use crate::session::Session;
use crate::work::Work;

impl App {
    /// Says whether `command` can be run now, and if not, why.
    pub fn availability(&self, command: Command) -> Result<(), &'static str> {
        let exporting = matches!(self.work, Some(Work::Export { .. }));
        let document = self.document();
        let is_oriented = document.is_some_and(|document| document.orientation().is_some());
        let n_selected = self.session.as_ref().map_or(0, |session| session.selected.len());
        let check = |holds: bool, reason| if holds { Ok(()) } else { Err(reason) };
        match command {
            Command::Open | Command::OpenPath | Command::OpenSample => check(!exporting, "an export is being written"),
            Command::AddFiles => {
                check(document.is_some(), "no scan is open")?;
                check(self.work.is_none(), "wait for the running work, or cancel it")?;
                let layers = self.session.as_ref().map_or(&[][..], |session| session.scan.layers());
                let are_files = layers.iter().all(|layer| layer.path().is_some());
                check(are_files, "the sample is no file: open a scan of yours first")
            }
            Command::Columns => {
                check(document.is_some(), "no scan is open")?;
                check(!exporting, "an export is being written")?;
                let is_text = (self.session.as_ref()).is_some_and(|session| session.scan.format() == FileFormat::Xyz);
                check(is_text, "the open scan is no text: its format says what is what")
            }
            Command::Export => {
                check(document.is_some(), "no scan is open")?;
                check(self.work.is_none(), "wait for the running work, or cancel it")?;
                check(is_oriented, "the scan is not oriented yet")?;
                let is_due = self.session.as_ref().is_some_and(Session::is_due);
                check(
                    !is_due,
                    "the normals are not those of the present parameters: press Propagate, or undo",
                )
            }
            Command::OpenRecipe | Command::OpenRecipePath | Command::SaveRecipe => {
                check(document.is_some(), "no scan is open")?;
                check(!exporting, "an export is being written")?;
                check(self.recipe_job.is_none(), "another recipe is being read or written")
            }
            Command::Propagate => {
                check(document.is_some(), "no scan is open")?;
                check(!exporting, "an export is being written")?;
                check(
                    !matches!(self.work, Some(Work::Open { .. })),
                    "another scan is being opened",
                )
            }
            Command::Undo => check(
                document.and_then(Document::next_undo).is_some(),
                "there is nothing to undo",
            ),
            Command::Redo => check(
                document.and_then(Document::next_redo).is_some(),
                "there is nothing to redo",
            ),
            Command::MendHere | Command::MendAlongTreeHere | Command::TurnWholeHere => {
                check(is_oriented, "the scan is not oriented yet")
            }
            Command::NextSuspect | Command::PreviousSuspect | Command::FindSuspects => {
                check(is_oriented, "the scan is not oriented yet")
            }
            Command::FlipSuspect | Command::AcceptSuspect => check(
                self.suspect_in_focus().is_some(),
                "no suspect is shown; step to one first",
            ),
            Command::LargerPatch | Command::SmallerPatch => {
                check(is_oriented, "the scan is not oriented yet")?;
                let propagation = document.and_then(Document::propagation);
                check(
                    propagation.is_some_and(|propagation| propagation.patches.is_some()),
                    "there are no patches: choose Estimate and the preset Automatic, then Propagate",
                )
            }
            Command::SelectAllSources => check(
                document.is_some_and(|document| !document.sources().is_empty()),
                "there are no sources",
            ),
            Command::FlipSources | Command::RemoveSources => check(n_selected > 0, "no source is selected"),
            Command::Frame
            | Command::FrameAll
            | Command::SetPivot
            | Command::ViewFront
            | Command::ViewBack
            | Command::ViewRight
            | Command::ViewLeft
            | Command::ViewTop
            | Command::ViewBottom
            | Command::ViewCorner
            | Command::ToggleOrthographic
            | Command::ZoomIn
            | Command::ZoomOut
            | Command::OrbitLeft
            | Command::OrbitRight
            | Command::OrbitUp
            | Command::OrbitDown
            | Command::PanLeft
            | Command::PanRight
            | Command::PanUp
            | Command::PanDown
            | Command::Fly
            | Command::ClipBox
            | Command::CutDeeper
            | Command::CutLess
            | Command::LargerSplats
            | Command::SmallerSplats
            | Command::NextDisplayMode
            | Command::PreviousDisplayMode
            | Command::ToggleHair
            | Command::ToggleSpheres
            | Command::Section => check(document.is_some(), "no scan is open"),
            Command::CompareSplit | Command::CompareBlink | Command::OpenReference | Command::OpenReferencePath => {
                check(is_oriented, "the scan is not oriented yet")
            }
            Command::Screenshot | Command::Turntable => {
                check(document.is_some(), "no scan is open")?;
                check(self.scene.is_some(), "there is no graphics adapter")?;
                check(self.work.is_none(), "wait for the running work, or cancel it")
            }
            Command::NextWrong | Command::PreviousWrong => {
                check(
                    self.comparing.reference().is_some(),
                    "open a reference first (File, Compare with reference)",
                )?;
                let live = self.comparing.judged();
                check(live.is_none_or(|live| live.n_wrong() > 0), NONE_WRONG)
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
            | Command::SelectPatchHere
            | Command::SelectComponentHere
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
            | Command::PropagateInside => self.availability_for_points(command),
            Command::ShowHints => check(
                !self.settings.settings.dismissed_hints.is_empty(),
                "no hint was dismissed yet",
            ),
            Command::Quit
            | Command::Cancel
            | Command::LargerInterface
            | Command::SmallerInterface
            | Command::UsualInterface
            | Command::Preferences
            | Command::Palette
            | Command::Shortcuts
            | Command::Log
            | Command::About => Ok(()),
        }
    }
}
