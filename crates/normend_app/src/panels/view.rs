//! How the scan is shown.

use egui::{Checkbox, ComboBox, DragValue, Label, Response, RichText, Slider, Ui};
use glam::Vec3;
use normend_core::{Document, PointCloud};
use normend_render::{Palette, Section};

use super::values::{self, Scale};
use super::{compare, navigation};
use crate::coloring::{self, Coloring};
use crate::command::{Action, Command};
use crate::compare::Comparing;
use crate::paint::Display;
use crate::settings::{DisplaySettings, HAIR_LENGTHS, HAIR_STEPS, PaletteChoice, SPLAT_SCALES, Settings, ThemeChoice};
use crate::source_kinds::SourceKind;
use crate::theme::{self, SPACE_M, SPACE_XS};
use crate::viewport::Viewport;

/// A section is at least so thin, as a part of the scan's size.
const THINNEST_SECTION: f32 = 0.001;

/// What the tab shows and changes.
pub struct ViewTab<'a> {
    /// The open scan.
    pub document: &'a Document,
    /// What is remembered.
    pub settings: &'a mut Settings,
    /// The coloring.
    pub display: &'a mut Display,
    /// The camera and what is cut away.
    pub viewport: &'a mut Viewport,
    /// What is compared.
    pub comparing: &'a mut Comparing,
    /// The colors in force.
    pub palette: Palette,
    /// Whether places of the scanner are shown; `None` where there are none.
    pub scanner: Option<bool>,
}

