//! Where the scanner was: marks in the view, the user's own places, and what each place says of the points.
//!
//! Ground are the files' places, which are read with the scan, and the document's choice; what is counted follows the signs in a job.

use std::sync::Arc;

use egui::{Color32, FontId, Pos2, Rect, Stroke, Ui, Vec2};
use glam::{DVec3, Vec3};
use normend_core::document::ScannerChoice;
use normend_core::evidence::{Station, Tally, Track, tallies};
use normend_core::{Edit, PointSet, SpanningTree};
use normend_io::ScannerPlaces;

use crate::app::App;
use crate::command::Action;
use crate::job::Job;
use crate::session::Session;
use crate::source_kinds::SourceKind;
use crate::theme;
use crate::viewpoints::{camera_mark, in_view, toward};
use crate::viewport::ground;

/// Most pieces of a selection that a place can be of: each is a line of the recipe, and scans are a few pieces.
const MOST_PIECES: usize = 10_000;

/// Most lines that the way of a scanner is drawn with.
const MOST_LINES: usize = 2000;

/// Most marks that are drawn: more hide what they stand on.
const MOST_MARKS: usize = 500;

/// What a user asks for about places of the scanner.
#[derive(Clone, Debug, PartialEq)]
pub enum ScannerAction {
    /// Add one, in the file's coordinates, for all points or for the selected ones.
    Add {
        /// Where.
        place: DVec3,
        /// For the selected points alone.
        for_selected: bool,
    },
    /// Add one where the camera is.
    AddHere {
        /// For the selected points alone.
        for_selected: bool,
    },
    /// Remove a row of the user's own.
    Remove(usize),
    /// Let the places that came with the scan count, or not.
    UseFile(bool),
    /// Bring a place into view.
    Show(DVec3),
}

impl From<ScannerAction> for Action {
    fn from(action: ScannerAction) -> Self {
        Self::Scanner(action)
    }
}

/// What the counts are of: the signs, and the normals.
type Counted = (u64, Arc<SpanningTree>);

/// The places of an open scan.
#[derive(Default)]
pub struct ScannerView {
    /// What the files say.
    pub places: ScannerPlaces,
    /// What is typed for a new place.
    pub typed: String,
    /// A new place is for the selected points alone.
    pub for_selected: bool,
    tallies: Vec<Tally>,
    of: Option<Counted>,
    job: Option<(Counted, Job<Vec<Tally>>)>,
}

/// A row of the list: one place, and the pieces of the cloud that were measured from it.
#[derive(Clone, Debug, PartialEq)]
pub struct PlaceRow {
    /// The name in the list.
    pub name: String,
    /// Where, in the file's coordinates; `None` for a way.
    pub place: Option<DVec3>,
    /// The row among the user's own, if it is one.
    pub own: Option<usize>,
    /// What it says of the points; `None` until that is counted.
    pub tally: Option<Tally>,
}

/// Stations of one place that follow one another are pieces of one row.
fn rows_of(stations: &[Station]) -> impl Iterator<Item = &[Station]> {
    stations.chunk_by(|a, b| a.position == b.position)
}

impl ScannerView {
    /// The rows of the places that count, in the order of [`Session::stations`].
    pub fn rows(session: &Session) -> Vec<PlaceRow> {
        let view = &session.scanner;
        let choice = &session.document.state().scanner;
        let mut tallies = view.tallies.iter().copied();
        let mut sum = |n: usize| {
            let found: Vec<Tally> = tallies.by_ref().take(n).collect();
            (found.len() == n && view.of.is_some()).then(|| Tally {
                n_votes: found.iter().map(|tally| tally.n_votes).sum(),
                n_against: found.iter().map(|tally| tally.n_against).sum(),
            })
        };
        let mut rows = Vec::new();
        if !choice.without_file {
            for (index, station) in view.places.stations.iter().enumerate() {
                let name = view.places.names.get(index).filter(|name| !name.is_empty());
                rows.push(PlaceRow {
                    name: name.cloned().unwrap_or_else(|| format!("Place {}", index + 1)),
                    place: Some(station.position),
                    own: None,
                    tally: sum(1),
                });
            }
        }
        let n_of_file = rows.len();
        for (index, pieces) in rows_of(&choice.own).enumerate() {
            rows.push(PlaceRow {
                name: format!("Place {}", n_of_file + index + 1),
                place: Some(pieces[0].position),
                own: Some(index),
                tally: sum(pieces.len()),
            });
        }
        if session.track().is_some() {
            rows.push(PlaceRow {
                name: "Trajectory".to_owned(),
                place: None,
                own: None,
                tally: sum(1),
            });
        }
        rows
    }

