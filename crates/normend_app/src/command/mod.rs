//! Every command of the editor: the one table behind menus, shortcuts, toolbar, palette and the sheet of shortcuts.

mod keys;
mod table;

use std::path::PathBuf;

use normend_core::Parameters;
use normend_render::StandardView;

use crate::coloring::Coloring;
use crate::compare::Style;

use crate::components::ComponentAction;
use crate::layers::LayerAction;
use crate::panels::export::ExportOrder;
use crate::scanner_view::ScannerAction;
use crate::settings::ThemeChoice;
use crate::source_kinds::SourceKind;
use crate::suspects_list::SuspectAction;
use crate::viewpoints::ViewpointAction;

use crate::tools::point_tool::Means;
use crate::viewport::Pixel;

pub use keys::{Keymap, MOUSE, is_modifier, shortcut_text, take_shortcuts};
pub use table::Command;

/// What a user asks for, with its data.
#[derive(Clone, Debug, PartialEq)]
pub enum Action {
    /// A command of the table.
    Run(Command),
    /// Open this scan.
    OpenScan(PathBuf),
    /// Open these files as layers of one scan.
    OpenFiles(Vec<PathBuf>),
    /// Open these files as further layers of the open scan.
    AddFiles(Vec<PathBuf>),
    /// Do something with a file of the scan.
    Layers(LayerAction),
    /// Open this recipe for the scan.
    OpenRecipe(PathBuf),
    /// Light or dark.
    Theme(ThemeChoice),
    /// Scale text and widgets by this.
    InterfaceScale(f32),
    /// Forget the recent scans.
    ClearRecent,
    /// Color the splats this way.
    Display(Coloring),
    /// Select the points whose shown value is in this range, both ends included.
    SelectValues {
        /// The range.
        range: [f64; 2],
        /// How they join the selection.
        modifiers: egui::Modifiers,
    },
    /// Compare in this way, or stop comparing when it is on in this way.
    Compare(Style),
    /// Compare with this file.
    OpenReference(PathBuf),
    /// Fly to this one of the listed wrong regions.
    ShowWrong(usize),
    /// Propagate again with these parameters; the sources stay.
    Propagate(Parameters),
    /// Take steps back, or do them again, until so many are done.
    GoToStep(usize),
    /// Select the source at this point; `extend` keeps the others.
    SelectSource {
        /// The point's id.
        point: u32,
        /// Add to or take from the selection instead of replacing it.
        extend: bool,
    },
    /// Do this with what is at a pixel of the view.
    Point {
        /// The pixel.
        pixel: Pixel,
        /// What is meant with it.
        means: Means,
    },
    /// Turn the view around what is at a pixel.
    Pivot(Pixel),
    /// Bring this point into view.
    FlyTo(u32),
    /// Turn the sources at these points.
    FlipSources(Vec<u32>),
    /// Remove the sources at these points.
    RemoveSources(Vec<u32>),
    /// Propagate again with these parameters, unless other work is in the way.
    ProposeParameters(Parameters),
    /// Show the marks of a kind of sources in the view, or not.
    ShowKind(SourceKind, bool),
    /// Drop all that is of a kind of sources.
    DropKind(SourceKind),
    /// Something about the places of the scanner.
    Scanner(ScannerAction),
    /// Something about viewpoints.
    Viewpoints(ViewpointAction),
    /// Something about components.
    Components(ComponentAction),
    /// Something about suspects.
    Suspects(SuspectAction),
    /// Ask the running job to stop.
    CancelJob,
    /// Let the user pick the target of the export with the system's dialog.
    BrowseExport,
    /// Write the oriented scan there.
    ExportTo(ExportOrder),
}

impl From<Command> for Action {
    fn from(command: Command) -> Self {
        Self::Run(command)
    }
}

/// A menu of the menu bar.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Menu {
    /// Scans in and out.
    File,
    /// The history and what runs.
    Edit,
    /// Which points and sources are meant.
    Select,
    /// What turns normals.
    Mend,
    /// The camera and the colors.
    View,
    /// The editor itself.
    Help,
}

impl Menu {
    /// All menus, from left to right.
    pub const ALL: [Self; 6] = [Self::File, Self::Edit, Self::Select, Self::Mend, Self::View, Self::Help];

    /// The name in the menu bar.
    pub fn label(self) -> &'static str {
        match self {
            Self::File => "File",
            Self::Edit => "Edit",
            Self::Select => "Select",
            Self::Mend => "Mend",
            Self::View => "View",
            Self::Help => "Help",
        }
    }

    /// Its commands, in the order of the menu.
    pub fn commands(self) -> impl Iterator<Item = Command> {
        Command::ALL
            .iter()
            .copied()
            .filter(move |command| command.menu() == self)
    }
}

impl Command {
    /// The name in the settings; it does not change when the label does.
    pub fn name(self) -> &'static str {
        self.row().name
    }

    /// The command with this [`Self::name`].
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.iter().copied().find(|command| command.name() == name)
    }

    /// The name in menus and in the sheet of shortcuts.
    pub fn label(self) -> &'static str {
        self.row().label
    }

    /// What it does, in a few words.
    pub fn tooltip(self) -> &'static str {
        self.row().tooltip
    }

    /// The menu it stands in.
    pub fn menu(self) -> Menu {
        self.row().menu
    }

    /// Which group of its menu it stands in; lines separate groups.
    pub fn group(self) -> u8 {
        self.row().group
    }

    /// The direction that a command of the view looks along.
    pub fn standard_view(self) -> Option<StandardView> {
        match self {
            Self::ViewFront => Some(StandardView::Front),
            Self::ViewBack => Some(StandardView::Back),
            Self::ViewRight => Some(StandardView::Right),
            Self::ViewLeft => Some(StandardView::Left),
            Self::ViewTop => Some(StandardView::Top),
            Self::ViewBottom => Some(StandardView::Bottom),
            Self::ViewCorner => Some(StandardView::Corner),
            _ => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;

    #[test]
    fn every_command_is_complete_and_listed_once() {
        let mut labels = BTreeSet::new();
        for &command in Command::ALL {
            assert!(!command.tooltip().is_empty(), "{command:?} has no tooltip");
            assert!(!command.label().is_empty(), "{command:?} has no label");
            assert!(
                labels.insert(command.label()),
                "{command:?} has the label of another command"
            );
            assert_eq!(Command::from_name(command.name()), Some(command));
        }
        let views: Vec<_> = Command::ALL
            .iter()
            .filter_map(|command| command.standard_view())
            .collect();
        for view in StandardView::ALL {
            assert!(views.contains(&view), "{view:?} is missing");
        }
    }

    #[test]
    fn the_table_is_in_the_order_of_the_menus() {
        let place = |command: &Command| {
            let menu = Menu::ALL.iter().position(|&menu| menu == command.menu());
            (menu.unwrap(), command.group())
        };
        assert!(Command::ALL.is_sorted_by_key(place));
        for menu in Menu::ALL {
            assert!(menu.commands().next().is_some(), "{menu:?} is empty");
        }
    }
}