impl ViewTab<'_> {
    /// The tab.
    pub fn ui(mut self, ui: &mut Ui) -> Option<Action> {
        let coloring = theme::section(ui, "Coloring", |ui| self.coloring(ui));
        let compared = theme::section_about(ui, "Compare", compare::ABOUT, |ui| {
            compare::ui(ui, self.document, self.comparing)
        });
        let marked = theme::section(ui, "Marks", |ui| {
            marks(ui, &mut self.settings.display);
            let mut shown = self.scanner?;
            let places = ui.checkbox(&mut shown, "Scanner places");
            let places = places.on_hover_text("Where the scanner was, with names");
            places.changed().then_some(Action::ShowKind(SourceKind::Scanner, shown))
        });
        theme::section(ui, "Cuts", |ui| self.cuts(ui));
        theme::section(ui, "Picture", |ui| self.picture(ui));
        theme::section(ui, "Moving around", |ui| {
            navigation::ui(ui, &mut self.settings.navigation);
        });
        coloring.or(compared).or(marked)
    }

    fn coloring(&mut self, ui: &mut Ui) -> Option<Action> {
        let mut action = None;
        let present = self.display.coloring();
        let keys = Command::NextDisplayMode.tooltip_with_keys(ui.ctx());
        theme::rows(ui, "coloring", |ui| {
            theme::input_row(ui, "Display", &format!("{}\n{keys}", present.tooltip()), |ui| {
                ComboBox::from_id_salt("display mode")
                    .selected_text(present.label())
                    // All at once: a list that must be scrolled hides half of what there is.
                    .height(Coloring::ALL.len() as f32 * 40.0)
                    .show_ui(ui, |ui| {
                        for each in Coloring::ALL {
                            let blocked = self.display.availability(each, self.document).err();
                            let button = egui::Button::selectable(each == present, each.label());
                            let row = ui.add_enabled(blocked.is_none(), button);
                            let row = row.on_hover_text(each.tooltip());
                            if row.on_disabled_hover_text(blocked.unwrap_or_default()).clicked() {
                                action = Some(Action::Display(each));
                            }
                        }
                    })
                    .response
            });
            if present == Coloring::Scalar {
                let mut column = self.display.column().to_owned();
                theme::input_row(ui, "Values", "The column of the file", |ui| {
                    ComboBox::from_id_salt("column")
                        .selected_text(theme::elided(&column, 20))
                        .show_ui(ui, |ui| {
                            for each in self.display.columns() {
                                ui.selectable_value(&mut column, each.clone(), each);
                            }
                        })
                        .response
                });
                self.display.set_column(column);
            }
            if matches!(present, Coloring::Facing | Coloring::Lit) {
                palette_row(ui, self.settings);
            }
        });
        let legend = self.legend(ui, present);
        action.or(legend)
    }

    /// What the colors mean.
    fn legend(&mut self, ui: &mut Ui, coloring: Coloring) -> Option<Action> {
        let weak = |ui: &mut Ui, text: &str| ui.add(Label::new(RichText::new(text).weak()).wrap());
        match coloring {
            Coloring::Facing => {
                ui.horizontal(|ui| {
                    values::swatch(ui, self.palette.front, "Front");
                    ui.add_space(SPACE_M);
                    values::swatch(ui, self.palette.back, "Back");
                });
                None
            }
            Coloring::Lit => {
                weak(ui, "Back sides are dark.");
                None
            }
            Coloring::Normals => {
                weak(
                    ui,
                    "Red, green and blue for x, y and z; opposite directions have opposite colors.",
                );
                None
            }
            Coloring::Regions => {
                weak(
                    ui,
                    "What turns together has one color, patches that were turned one of their own.",
                );
                None
            }
            Coloring::File => None,
            Coloring::Layers => {
                weak(ui, "The Orient tab lists the files with their colors.");
                None
            }
            Coloring::Conflict => {
                values::color_bar(ui, &coloring::conflict_scale, "Nothing against it", "All against it");
                ui.horizontal(|ui| values::swatch(ui, coloring::UNKNOWN, "Nothing is known"));
                None
            }
            Coloring::Confidence => {
                let undecided = f32::from(normend_core::confidence::UNDECIDED) / 255.0;
                let color = |share: f32| {
                    if share <= undecided {
                        coloring::UNDECIDED
                    } else {
                        coloring::scale(share)
                    }
                };
                let scale = Scale {
                    name: "confidence",
                    unit: " %",
                    color: &color,
                };
                let action = self.values(ui, &scale);
                ui.horizontal(|ui| values::swatch(ui, coloring::UNDECIDED, "Undecided: a coin's throw"))
                    .response
                    .on_hover_text("The side is as likely wrong as right. Signs are those before any click.");
                action
            }
            Coloring::Scalar => {
                let name = self.display.column().to_owned();
                let scale = Scale {
                    name: &name,
                    unit: "",
                    color: &coloring::scale,
                };
                let action = self.values(ui, &scale);
                self.scale_fields(ui);
                action
            }
        }
    }

    fn values(&mut self, ui: &mut Ui, scale: &Scale<'_>) -> Option<Action> {
        let Some(histogram) = self.display.histogram() else {
            ui.label(RichText::new("Reading the values…").weak());
            return None;
        };
        let action = values::histogram(ui, histogram, scale, self.settings.display.log_bars);
        ui.checkbox(&mut self.settings.display.log_bars, "Show small counts too")
            .on_hover_text("Bars grow with the logarithm of the number of points");
        action
    }

    /// The values at the ends of the scale.
    fn scale_fields(&mut self, ui: &mut Ui) {
        let Some(shown) = self.display.histogram().map(|histogram| histogram.range) else {
            return;
        };
        let mut range = shown;
        let speed = (range[1] - range[0]).abs().max(f64::MIN_POSITIVE) / 200.0;
        ui.horizontal(|ui| {
            ui.label(RichText::new("Scale").weak());
            for (end, name) in range.iter_mut().zip(["low end", "high end"]) {
                let field = ui.add(DragValue::new(end).speed(speed));
                field.widget_info(|| egui::WidgetInfo::labeled(egui::accesskit::Role::SpinButton, true, name));
                field.on_hover_text("The value that has the color at this end");
            }
            let usual = ui.button("Usual");
            if usual
                .on_hover_text("All values but the few lowest and highest")
                .clicked()
            {
                self.display.set_range(None);
            }
        });
        if range != shown {
            self.display
                .set_range(Some([range[0].min(range[1]), range[0].max(range[1])]));
        }
    }

    fn cuts(&mut self, ui: &mut Ui) {
        let cloud = self.document.cloud();
        theme::rows(ui, "cuts", |ui| {
            let tooltip = format!(
                "How much of what is near is cut away\n{}",
                Command::CutDeeper.tooltip_with_keys(ui.ctx())
            );
            theme::input_row(ui, "Cut near, %", &tooltip, |ui| {
                let mut percent = self.viewport.clip.near * 100.0;
                let slider = ui.add(Slider::new(&mut percent, 0.0..=100.0).fixed_decimals(0));
                if slider.changed() {
                    self.viewport.clip.near = percent / 100.0;
                }
                slider
            });
        });
        let mut has_box = self.viewport.clip.bounds.is_some();
        let tooltip = Command::ClipBox.tooltip_with_keys(ui.ctx());
        if ui.checkbox(&mut has_box, "Clip box").on_hover_text(tooltip).changed() {
            self.viewport.toggle_clip_box();
        }
        if let Some([low, high]) = &mut self.viewport.clip.bounds {
            box_fields(ui, cloud, low, high);
        }
        let mut has_section = self.viewport.clip.section.is_some();
        let tooltip = Command::Section.tooltip_with_keys(ui.ctx());
        if ui
            .checkbox(&mut has_section, "Section")
            .on_hover_text(tooltip)
            .changed()
        {
            self.viewport.toggle_section();
        }
        let diagonal = cloud.diagonal();
        if let Some(section) = &mut self.viewport.clip.section {
            section_fields(ui, cloud, diagonal, section);
            let button = ui.button("Across the view");
            if button
                .on_hover_text("Turn the section so that you look straight at it")
                .clicked()
            {
                self.viewport.turn_section();
            }
        }
    }

    fn picture(&mut self, ui: &mut Ui) {
        theme::rows(ui, "picture", |ui| {
            let mut tooltip = "Factor on the size of all splats".to_owned();
            let keys = [Command::LargerSplats, Command::SmallerSplats].map(|command| command.key_text(ui.ctx()));
            if let [Some(larger), Some(smaller)] = keys {
                tooltip += &format!(" ({larger} and {smaller})");
            }
            theme::input_row(ui, "Splat size", &tooltip, |ui| {
                ui.add(
                    Slider::new(&mut self.settings.splat_scale, SPLAT_SCALES)
                        .logarithmic(true)
                        .fixed_decimals(2),
                )
            });
            let tooltip = "How dark edges and creases are drawn, so that depth is seen (eye-dome lighting)";
            theme::input_row(ui, "Edge shading", tooltip, |ui| {
                ui.add(Slider::new(&mut self.settings.display.eye_dome, 0.0..=1.0).fixed_decimals(2))
            });
            theme::input_row(ui, "Theme", "Light or dark", |ui| {
                ComboBox::from_id_salt("theme")
                    .selected_text(self.settings.theme.label())
                    .show_ui(ui, |ui| {
                        for each in ThemeChoice::ALL {
                            ui.selectable_value(&mut self.settings.theme, each, each.label());
                        }
                    })
                    .response
            });
        });
    }
}

