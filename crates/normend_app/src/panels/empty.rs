//! What is shown while no scan is open: what Normend does, and the ways to begin.

use std::path::PathBuf;

use egui::{Align, Button, Color32, Layout, RichText, Shape, Stroke, Ui, Vec2};
use normend_render::Palette;

use crate::command::{Action, Command};
use crate::dialogs::NO_DROP;
use crate::theme::{self, SPACE_L, SPACE_M, SPACE_S, SPACE_XS};

const WIDTH: f32 = 460.0;
const RECENT_SHOWN: usize = 5;

/// The empty state. `can_drop` says whether the system delivers dropped files.
pub fn ui(ui: &mut Ui, recent: &[PathBuf], can_drop: bool) -> Option<Action> {
    let mut action = None;
    let height = 236.0
        + if recent.is_empty() {
            0.0
        } else {
            40.0 + 34.0 * recent.len().min(RECENT_SHOWN) as f32
        };
    let space = ((ui.available_height() - height) * 0.42).max(SPACE_L);
    ui.add_space(space);
    let margin = ((ui.available_width() - WIDTH) * 0.5).max(SPACE_L);
    ui.horizontal(|ui| {
        ui.spacing_mut().item_spacing.x = 0.0;
        ui.add_space(margin);
        ui.allocate_ui_with_layout(Vec2::new(WIDTH, height), Layout::top_down(Align::Min), |ui| {
            ui.spacing_mut().item_spacing = Vec2::new(SPACE_S, SPACE_S);
            ui.horizontal(|ui| {
                ui.spacing_mut().item_spacing.x = SPACE_M;
                emblem(ui);
                ui.label(RichText::new("Normend").size(32.0).strong());
            });
            ui.add_space(SPACE_XS);
            let claim = "Make every normal of a point cloud point to the right side: open a scan, click what is wrong, export it.";
            ui.add(egui::Label::new(RichText::new(claim).size(15.0)).wrap());
            ui.add_space(SPACE_L);
            ui.horizontal(|ui| {
                let size = Vec2::new(0.0, 36.0);
                let open = theme::primary_button(ui, "Open a scan…").min_size(size);
                let tooltip = |command: Command| command.tooltip_with_keys(ui.ctx());
                let tooltips = [Command::Open, Command::OpenSample, Command::OpenPath].map(tooltip);
                let [of_open, of_sample, of_path] = tooltips;
                if ui.add(open).on_hover_text(of_open).clicked() {
                    action = Some(Command::Open.into());
                }
                let sample = Button::new("Try the sample").min_size(size);
                if ui.add(sample).on_hover_text(of_sample).clicked() {
                    action = Some(Command::OpenSample.into());
                }
                let path = Button::new("Type a path…").min_size(size);
                if ui.add(path).on_hover_text(of_path).clicked() {
                    action = Some(Command::OpenPath.into());
                }
            });
            ui.add_space(SPACE_XS);
            let formats = if can_drop {
                "PLY and XYZ text. You can also drop a file on this window.".to_owned()
            } else {
                format!("PLY and XYZ text. {NO_DROP}")
            };
            ui.label(RichText::new(formats).weak());
            if recent.is_empty() {
                return;
            }
            ui.add_space(SPACE_L);
            ui.label(RichText::new("Recent scans").strong());
            for path in recent.iter().take(RECENT_SHOWN) {
                if recent_row(ui, path).clicked() {
                    action = Some(Action::OpenScan(path.clone()));
                }
            }
        });
    });
    action
}

/// A disc with a front and a back half.
fn emblem(ui: &mut Ui) {
    let (rect, _) = ui.allocate_exact_size(Vec2::splat(36.0), egui::Sense::hover());
    let palette = Palette::BLUE_ORANGE;
    let color = |[red, green, blue]: [f32; 3]| {
        let byte = |channel: f32| (channel * 255.0).round() as u8;
        Color32::from_rgb(byte(red), byte(green), byte(blue))
    };
    let radius = 0.5 * rect.width() - 2.0;
    ui.painter().circle_filled(rect.center(), radius, color(palette.back));
    let half = (0..=32).map(|step| {
        let angle = (0.75 + step as f32 / 32.0) * std::f32::consts::PI;
        rect.center() + radius * Vec2::angled(angle)
    });
    ui.painter().add(Shape::convex_polygon(
        half.collect(),
        color(palette.front),
        Stroke::NONE,
    ));
}

fn recent_row(ui: &mut Ui, path: &std::path::Path) -> egui::Response {
    let name = path
        .file_name()
        .unwrap_or(path.as_os_str())
        .to_string_lossy()
        .into_owned();
    let folder = path
        .parent()
        .map(|folder| folder.display().to_string())
        .unwrap_or_default();
    ui.horizontal(|ui| {
        ui.spacing_mut().item_spacing.x = SPACE_M;
        let response = ui
            .link(theme::elided(&name, 40))
            .on_hover_text(path.display().to_string());
        ui.add(egui::Label::new(RichText::new(folder).weak()).truncate());
        response
    })
    .inner
}
