//! How the editor looks: one spacing scale, two themes, and the helpers that keep columns aligned.

use std::ops::RangeInclusive;

use egui::{Color32, CornerRadius, FontFamily, FontId, Margin, RichText, Stroke, TextStyle, Theme, Ui, Vec2};
use normend_render::Palette;

use crate::settings::PaletteChoice;

/// Between things that belong together, in points.
pub const SPACE_XS: f32 = 4.0;
/// Between rows and columns.
pub const SPACE_S: f32 = 8.0;
/// Around the content of panels and windows.
pub const SPACE_M: f32 = 12.0;
/// Between sections.
pub const SPACE_L: f32 = 16.0;

/// Usual width of the side panel, in points.
pub const SIDE_PANEL_WIDTH: f32 = 324.0;
/// Bounds of the side panel's width, in points: five tabs fit in a row, and values stay beside their labels.
pub const SIDE_PANEL_WIDTHS: RangeInclusive<f32> = 280.0..=520.0;
/// Width of the first column of label/value rows, in points.
pub const LABEL_WIDTH: f32 = 104.0;
/// Width of the scroll bar beside a panel, in points.
pub const SCROLL_WIDTH: f32 = 6.0;
/// Width of the second column in windows, and in a side panel of the usual width, in points.
const VALUE_WIDTH: f32 = SIDE_PANEL_WIDTH - 2.0 * SPACE_M - SCROLL_WIDTH - LABEL_WIDTH - SPACE_S;
/// Width of a number beside a slider and of every other number that fits, in points.
const SLIDER_VALUE_WIDTH: f32 = 52.0;
/// Height of rows that are only read, in points.
pub const FACT_HEIGHT: f32 = 18.0;

/// Color of a source that keeps the side its point has without sources.
pub const SOURCE_KEPT: [f32; 3] = [0.18, 0.72, 0.36];
/// Color of a source that flipped its point.
pub const SOURCE_FLIPPED: [f32; 3] = [0.93, 0.35, 0.68];
/// Color of a source that was voted for, which the user had no hand in.
pub const SOURCE_VOTED: [f32; 3] = [0.86, 0.79, 0.42];
/// Color of a pinned point: the light of a pin's head, apart from both sides of all palettes.
pub const SOURCE_PINNED: [f32; 3] = [0.95, 0.96, 0.98];
/// Color of a point whose normal came with the file.
pub const SOURCE_GIVEN: [f32; 3] = [0.47, 0.50, 0.55];

/// Over what a figure under way covers: the color of selected points, thin enough to see through.
pub const SELECTION_VEIL: Color32 = Color32::from_rgba_premultiplied(66, 8, 45, 77);

/// The colors of one theme that are not egui's own names.
struct Colors {
    text: Color32,
    strong_text: Color32,
    weak_text: Color32,
    panel: Color32,
    field: Color32,
    button: Color32,
    button_hovered: Color32,
    button_active: Color32,
    line: Color32,
    accent: Color32,
    selection: Color32,
    faint: Color32,
    warning: Color32,
    error: Color32,
    /// The button for the one thing to do next, under white text.
    primary: Color32,
}

const DARK: Colors = Colors {
    text: Color32::from_rgb(0xd3, 0xd8, 0xde),
    strong_text: Color32::from_rgb(0xf4, 0xf6, 0xf8),
    weak_text: Color32::from_rgb(0xb0, 0xb9, 0xc4),
    panel: Color32::from_rgb(0x1d, 0x20, 0x25),
    field: Color32::from_rgb(0x13, 0x15, 0x19),
    button: Color32::from_rgb(0x2c, 0x31, 0x38),
    button_hovered: Color32::from_rgb(0x39, 0x40, 0x4a),
    button_active: Color32::from_rgb(0x45, 0x4e, 0x5a),
    line: Color32::from_rgb(0x35, 0x3b, 0x44),
    accent: Color32::from_rgb(0x6c, 0xa8, 0xf7),
    selection: Color32::from_rgb(0x20, 0x48, 0x7c),
    faint: Color32::from_rgb(0x24, 0x28, 0x2e),
    warning: Color32::from_rgb(0xe8, 0xa9, 0x4c),
    error: Color32::from_rgb(0xff, 0x7b, 0x72),
    primary: Color32::from_rgb(0x2d, 0x6c, 0xc4),
};

