//! The Normend editor: the only place where orientation, files and graphics meet.
//!
//! A frame is: take results of jobs, draw, take commands, act ([`app`]). Long work runs in jobs and never in a frame.
//! The document changes only through its edits; [`scene_sync`] alone tells the renderer what turned.
//!
//! Not here: how normals are oriented, how files are read, how splats are drawn.

mod actions;
pub mod app;
mod availability;
pub mod coloring;
pub mod command;
pub mod compare;
pub mod components;
pub mod crash;
mod dialogs;
pub mod folders;
pub mod job;
pub mod journal;
mod layers;
pub mod messages;
mod pace;
pub mod paint;
pub mod panels;
mod picture_job;
mod point_ranges;
mod popup_keys;
mod recipes;
mod review;
mod run;
pub mod scalars;
pub mod scanner_view;
pub mod scene_sync;
pub mod selection;
pub mod session;
pub mod settings;
pub mod source_kinds;
mod source_spheres;
mod suspect_pictures;
pub mod suspects_list;
mod text_columns;
pub mod theme;
pub mod tools;
mod verbs;
mod view;
pub mod viewpoints;
pub mod viewport;
mod windows;
mod work;

pub use app::App;
pub use run::{graphics_setup, run};
pub use settings::SettingsStore;
