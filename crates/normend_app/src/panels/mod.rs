//! The parts of the window, one file each. They show state and return what the user asks for.

use crate::command::Command;

pub mod about;
pub mod columns;
pub mod compare;
pub mod components;
pub mod context_menu;
pub mod empty;
pub mod export;
pub mod export_layers;
pub mod hints;
pub mod history;
pub mod layers;
pub mod menu_bar;
pub mod messages;
pub(crate) mod modal;
pub mod navigation;
pub mod open_path;
pub mod orient;
pub mod palette;
pub mod preferences;
pub mod progress;
pub mod proposal;
pub mod restore;
pub mod scanner;
pub(crate) mod screenshot;
pub mod shortcuts;
pub mod side;
pub mod sources;
pub mod split_line;
pub mod status_bar;
pub mod suspects;
pub mod tool_bar;
pub mod unsaved;
pub mod values;
pub mod view;
pub mod viewpoints;
pub mod votes;

/// Says whether a command can be run now, and if not, why.
pub type Availability<'a> = dyn Fn(Command) -> Result<(), &'static str> + 'a;