const LIGHT: Colors = Colors {
    text: Color32::from_rgb(0x2b, 0x31, 0x38),
    strong_text: Color32::from_rgb(0x0f, 0x13, 0x18),
    weak_text: Color32::from_rgb(0x52, 0x5b, 0x66),
    panel: Color32::from_rgb(0xf5, 0xf6, 0xf8),
    field: Color32::from_rgb(0xff, 0xff, 0xff),
    button: Color32::from_rgb(0xe3, 0xe6, 0xea),
    button_hovered: Color32::from_rgb(0xd6, 0xda, 0xe0),
    button_active: Color32::from_rgb(0xc6, 0xcc, 0xd4),
    line: Color32::from_rgb(0xcf, 0xd4, 0xda),
    accent: Color32::from_rgb(0x1a, 0x5f, 0xb4),
    selection: Color32::from_rgb(0xbf, 0xd8, 0xf7),
    faint: Color32::from_rgb(0xec, 0xee, 0xf1),
    warning: Color32::from_rgb(0x8f, 0x54, 0x00),
    error: Color32::from_rgb(0xb4, 0x23, 0x18),
    primary: Color32::from_rgb(0x1a, 0x5f, 0xb4),
};

fn colors(dark: bool) -> &'static Colors {
    if dark { &DARK } else { &LIGHT }
}

/// Sets fonts, spacing and colors of both themes, and what counts as a click.
pub fn apply(ctx: &egui::Context) {
    ctx.all_styles_mut(|style| {
        let font = |size| FontId::new(size, FontFamily::Proportional);
        style.text_styles = [
            (TextStyle::Heading, font(17.0)),
            (TextStyle::Body, font(14.0)),
            (TextStyle::Button, font(14.0)),
            (TextStyle::Small, font(12.0)),
            (TextStyle::Monospace, FontId::new(13.0, FontFamily::Monospace)),
        ]
        .into();
        style.spacing.item_spacing = Vec2::new(SPACE_S, SPACE_S);
        style.spacing.button_padding = Vec2::new(SPACE_M, SPACE_XS);
        style.spacing.window_margin = Margin::same(SPACE_L as i8);
        style.spacing.menu_margin = Margin::same(SPACE_XS as i8);
        style.spacing.interact_size = Vec2::new(SLIDER_VALUE_WIDTH, 26.0);
        set_value_width(&mut style.spacing, VALUE_WIDTH);
        // A bar that shows that there is more, without the pointer over it.
        style.spacing.scroll = egui::style::ScrollStyle {
            floating_allocated_width: SCROLL_WIDTH,
            foreground_color: true,
            dormant_handle_opacity: 0.5,
            ..egui::style::ScrollStyle::thin()
        };
        style.interaction.selectable_labels = false;
    });
    for theme in [Theme::Dark, Theme::Light] {
        ctx.style_mut_of(theme, |style| style.visuals = visuals(theme));
    }
    ctx.options_mut(|options| {
        // A press that moves farther is a drag of the camera, not a mend; a press may be as long as it likes.
        options.input_options.max_click_dist = 4.0;
        options.input_options.max_click_duration = 60.0;
        // The scale of the interface is a setting with commands of its own.
        options.zoom_with_keyboard = false;
    });
}

fn set_value_width(spacing: &mut egui::style::Spacing, width: f32) {
    spacing.combo_width = width;
    spacing.slider_width = width - SPACE_S - SLIDER_VALUE_WIDTH;
}

/// Lets columns fill a side panel of this width, in points, with or without a scroll bar.
pub fn fit_side_panel(ui: &mut Ui, panel_width: f32) {
    let content_width = panel_width - 2.0 * SPACE_M - SCROLL_WIDTH;
    ui.set_max_width(content_width);
    set_value_width(ui.spacing_mut(), content_width - LABEL_WIDTH - SPACE_S);
    if panel_width < SIDE_PANEL_WIDTH {
        // So that rows of buttons still fit.
        ui.spacing_mut().button_padding.x = 0.5 * SPACE_M;
    }
}

