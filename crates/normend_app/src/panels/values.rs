//! A scale of values: its colors, how many points have each value, and selecting a part of them by dragging.

use egui::{Color32, DragValue, Label, Mesh, Rect, RichText, Sense, Shape, Stroke, Ui, Vec2, pos2};

use crate::coloring::{self, Rgb};
use crate::command::Action;
use crate::scalars::Histogram;
use crate::theme::{self, SPACE_S, SPACE_XS};

const BAR_HEIGHT: f32 = 12.0;
const HISTOGRAM_HEIGHT: f32 = 72.0;
/// Steps of a scale's colors: fewer than pixels, more than an eye tells apart.
const N_STEPS: usize = 64;

/// How the values of a histogram are shown and read.
pub struct Scale<'a> {
    /// What the values are, in the user's words.
    pub name: &'a str,
    /// After numbers: "%".
    pub unit: &'a str,
    /// The color at a share of the range.
    pub color: &'a dyn Fn(f32) -> Rgb,
}

/// The colors of a scale from left to right, with what its ends mean.
pub fn color_bar(ui: &mut Ui, color: &dyn Fn(f32) -> Rgb, low: &str, high: &str) {
    let width = theme::content_width(ui);
    let (rect, _) = ui.allocate_exact_size(Vec2::new(width, BAR_HEIGHT), Sense::hover());
    let mut mesh = Mesh::default();
    for step in 0..=N_STEPS {
        let share = step as f32 / N_STEPS as f32;
        let x = rect.left() + share * rect.width();
        let color = color32(color(share));
        mesh.colored_vertex(pos2(x, rect.top()), color);
        mesh.colored_vertex(pos2(x, rect.bottom()), color);
        if step > 0 {
            let at = 2 * step as u32;
            mesh.add_triangle(at - 2, at - 1, at);
            mesh.add_triangle(at - 1, at, at + 1);
        }
    }
    ui.painter().add(Shape::mesh(mesh));
    ui.horizontal(|ui| {
        ui.set_width(width);
        ui.label(RichText::new(low).weak());
        ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
            ui.label(RichText::new(high).weak());
        });
    });
}

/// A colored square and what it means.
pub fn swatch(ui: &mut Ui, color: Rgb, label: &str) {
    ui.spacing_mut().item_spacing.x = SPACE_S;
    let (rect, _) = ui.allocate_exact_size(Vec2::splat(14.0), Sense::hover());
    ui.painter().rect_filled(rect, 3.0, color32(color));
    // A color as dark or as bright as the panel has an edge.
    let edge = Stroke::new(1.0, ui.visuals().weak_text_color());
    ui.painter().rect_stroke(rect, 3.0, edge, egui::StrokeKind::Inside);
    ui.label(label);
}

/// The histogram over its scale; a drag over it, or the fields below it, select points.
pub fn histogram(ui: &mut Ui, histogram: &Histogram, scale: &Scale<'_>, log_bars: bool) -> Option<Action> {
    let mut action = None;
    let size = Vec2::new(theme::content_width(ui), HISTOGRAM_HEIGHT);
    let (rect, response) = ui.allocate_exact_size(size, Sense::click_and_drag());
    let label = format!("Histogram of {}", scale.name);
    response.widget_info(|| egui::WidgetInfo::labeled(egui::accesskit::Role::Image, true, &label));
    ui.painter().rect_filled(rect, 3.0, ui.visuals().extreme_bg_color);
    let heights = heights(&histogram.counts, log_bars);
    let width = rect.width() / heights.len() as f32;
    for (index, height) in heights.iter().enumerate() {
        let left = rect.left() + index as f32 * width;
        let top = rect.bottom() - height * (rect.height() - SPACE_XS);
        let bar = Rect::from_min_max(pos2(left, top), pos2(left + width.max(1.0), rect.bottom()));
        let share = (index as f32 + 0.5) / heights.len() as f32;
        ui.painter().rect_filled(bar, 0.0, color32((scale.color)(share)));
    }
    // Dark bars on a dark ground and light ones on a light ground have a line above.
    let line = Stroke::new(1.0, ui.visuals().weak_text_color());
    let tops = heights.iter().enumerate().map(|(index, height)| {
        let x = rect.left() + (index as f32 + 0.5) * width;
        pos2(x, rect.bottom() - height * (rect.height() - SPACE_XS))
    });
    ui.painter().add(Shape::line(tops.collect(), line));

    let share_at = |x: f32| ((x - rect.left()) / rect.width()).clamp(0.0, 1.0);
    let pointer = response.interact_pointer_pos().map(|position| share_at(position.x));
    let id = response.id.with("start");
    if response.drag_started()
        && let Some(origin) = ui.input(|input| input.pointer.press_origin())
    {
        ui.data_mut(|data| data.insert_temp(id, share_at(origin.x)));
    }
    let start: Option<f32> = ui.data(|data| data.get_temp(id));
    if let (Some(start), Some(now)) = (start, pointer) {
        let [low, high] = [start.min(now), start.max(now)].map(|share| rect.left() + share * rect.width());
        let band = Rect::from_x_y_ranges(low..=high, rect.y_range());
        let accent = theme::accent(ui);
        ui.painter().rect_filled(band, 0.0, accent.gamma_multiply(0.25));
        ui.painter()
            .rect_stroke(band, 0.0, Stroke::new(1.0, accent), egui::StrokeKind::Inside);
        if response.drag_stopped() {
            ui.data_mut(|data| data.remove::<f32>(id));
            action = Some(Action::SelectValues {
                range: histogram.between(start, now),
                modifiers: ui.input(|input| input.modifiers),
            });
        }
    }
    if let Some(position) = response.hover_pos() {
        let value = histogram.value_at(share_at(position.x));
        let index = ((share_at(position.x) * heights.len() as f32) as usize).min(heights.len() - 1);
        let n_points = theme::counted(histogram.counts[index], "point", "points");
        response.on_hover_text(format!(
            "About {}{}: {n_points}\nDrag selects; Shift adds, Ctrl removes, both keep what is in both.\nThe ends hold what lies \
             beyond the scale.",
            number(value),
            scale.unit
        ));
    }
    color_bar(
        ui,
        scale.color,
        &format!("{}{}", number(histogram.range[0]), scale.unit),
        &format!("{}{}", number(histogram.range[1]), scale.unit),
    );
    if histogram.n_missing > 0 {
        let n_points = theme::counted(histogram.n_missing, "point has", "points have");
        ui.add(Label::new(RichText::new(format!("{n_points} no value")).weak()));
    }
    let fields = select_fields(ui, histogram, scale);
    action.or(fields)
}

