//! The votes of viewpoints: their histogram with the two intervals that sources are taken from, both draggable.

use egui::{Color32, CursorIcon, EventFilter, Key, Modifiers, Pos2, Rect, RichText, Sense, Stroke, Ui, Vec2};
use normend_core::propagation::ETA;
use normend_core::visibility::SortedVotes;
use normend_core::{Method, Parameters, Preset, SourceRule, Start};

use crate::command::Action;
use crate::session::Session;
use crate::theme::{self, SPACE_XS};

/// What the section is.
pub const ABOUT: &str = "Viewpoints around the scan see its points from one side or the other; each point has the sum of their votes.\n\
                         Points with the clearest sums become sources: those in the two shaded ends.";

/// Height of the histogram, in points.
const HEIGHT: f32 = 96.0;
/// Bars of the histogram: about four points wide each.
const N_BINS: usize = 72;
/// Width of the strip around a line that takes the pointer, in points.
const REACH: f32 = 12.0;
/// What an arrow key changes eta by.
const KEY_STEP: f32 = 0.01;

/// The section. What is dragged is applied when it is let go: `session.eta_draft` until then.
pub fn ui(ui: &mut Ui, session: &mut Session) -> Option<Action> {
    let propagation = session.document.propagation()?;
    let Some(votes) = propagation.votes.clone() else {
        return switch(ui, session);
    };
    let wanted = session.document.parameters();
    let mut eta = session.eta_draft.unwrap_or(session.requested.eta);
    let before = eta;
    let mut released = histogram(ui, &votes, &mut eta);
    ui.horizontal(|ui| {
        ui.spacing_mut().item_spacing.x = SPACE_XS;
        let name = ui.label(RichText::new("Eta").weak());
        let field = egui::DragValue::new(&mut eta)
            .range(ETA)
            .speed(0.002)
            .max_decimals(3)
            .update_while_editing(false);
        let response = ui
            .add(field)
            .labelled_by(name.id)
            .on_hover_text(eta_tooltip(wanted.sources));
        released |= response.drag_stopped() || (response.changed() && !response.dragged());
        let n_sources = theme::counted(votes.n_sources(eta) as u64, "source", "sources");
        let seen = theme::thousands(votes.n_seen() as u64);
        ui.label(n_sources)
            .on_hover_text(format!("Of {seen} points that are seen"));
    });
    if eta != before {
        session.eta_draft = Some(eta);
    }
    if released && session.eta_draft.is_some() {
        session.eta_draft = None;
        let parameters = Parameters { eta, ..wanted };
        return (parameters != wanted).then_some(Action::ProposeParameters(parameters));
    }
    None
}

fn eta_tooltip(rule: SourceRule) -> &'static str {
    match rule {
        SourceRule::HiddenPointsMended => {
            "The share of the points seen that become sources, those with the clearest votes"
        }
        SourceRule::Highest | SourceRule::HiddenPoints => "How far from the two ends of the votes sources are taken",
    }
}

/// One line where no viewpoints vote, and the way to let them.
fn switch(ui: &mut Ui, session: &Session) -> Option<Action> {
    let hint = "No viewpoints vote: the present method needs none.";
    ui.add(egui::Label::new(RichText::new(hint).weak()).wrap());
    let button = ui.button("Let viewpoints vote");
    let drops_given = session.document.given_normals().is_some() && session.document.parameters().start == Start::Keep;
    if drops_given {
        let cost = "This estimates the normals anew: those of the file are not kept.";
        ui.add(egui::Label::new(RichText::new(cost).weak()).wrap());
    }
    let button = button.on_hover_text(
        "Estimate the normals anew and orient them with the spanning tree, from sources that viewpoints around the scan vote for",
    );
    button.clicked().then(|| {
        let wanted = session.document.parameters();
        let tree = if wanted.method == Method::SpanningTree {
            wanted
        } else {
            Preset::Tree.parameters()
        };
        Action::ProposeParameters(Parameters {
            start: Start::Estimate,
            sources: SourceRule::HiddenPointsMended,
            rule: wanted.rule,
            ..tree
        })
    })
}