/// Widths of buttons that together fill `width`, with `gap` between them and the same room around each text, in points.
/// For buttons without padding of their own.
pub fn filling<const N: usize>(ui: &Ui, texts: [&str; N], width: f32, gap: f32) -> [f32; N] {
    let font = TextStyle::Button.resolve(ui.style());
    let text_width = |text: &str| {
        let laid_out = ui
            .painter()
            .layout_no_wrap(text.to_owned(), font.clone(), Color32::WHITE);
        laid_out.size().x
    };
    let widths = texts.map(text_width);
    let n_gaps = N.saturating_sub(1) as f32;
    let room = (width - widths.iter().sum::<f32>() - n_gaps * gap) / N.max(1) as f32;
    widths.map(|width| width + room.max(0.0))
}

/// Width of the second column of [`rows`], where inputs end at the same right edge, in points.
pub fn value_width(ui: &Ui) -> f32 {
    ui.spacing().combo_width
}

/// Width of both columns of [`rows`], which is all of the side panel's, in points.
pub fn content_width(ui: &Ui) -> f32 {
    LABEL_WIDTH + SPACE_S + value_width(ui)
}

fn visuals(theme: Theme) -> egui::Visuals {
    let dark = theme == Theme::Dark;
    let colors = colors(dark);
    let mut visuals = if dark {
        egui::Visuals::dark()
    } else {
        egui::Visuals::light()
    };
    visuals.panel_fill = colors.panel;
    visuals.window_fill = colors.panel;
    visuals.window_stroke = Stroke::new(1.0, colors.line);
    visuals.extreme_bg_color = colors.field;
    visuals.faint_bg_color = colors.faint;
    visuals.weak_text_color = Some(colors.weak_text);
    visuals.hyperlink_color = colors.accent;
    visuals.warn_fg_color = colors.warning;
    visuals.error_fg_color = colors.error;
    visuals.selection.bg_fill = colors.selection;
    visuals.selection.stroke = Stroke::new(1.0, colors.strong_text);
    visuals.window_corner_radius = CornerRadius::same(8);
    visuals.menu_corner_radius = CornerRadius::same(6);
    let widgets = &mut visuals.widgets;
    for (state, fill, text) in [
        (&mut widgets.noninteractive, colors.panel, colors.text),
        (&mut widgets.inactive, colors.button, colors.text),
        (&mut widgets.hovered, colors.button_hovered, colors.strong_text),
        (&mut widgets.active, colors.button_active, colors.strong_text),
        (&mut widgets.open, colors.button_hovered, colors.strong_text),
    ] {
        state.bg_fill = fill;
        state.weak_bg_fill = fill;
        state.bg_stroke = Stroke::new(1.0, colors.line);
        state.fg_stroke = Stroke::new(1.0, text);
        state.corner_radius = CornerRadius::same(4);
        state.expansion = 0.0;
    }
    // What has the keyboard looks active; the frame tells it apart from what is only pressed or chosen.
    widgets.active.bg_stroke = Stroke::new(1.5, colors.accent);
    visuals
}

/// The colors of the 3D view; colors stand before the theme's own background.
pub fn palette(choice: PaletteChoice, dark: bool) -> Palette {
    match choice {
        PaletteChoice::BlueOrange => Palette {
            background: background(dark),
            ..Palette::BLUE_ORANGE
        },
        PaletteChoice::GreenPurple => Palette {
            front: [0.45, 0.80, 0.45],
            back: [0.55, 0.30, 0.75],
            highlight: [1.0, 0.93, 0.25],
            wrong: [0.0, 0.0, 0.125],
            background: background(dark),
            ..Palette::BLUE_ORANGE
        },
        PaletteChoice::YellowBlue => Palette {
            front: [0.93, 0.79, 0.28],
            back: [0.16, 0.36, 0.78],
            highlight: [1.0, 0.45, 0.40],
            wrong: [0.0, 0.0, 0.125],
            background: background(dark),
            ..Palette::BLUE_ORANGE
        },
        PaletteChoice::Paper => Palette::PAPER,
    }
}

/// What stands behind colored splats.
fn background(dark: bool) -> [f32; 3] {
    if dark {
        [0.085, 0.095, 0.11]
    } else {
        [0.88, 0.895, 0.915]
    }
}

/// The color of what the user should notice.
pub fn accent(ui: &Ui) -> Color32 {
    colors(ui.visuals().dark_mode).accent
}