fn palette_row(ui: &mut Ui, settings: &mut Settings) {
    let dark = ui.visuals().dark_mode;
    theme::input_row(ui, "Colors", "The colors of front and back", |ui| {
        ComboBox::from_id_salt("palette")
            .selected_text(settings.palette.label())
            .show_ui(ui, |ui| {
                for each in PaletteChoice::ALL {
                    ui.horizontal(|ui| {
                        ui.selectable_value(&mut settings.palette, each, each.label());
                        let palette = theme::palette(each, dark);
                        ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
                            values::swatch(ui, palette.back, "");
                            values::swatch(ui, palette.front, "");
                        });
                    });
                }
            })
            .response
    });
}

fn marks(ui: &mut Ui, settings: &mut DisplaySettings) {
    let tooltip = Command::ToggleHair.tooltip_with_keys(ui.ctx());
    ui.checkbox(&mut settings.hair, "Normals as hair")
        .on_hover_text(tooltip);
    if settings.hair {
        theme::rows(ui, "hair", |ui| {
            theme::input_row(ui, "Length", "How long each hair is, in points of the screen", |ui| {
                ui.add(Slider::new(&mut settings.hair_length, HAIR_LENGTHS).fixed_decimals(0))
            });
            theme::input_row(ui, "One in", "A hair on each so-many-th point", |ui| {
                ui.add(Slider::new(&mut settings.hair_step, HAIR_STEPS).logarithmic(true))
            });
        });
    }
    let tooltip = Command::ToggleSpheres.tooltip_with_keys(ui.ctx());
    ui.checkbox(&mut settings.spheres, "Sources as spheres")
        .on_hover_text(tooltip);
}