    /// Three numbers apart by spaces, commas or semicolons; `None` for anything else.
    pub fn parse(typed: &str) -> Option<DVec3> {
        let is_between = |letter: char| letter.is_whitespace() || letter == ';' || letter == ',';
        let numbers: Option<Vec<f64>> = (typed.split(is_between))
            .filter(|number| !number.is_empty())
            .map(|number| number.parse().ok())
            .collect();
        match numbers.as_deref() {
            Some(&[x, y, z]) => Some(DVec3::new(x, y, z)).filter(|place| place.is_finite()),
            _ => None,
        }
    }
}

/// The runs of points that follow one another in a set, at most `most`; `None` where there are more.
fn pieces(points: &PointSet, most: usize) -> Option<Vec<std::ops::Range<u32>>> {
    let mut runs: Vec<std::ops::Range<u32>> = Vec::new();
    for point in points.iter() {
        let n_runs = runs.len();
        match runs.last_mut() {
            Some(run) if run.end == point => run.end += 1,
            _ if n_runs == most => return None,
            _ => runs.push(point..point + 1),
        }
    }
    Some(runs)
}

impl App {
    /// Does what is asked for about places of the scanner.
    pub(crate) fn act_on_scanner(&mut self, action: ScannerAction) {
        let Some(session) = &mut self.session else { return };
        let choice = session.document.state().scanner.clone();
        let origin = session.document.cloud().origin();
        let (place, for_selected) = match action {
            ScannerAction::Add { place, for_selected } => (place, for_selected),
            ScannerAction::AddHere { for_selected } => (origin + self.viewport.camera().eye().as_dvec3(), for_selected),
            ScannerAction::Remove(row) => {
                let rows = rows_of(&choice.own).enumerate().filter(|&(index, _)| index != row);
                let own = rows.flat_map(|(_, pieces)| pieces.iter().cloned()).collect();
                self.apply_edit(Edit::SetScanner(ScannerChoice { own, ..choice }));
                return;
            }
            ScannerAction::UseFile(counts) => {
                self.apply_edit(Edit::SetScanner(ScannerChoice {
                    without_file: !counts,
                    ..choice
                }));
                return;
            }
            ScannerAction::Show(place) => {
                let (min, max) = session.document.cloud().bounding_box();
                self.viewport.frame_points([(place - origin).as_vec3(), min, max]);
                return;
            }
        };
        let points = if for_selected {
            pieces(session.document.selected(), MOST_PIECES)
        } else {
            Some(std::iter::once(0..session.document.cloud().n_points() as u32).collect())
        };
        let Some(points) = points.filter(|points| !points.is_empty()) else {
            self.messages.note(
                "No place was added: select the points of one scan, which follow one another in the file, or add it for all points.",
            );
            return;
        };
        let new = points.into_iter().map(|points| Station {
            points,
            position: place,
        });
        let own = choice.own.iter().cloned().chain(new).collect();
        session.scanner.typed.clear();
        self.apply_edit(Edit::SetScanner(ScannerChoice { own, ..choice }));
    }