/// The fill behind cards that float over the 3D view.
pub fn card(ui: &Ui) -> egui::Frame {
    egui::Frame::new()
        .fill(ui.visuals().window_fill)
        .stroke(ui.visuals().window_stroke)
        .corner_radius(CornerRadius::same(8))
        .inner_margin(Margin::symmetric(SPACE_L as i8, SPACE_M as i8))
        .shadow(ui.visuals().popup_shadow)
}

/// The frame of panels.
pub fn panel_frame(style: &egui::Style) -> egui::Frame {
    egui::Frame::new()
        .fill(style.visuals.panel_fill)
        .inner_margin(Margin::symmetric(SPACE_M as i8, SPACE_XS as i8))
}

/// A section of the side panel: a heading, its rows, and room below.
pub fn section<R>(ui: &mut Ui, title: &str, rows: impl FnOnce(&mut Ui) -> R) -> R {
    section_about(ui, title, "", rows)
}

/// A [`section`] whose heading explains itself when the pointer rests on it.
pub fn section_about<R>(ui: &mut Ui, title: &str, about: &str, rows: impl FnOnce(&mut Ui) -> R) -> R {
    let text = RichText::new(title)
        .size(15.0)
        .color(ui.visuals().strong_text_color())
        .strong();
    let heading = ui.add(egui::Label::new(text));
    if !about.is_empty() {
        heading.on_hover_text(about);
    }
    ui.add_space(SPACE_XS);
    let result = rows(ui);
    ui.add_space(SPACE_L);
    result
}

/// Rows with inputs: labels and values whose columns align in every section.
pub fn rows<R>(ui: &mut Ui, id: &str, add_rows: impl FnOnce(&mut Ui) -> R) -> R {
    let height = ui.spacing().interact_size.y;
    grid(ui, id, height, add_rows)
}

/// Rows that are only read, so they may stand closer than [`rows`].
pub fn facts<R>(ui: &mut Ui, id: &str, add_rows: impl FnOnce(&mut Ui) -> R) -> R {
    grid(ui, id, FACT_HEIGHT, add_rows)
}

fn grid<R>(ui: &mut Ui, id: &str, row_height: f32, add_rows: impl FnOnce(&mut Ui) -> R) -> R {
    egui::Grid::new(id)
        .num_columns(2)
        .min_col_width(LABEL_WIDTH)
        .min_row_height(row_height)
        .spacing([SPACE_S, SPACE_XS])
        .show(ui, add_rows)
        .inner
}

/// One label/value row of [`rows`] or [`facts`].
pub fn row(ui: &mut Ui, label: &str, value: impl Into<String>) {
    ui.label(RichText::new(label).weak());
    ui.add(egui::Label::new(value.into()).truncate());
    ui.end_row();
}

/// One row of [`rows`] with an input, which takes its accessible name from the label.
pub fn input_row(ui: &mut Ui, label: &str, tooltip: &str, add_input: impl FnOnce(&mut Ui) -> egui::Response) {
    let name = ui.label(RichText::new(label).weak()).on_hover_text(tooltip);
    add_input(ui).labelled_by(name.id).on_hover_text(tooltip);
    ui.end_row();
}

/// A button for the one thing to do next.
pub fn primary_button(ui: &Ui, text: &str) -> egui::Button<'static> {
    let fill = colors(ui.visuals().dark_mode).primary;
    egui::Button::new(RichText::new(text.to_owned()).color(Color32::WHITE)).fill(fill)
}

/// `1234567` as "1,234,567".
pub fn thousands(number: u64) -> String {
    let digits = number.to_string();
    let mut text = String::with_capacity(digits.len() + digits.len() / 3);
    for (index, digit) in digits.char_indices() {
        if index > 0 && (digits.len() - index).is_multiple_of(3) {
            text.push(',');
        }
        text.push(digit);
    }
    text
}

/// A coordinate with all of its digits and no more: those of an `f32` where it is one.
pub fn coordinate(value: f64) -> String {
    let single = value as f32;
    let is_plain = value == 0.0 || (1e-6..1e16).contains(&value.abs());
    match (f64::from(single) == value, is_plain) {
        (true, true) => single.to_string(),
        (false, true) => value.to_string(),
        (true, false) => format!("{single:e}"),
        (false, false) => format!("{value:e}"),
    }
}