/// The corners of the clip box in the file's coordinates.
fn box_fields(ui: &mut Ui, cloud: &PointCloud, low: &mut Vec3, high: &mut Vec3) {
    let origin = cloud.origin();
    let speed = f64::from(cloud.diagonal()) / 500.0;
    let decimals = theme::decimals(cloud.diagonal().into());
    theme::rows(ui, "clip box", |ui| {
        for (axis, name) in ["x", "y", "z"].into_iter().enumerate() {
            ui.label(RichText::new(format!("{name} from, to")).weak());
            ui.horizontal(|ui| {
                ui.spacing_mut().item_spacing.x = SPACE_XS;
                let mut ends = [low[axis], high[axis]].map(|value| f64::from(value) + origin[axis]);
                let mut changed = false;
                for (end, which) in ends.iter_mut().zip(["from", "to"]) {
                    let field = ui.add(DragValue::new(end).speed(speed).max_decimals(decimals));
                    field.widget_info(|| {
                        egui::WidgetInfo::labeled(
                            egui::accesskit::Role::SpinButton,
                            true,
                            format!("Clip box {name} {which}"),
                        )
                    });
                    changed |= field.changed();
                }
                if changed {
                    let ends = ends.map(|end| (end - origin[axis]) as f32);
                    (low[axis], high[axis]) = (ends[0].min(ends[1]), ends[0].max(ends[1]));
                }
            });
            ui.end_row();
        }
    });
}

/// How thick the section is, and where it lies.
fn section_fields(ui: &mut Ui, cloud: &PointCloud, diagonal: f32, section: &mut Section) {
    let (min, max) = cloud.bounding_box();
    let middle = 0.5 * (min + max);
    let direction = section.direction.normalize_or(Vec3::Z);
    theme::rows(ui, "section", |ui| {
        let tooltip = "How thick the slice is that stays, as a part of the scan's size";
        theme::input_row(ui, "Thickness, %", tooltip, |ui| -> Response {
            let mut percent = 100.0 * section.thickness / diagonal;
            let slider = Slider::new(&mut percent, 100.0 * THINNEST_SECTION..=100.0);
            let slider = ui.add(slider.logarithmic(true).fixed_decimals(1));
            if slider.changed() {
                section.thickness = percent / 100.0 * diagonal;
            }
            slider
        });
        theme::input_row(
            ui,
            "Place, %",
            "Where the slice is, from one end of the scan to the other",
            |ui| -> Response {
                let mut percent = 50.0 + 100.0 * (section.point - middle).dot(direction) / diagonal;
                let slider = ui.add(Slider::new(&mut percent, 0.0..=100.0).fixed_decimals(1));
                if slider.changed() {
                    section.point = middle + direction * (percent - 50.0) / 100.0 * diagonal;
                }
                slider
            },
        );
    });
}

/// A box to tick that says why it cannot be ticked.
pub fn checkbox(ui: &mut Ui, value: &mut bool, label: &str, blocked: Option<&str>) -> Response {
    let checkbox = ui.add_enabled(blocked.is_none(), Checkbox::new(value, label));
    checkbox.on_disabled_hover_text(blocked.unwrap_or_default())
}