    /// Keeps what is counted in step with the signs. O(1) in frames in which nothing changed.
    pub(crate) fn keep_scanner(&mut self) {
        let Some(session) = &mut self.session else { return };
        let document = &session.document;
        let (Some(propagation), Some(orientation)) = (document.shared_propagation(), document.orientation()) else {
            return;
        };
        if let Some((counted, job)) = &session.scanner.job
            && let Some(outcome) = job.poll()
        {
            // It fails only when it is stopped, and that is done by dropping it.
            session.scanner.of = Some(counted.clone());
            session.scanner.tallies = outcome.unwrap_or_default();
            session.scanner.job = None;
        }
        if !session.has_scanner() || !session.has_places_of(&propagation) {
            return;
        }
        let is_now =
            |(revision, tree): &Counted| *revision == document.signs_revision() && Arc::ptr_eq(tree, &propagation.tree);
        let scanner = &session.scanner;
        if scanner.of.as_ref().is_some_and(is_now) || scanner.job.as_ref().is_some_and(|(counted, _)| is_now(counted)) {
            return;
        }
        let counted = (document.signs_revision(), Arc::clone(&propagation.tree));
        let (cloud, orientation) = (Arc::clone(document.cloud()), orientation.clone());
        let track: Option<Arc<Track>> = session.track().cloned();
        let job = Job::start(&self.ctx, "scanner", "Counting what scanners saw", move |_| {
            let normal = |point: usize| {
                let stored = propagation.normals[point];
                let is_turned = orientation.is_turned(propagation.tree.position(point as u32));
                if is_turned { -stored } else { stored }
            };
            Ok(tallies(&cloud, normal, &propagation.stations, track.as_deref()))
        });
        session.scanner.job = Some((counted, job));
    }

    /// The marks of the scanner's places over the picture, and its way.
    pub(crate) fn scanner_marks(&self, ui: &Ui) {
        let Some(session) = &self.session else { return };
        if !session.has_scanner() || !session.kinds.is_shown(SourceKind::Scanner) {
            return;
        }
        let cloud = session.document.cloud();
        let (min, max) = cloud.bounding_box();
        let center = 0.5 * (min + max);
        let local = |place: DVec3| (place - cloud.origin()).as_vec3();
        let painter = ui.painter_at(self.viewport.rect);
        if let Some(track) = session.track() {
            let corners = track.corners();
            let step = corners.len().div_ceil(MOST_LINES).max(1);
            let places: Vec<Vec3> = (corners.iter().step_by(step).chain(corners.last()))
                .map(|&corner| local(corner))
                .collect();
            for pair in places.windows(2) {
                // A line whose end is behind the viewer has no place in the picture.
                if let (Some(from), Some(to)) = (self.viewport.place(pair[0]), self.viewport.place(pair[1])) {
                    painter.line_segment([from, to], Stroke::new(4.0, Color32::from_black_alpha(120)));
                    painter.line_segment([from, to], Stroke::new(2.0, theme::accent(ui)));
                }
            }
        }
        for row in ScannerView::rows(session).into_iter().take(MOST_MARKS) {
            let Some(at) = row.place.and_then(|place| in_view(&self.viewport, local(place))) else {
                continue;
            };
            let direction = toward(&self.viewport, at, center);
            camera_mark(&painter, at, direction, theme::accent(ui), false);
            named(ui, &painter, at, &row.name);
        }
    }
}

/// Words under a mark.
pub(crate) fn named(ui: &Ui, painter: &egui::Painter, at: Pos2, words: &str) {
    const MOST_CHARS: usize = 24;
    let color = ui.visuals().strong_text_color();
    let words = painter.layout_no_wrap(theme::elided(words, MOST_CHARS), FontId::proportional(12.0), color);
    let padding = Vec2::new(6.0, 2.0);
    let size = words.size() + 2.0 * padding;
    let min = at + Vec2::new(-0.5 * size.x, 12.0);
    ground(ui, painter, Rect::from_min_size(min, size));
    painter.galley(min + padding, words, color);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_are_typed_in_any_usual_way() {
        let place = Some(DVec3::new(1.5, -2.0, 512_345.25));
        for typed in ["1.5 -2 512345.25", " 1.5,-2, 512345.25 ", "1.5;-2;\t512345.25"] {
            assert_eq!(ScannerView::parse(typed), place, "{typed}");
        }
        for typed in ["", "1 2", "1 2 3 4", "1 2 x", "1 2 nan", "1 2 inf"] {
            assert_eq!(ScannerView::parse(typed), None, "{typed}");
        }
    }

    #[test]
    fn selections_are_cut_into_pieces() {
        let points = PointSet::from_iter([1, 2, 3, 7, 9, 10]);
        assert_eq!(pieces(&points, 3), Some(vec![1..4, 7..8, 9..11]));
        assert_eq!(pieces(&points, 2), None);
        assert_eq!(pieces(&PointSet::new(), 2), Some(Vec::new()));
    }
}
