//! The side panel: a row of tabs, and one of them open.

use egui::{Button, Ui, Vec2};

use crate::theme::SPACE_XS;

/// What the side panel shows.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum SideTab {
    /// The scan, and how it is oriented.
    #[default]
    Orient,
    /// Who vouches for which point.
    Sources,
    /// What probably points to the wrong side.
    Suspects,
    /// How the scan is shown.
    View,
    /// What was done.
    History,
}

impl SideTab {
    /// All tabs, from left to right.
    pub const ALL: [Self; 5] = [Self::Orient, Self::Sources, Self::Suspects, Self::View, Self::History];

    /// The name on the tab.
    pub fn label(self) -> &'static str {
        match self {
            Self::Orient => "Orient",
            Self::Sources => "Sources",
            Self::Suspects => "Suspects",
            Self::View => "View",
            Self::History => "History",
        }
    }

    /// What the tab is for.
    pub fn tooltip(self) -> &'static str {
        match self {
            Self::Orient => "The scan, and how it is oriented",
            Self::Sources => "The points whose side is vouched for",
            Self::Suspects => "What probably points to the wrong side",
            Self::View => "How the scan is shown",
            Self::History => "What was done; click to go back",
        }
    }
}

/// The row of tabs; a click opens one.
pub fn tabs(ui: &mut Ui, open: &mut SideTab) {
    ui.horizontal(|ui| {
        ui.spacing_mut().item_spacing.x = SPACE_XS;
        // As narrow as keeps all of them in one row.
        ui.spacing_mut().button_padding.x = SPACE_XS;
        for tab in SideTab::ALL {
            let button = Button::selectable(*open == tab, tab.label()).min_size(Vec2::new(0.0, 26.0));
            if ui.add(button).on_hover_text(tab.tooltip()).clicked() {
                *open = tab;
            }
        }
    });
    ui.add_space(SPACE_XS);
    ui.separator();
    ui.add_space(SPACE_XS);
}