/// Draws the histogram and moves the lines; says whether one was let go.
fn histogram(ui: &mut Ui, votes: &SortedVotes, eta: &mut f32) -> bool {
    let size = Vec2::new(theme::content_width(ui), HEIGHT);
    let (rect, response) = ui.allocate_exact_size(size, Sense::hover());
    response.widget_info(|| egui::WidgetInfo::labeled(egui::accesskit::Role::Image, true, "Histogram of votes"));
    response.on_hover_text("How many points have which sum of votes; heights are square roots of the counts");
    let plot = Rect::from_min_max(rect.min, rect.max - Vec2::new(0.0, 16.0));
    let [min, max] = votes.ends();
    let width = (max - min).max(f32::MIN_POSITIVE);
    let x_of = |value: f32| plot.left() + ((value - min) / width).clamp(0.0, 1.0) * plot.width();
    let value_at = |x: f32| min + (x - plot.left()) / plot.width() * width;

    let mut released = false;
    for (is_high, label) in [(false, "Lower interval of votes"), (true, "Upper interval of votes")] {
        let at = x_of(votes.thresholds(*eta)[usize::from(is_high)]);
        let strip = Rect::from_center_size(Pos2::new(at, plot.center().y), Vec2::new(REACH, plot.height()));
        let id = ui.scope_id().with(label);
        let line = ui.interact(strip, id, Sense::click_and_drag());
        line.widget_info(|| egui::WidgetInfo::slider(true, f64::from(*eta), label));
        if line.dragged()
            && let Some(pointer) = line.interact_pointer_pos()
        {
            *eta = votes.eta_at(value_at(pointer.x), is_high);
        }
        released |= line.drag_stopped();
        let by_key = keys(ui, &line, is_high);
        if by_key != 0.0 {
            *eta = (*eta + by_key).clamp(*ETA.start(), *ETA.end());
            released = true;
        }
        let line = line.on_hover_cursor(CursorIcon::ResizeHorizontal);
        line.on_hover_text(format!("{label}: drag it, or use the arrow keys. Both move together."));
    }

    let [low, high] = votes.thresholds(*eta).map(x_of);
    let painter = ui.painter_at(rect);
    let dark = ui.visuals().dark_mode;
    painter.rect_filled(plot, 3.0, ui.visuals().extreme_bg_color);
    let shade = theme::accent(ui).gamma_multiply(if dark { 0.28 } else { 0.18 });
    for range in [plot.left()..=low, high..=plot.right()] {
        painter.rect_filled(Rect::from_x_y_ranges(range, plot.y_range()), 0.0, shade);
    }
    let counts = votes.histogram(N_BINS);
    let most = counts.iter().copied().max().unwrap_or(1).max(1) as f32;
    let bar_width = plot.width() / N_BINS as f32;
    for (bin, &count) in counts.iter().enumerate().filter(|(_, count)| **count > 0) {
        let height = ((count as f32 / most).sqrt() * (plot.height() - 4.0)).max(1.0);
        let left = plot.left() + bin as f32 * bar_width;
        let bar = Rect::from_min_max(
            Pos2::new(left, plot.bottom() - height),
            Pos2::new(left + bar_width - 1.0, plot.bottom()),
        );
        let middle = bar.center().x;
        let color = if middle <= low || middle >= high {
            theme::accent(ui)
        } else {
            ui.visuals().weak_text_color()
        };
        painter.rect_filled(bar, 0.0, color);
    }
    for x in [low, high] {
        painter.vline(x, plot.y_range(), Stroke::new(2.0, ui.visuals().strong_text_color()));
    }
    axis(ui, rect, &[(plot.left(), min), (x_of(0.0), 0.0), (plot.right(), max)]);
    released
}

/// The ends and the zero of the axis, below the plot.
fn axis(ui: &Ui, rect: Rect, labels: &[(f32, f32)]) {
    let color: Color32 = ui.visuals().weak_text_color();
    let font = egui::FontId::proportional(11.0);
    let mut drawn: Vec<Rect> = Vec::new();
    for &(x, value) in labels {
        let text = if value == 0.0 {
            "0".to_owned()
        } else {
            format!("{value:.1}").replace('-', "−")
        };
        let galley = ui.painter().layout_no_wrap(text, font.clone(), color);
        let half = 0.5 * galley.size().x;
        let left = (x - half).clamp(rect.left(), rect.right() - 2.0 * half);
        let place = Rect::from_min_size(Pos2::new(left, rect.bottom() - galley.size().y), galley.size());
        if drawn.iter().all(|other| !other.intersects(place)) {
            ui.painter().galley(place.min, galley, color);
            drawn.push(place);
        }
    }
}

/// What the arrow keys change eta by, for the line that has the keyboard: outward is less.
fn keys(ui: &Ui, line: &egui::Response, is_high: bool) -> f32 {
    if !line.has_focus() {
        return 0.0;
    }
    // Else the arrows would go to the next widget.
    let arrows = EventFilter {
        horizontal_arrows: true,
        ..EventFilter::default()
    };
    ui.memory_mut(|memory| memory.set_focus_lock_filter(line.id, arrows));
    let steps = ui.input_mut(|input| {
        let mut n_times = |key| input.count_and_consume_key(Modifiers::NONE, key) as f32;
        n_times(Key::ArrowRight) - n_times(Key::ArrowLeft)
    });
    steps * KEY_STEP * if is_high { -1.0 } else { 1.0 }
}