/// Selecting by numbers, for exact bounds and for keyboards.
fn select_fields(ui: &mut Ui, histogram: &Histogram, scale: &Scale<'_>) -> Option<Action> {
    let id = ui.scope_id().with(("values to select", scale.name));
    let mut range: [f64; 2] = ui.data(|data| data.get_temp(id)).unwrap_or(histogram.range);
    let speed = (histogram.range[1] - histogram.range[0]).abs().max(f64::MIN_POSITIVE) / 200.0;
    // Ten thousandths of the range tell any two bars apart.
    let decimals = theme::decimals((histogram.range[1] - histogram.range[0]).abs()).saturating_sub(3);
    let mut action = None;
    ui.horizontal(|ui| {
        for (end, name) in range.iter_mut().zip(["from", "to"]) {
            let label = ui.label(RichText::new(name).weak());
            let field = ui.add(DragValue::new(end).speed(speed).max_decimals(decimals));
            field.labelled_by(label.id);
        }
        let button = ui.button("Select");
        let tooltip = "Select the points with these values; Shift adds to the selection, Ctrl removes from it";
        if button.on_hover_text(tooltip).clicked() {
            action = Some(Action::SelectValues {
                range: [range[0].min(range[1]), range[0].max(range[1])],
                modifiers: ui.input(|input| input.modifiers),
            });
        }
    });
    ui.data_mut(|data| data.insert_temp(id, range));
    action
}

/// Bars as parts of the highest.
fn heights(counts: &[u64], log_bars: bool) -> Vec<f32> {
    let height = |count: u64| {
        if log_bars { (count as f32).ln_1p() } else { count as f32 }
    };
    let highest = counts
        .iter()
        .copied()
        .map(height)
        .fold(0.0, f32::max)
        .max(f32::MIN_POSITIVE);
    counts.iter().map(|&count| height(count) / highest).collect()
}

/// A number in few letters.
pub fn number(value: f64) -> String {
    let magnitude = value.abs();
    if value == 0.0 || (0.001..1e7).contains(&magnitude) {
        let decimals = (3 - magnitude.log10().floor().clamp(0.0, 3.0) as i32).max(0) as usize;
        let text = format!("{value:.decimals$}");
        if text.contains('.') {
            return text.trim_end_matches('0').trim_end_matches('.').to_owned();
        }
        return text;
    }
    format!("{value:.3e}")
}

fn color32(color: Rgb) -> Color32 {
    let [red, green, blue, _] = coloring::packed(color).to_le_bytes();
    Color32::from_rgb(red, green, blue)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_short() {
        let check = |value: f64, expect: &str| assert_eq!(number(value), expect);
        check(0.0, "0");
        check(100.0, "100");
        check(0.25, "0.25");
        check(1234.5678, "1235");
        check(12.3456, "12.35");
        check(-0.5, "-0.5");
        check(1e-9, "1.000e-9");
        check(1.5e12, "1.500e12");
    }

    #[test]
    fn the_highest_bar_fills_the_height() {
        assert_eq!(heights(&[0, 5, 10], false), [0.0, 0.5, 1.0]);
        let log = heights(&[0, 1, 1_000_000], true);
        assert!(log[0] == 0.0 && log[1] > 0.04 && log[2] == 1.0, "{log:?}");
        assert_eq!(heights(&[0, 0], true), [0.0, 0.0]);
    }
}