/// Decimals that tell lengths apart by a ten-millionth of `whole`, which is as fine as pictures are; for fields of any unit.
pub fn decimals(whole: f64) -> usize {
    if whole > 0.0 {
        (7.0 - whole.log10().floor()).clamp(0.0, 24.0) as usize
    } else {
        6
    }
}

/// "1 point", "2,000 points".
pub fn counted(number: u64, singular: &str, plural: &str) -> String {
    format!("{} {}", thousands(number), if number == 1 { singular } else { plural })
}

/// A file's name of at most `max_chars` characters: the middle of a longer one is left out, so that its end and
/// extension stay.
pub fn elided(name: &str, max_chars: usize) -> String {
    let n_chars = name.chars().count();
    if n_chars <= max_chars {
        return name.to_owned();
    }
    let n_last = max_chars.saturating_sub(1) / 2;
    let n_first = max_chars.saturating_sub(1) - n_last;
    let first: String = name.chars().take(n_first).collect();
    let last: String = name.chars().skip(n_chars - n_last).collect();
    format!("{first}…{last}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn long_names_keep_their_ends() {
        let check = |name, expect: &str| assert_eq!(elided(name, 9), expect);
        check("scan.ply", "scan.ply");
        check("scan1.ply", "scan1.ply");
        check("a long scan.ply", "a lo….ply");
        check("äöüäöüäöüäöü", "äöüä…üäöü");
    }

    #[test]
    fn numbers_have_separators() {
        let check = |number, expect: &str| assert_eq!(thousands(number), expect);
        check(0, "0");
        check(999, "999");
        check(1000, "1,000");
        check(1_234_567, "1,234,567");
        check(u64::MAX, "18,446,744,073,709,551,615");
        assert_eq!(counted(1, "point", "points"), "1 point");
        assert_eq!(counted(2000, "point", "points"), "2,000 points");
    }

    /// Contrast ratio of the Web Content Accessibility Guidelines 2.1.
    fn contrast(a: Color32, b: Color32) -> f32 {
        let luminance = |color: Color32| {
            let linear = |byte: u8| {
                let value = f32::from(byte) / 255.0;
                if value <= 0.04045 {
                    value / 12.92
                } else {
                    ((value + 0.055) / 1.055).powf(2.4)
                }
            };
            0.2126 * linear(color.r()) + 0.7152 * linear(color.g()) + 0.0722 * linear(color.b())
        };
        let (a, b) = (luminance(a), luminance(b));
        (a.max(b) + 0.05) / (a.min(b) + 0.05)
    }

    /// How a color looks with full vision and with each kind of color blindness, in linear light: Machado, Oliveira and
    /// Fernandes, "A Physiologically-based Model for Simulation of Color Vision Deficiency" (2009), at severity 1.
    const VISIONS: [(&str, [[f32; 3]; 3]); 4] = [
        ("full", [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]),
        (
            "protan",
            [
                [0.152_286, 1.052_583, -0.204_868],
                [0.114_503, 0.786_281, 0.099_216],
                [-0.003_882, -0.048_116, 1.051_998],
            ],
        ),
        (
            "deutan",
            [
                [0.367_322, 0.860_646, -0.227_968],
                [0.280_085, 0.672_501, 0.047_413],
                [-0.011_820, 0.042_940, 0.968_881],
            ],
        ),
        (
            "tritan",
            [
                [1.255_528, -0.076_749, -0.178_779],
                [-0.078_411, 0.930_809, 0.147_602],
                [0.004_733, 0.691_367, 0.303_900],
            ],
        ),
    ];

    fn times(matrix: &[[f32; 3]; 3], v: [f32; 3]) -> [f32; 3] {
        [0, 1, 2].map(|row| (0..3).map(|column| matrix[row][column] * v[column]).sum())
    }

    /// Oklab (Björn Ottosson, 2020) of linear sRGB; distances are in hundredths of the way from black to white.
    fn oklab(linear: [f32; 3]) -> [f32; 3] {
        let cones = times(
            &[
                [0.412_221_5, 0.536_332_5, 0.051_446],
                [0.211_903_5, 0.680_699_5, 0.107_397],
                [0.088_302_5, 0.281_718_8, 0.629_978_7],
            ],
            linear,
        );
        times(
            &[
                [0.210_454_3, 0.793_617_8, -0.004_072],
                [1.977_998_5, -2.428_592_2, 0.450_593_7],
                [0.025_904, 0.782_771_8, -0.808_675_8],
            ],
            cones.map(f32::cbrt),
        )
    }

    #[test]
    fn front_and_back_are_told_apart_with_any_color_vision() {
        let linear = |srgb: [f32; 3]| {
            srgb.map(|value| {
                if value <= 0.04045 {
                    value / 12.92
                } else {
                    ((value + 0.055) / 1.055).powf(2.4)
                }
            })
        };
        for choice in PaletteChoice::ALL {
            for dark in [false, true] {
                let palette = palette(choice, dark);
                for (vision, matrix) in &VISIONS {
                    let seen = |color: [f32; 3], light: f32| {
                        let lit = linear(color).map(|value| value * light);
                        oklab(times(matrix, lit).map(|value| value.clamp(0.0, 1.0)))
                    };
                    let distance = |a: [f32; 3], b: [f32; 3]| {
                        100.0 * (0..3).map(|axis| (a[axis] - b[axis]).powi(2)).sum::<f32>().sqrt()
                    };
                    // Two patches side by side in the same light, and with light from any side on either.
                    let same = distance(seen(palette.front, 1.0), seen(palette.back, 1.0));
                    assert!(same >= 25.0, "{choice:?}, {vision}: {same:.1}");
                    let lights = [0.35, 0.5, 0.7, 0.85, 1.0];
                    let worst = lights
                        .into_iter()
                        .flat_map(|front| lights.into_iter().map(move |back| (front, back)))
                        .map(|(front, back)| distance(seen(palette.front, front), seen(palette.back, back)))
                        .fold(f32::INFINITY, f32::min);
                    assert!(worst >= 11.0, "{choice:?}, {vision}, in unlike light: {worst:.1}");
                    let highlighted = distance(seen(palette.front, 1.0), seen(palette.highlight, 1.0));
                    assert!(
                        highlighted >= 10.0,
                        "{choice:?}, {vision}: highlight at {highlighted:.1}"
                    );
                    // Balls on wrong points stand on either side, in any light.
                    let marked = (lights.into_iter())
                        .flat_map(|light| [seen(palette.front, light), seen(palette.back, light)])
                        .map(|side| distance(seen(palette.wrong, 1.0), side))
                        .fold(f32::INFINITY, f32::min);
                    assert!(marked >= 18.0, "{choice:?}, {vision}: wrong points at {marked:.1}");
                }
            }
        }
    }

    #[test]
    fn text_is_readable_in_both_themes() {
        for (name, colors) in [("dark", &DARK), ("light", &LIGHT)] {
            for (what, text, back) in [
                ("text", colors.text, colors.panel),
                ("strong", colors.strong_text, colors.panel),
                ("weak", colors.weak_text, colors.panel),
                ("weak on field", colors.weak_text, colors.field),
                ("button", colors.text, colors.button),
                ("hovered", colors.strong_text, colors.button_hovered),
                ("active", colors.strong_text, colors.button_active),
                ("selected", colors.strong_text, colors.selection),
                ("warning", colors.warning, colors.panel),
                ("error", colors.error, colors.panel),
                ("accent", colors.accent, colors.panel),
                ("text on field", colors.text, colors.field),
                ("strong on field", colors.strong_text, colors.field),
                ("weak on button", colors.weak_text, colors.button),
                ("weak when hovered", colors.weak_text, colors.button_hovered),
                ("weak when selected", colors.weak_text, colors.selection),
                ("text when selected", colors.text, colors.selection),
                ("weak on stripes", colors.weak_text, colors.faint),
                ("text on stripes", colors.text, colors.faint),
                ("warning on field", colors.warning, colors.field),
                ("error on field", colors.error, colors.field),
                ("primary button", Color32::WHITE, colors.primary),
                ("accent on button", colors.accent, colors.button),
            ] {
                let ratio = contrast(text, back);
                assert!(ratio >= 4.5, "{what} in the {name} theme has contrast {ratio:.2}");
            }
        }
    }
}
