//! A thousand edits of every kind on a cloud with patches: undone and done again, state and signs come back bit for bit.

use std::collections::BTreeSet;

use glam::DVec3;

use super::*;
use crate::shapes::random::Random;
use crate::{Preset, SideRule, Silent, shapes};

const N_EDITS: usize = 1000;
const N_POINTS: usize = 400;

/// Two thin plates far from each other, oriented by the automatic method: patches, and two components.
fn document() -> Document {
    let plate = shapes::thin_plate(N_POINTS / 2, 0.05).positions;
    let other = plate.iter().map(|&position| position + Vec3::new(40.0, 3.0, 0.0));
    let positions: Vec<_> = plate.iter().copied().chain(other).collect();
    let cloud = Arc::new(PointCloud::new(DVec3::ZERO, positions).unwrap());
    let propagation = Propagation::new(&cloud, None, Preset::Auto.parameters(), &Silent).unwrap();
    let mut document = Document::new(cloud, None);
    document.install(propagation);
    document
}

struct Hand(Random);

impl Hand {
    fn below(&mut self, end: usize) -> usize {
        ((self.0.unit() * end as f64) as usize).min(end - 1)
    }

    fn point(&mut self) -> u32 {
        self.below(N_POINTS) as u32
    }

    fn points(&mut self) -> PointSet {
        let n_points = self.below(30);
        (0..n_points).map(|_| self.point()).collect()
    }

    fn viewer(&mut self) -> Viewer {
        let direction = self.0.direction().as_vec3();
        if self.below(2) == 0 {
            Viewer::At(100.0 * direction)
        } else {
            Viewer::Toward(direction)
        }
    }

    /// Something that a user could do now; `None` where it has nothing to go by.
    fn edit(&mut self, kind: EditKind, document: &Document) -> Option<Edit> {
        let sources: Vec<u32> = document.sources().iter().map(|source| source.point).collect();
        let point = self.point();
        let source = |origin, normal| Source {
            point,
            normal,
            origin,
            patch: None,
        };
        Some(match kind {
            EditKind::Mend => Edit::Mend(point),
            EditKind::TurnPatch => {
                let offer = document.offer(point).unwrap()?;
                let patch = offer.patches[self.below(offer.patches.len())];
                Edit::TurnPatch {
                    point,
                    n_points: patch.n_points,
                }
            }
            EditKind::Seen => {
                let visible = (0..N_POINTS as u32 / 2).collect();
                document.seen(&visible, self.viewer()).unwrap()?
            }
            EditKind::TurnWhole => Edit::TurnWhole(point),
            EditKind::AddSources => Edit::AddSources(vec![source(Origin::Picked, self.0.direction().as_vec3())]),
            EditKind::Rule => Edit::AddSources(vec![source(Origin::Rule(SideRule::Up), Vec3::Z)]),
            EditKind::RemoveSources if sources.is_empty() => return None,
            EditKind::FlipSources if sources.is_empty() => return None,
            EditKind::RemoveSources => Edit::RemoveSources(vec![sources[self.below(sources.len())]]),
            EditKind::FlipSources => Edit::FlipSources(vec![sources[self.below(sources.len())]]),
            EditKind::FlipPoints => Edit::FlipPoints {
                points: self.points(),
                reason: FlipReason::Asked,
            },
            EditKind::FlipSuspect => Edit::FlipPoints {
                points: self.points(),
                reason: FlipReason::Suspect,
            },
            EditKind::FaceMe => {
                let selected = self.points();
                Edit::FlipPoints {
                    points: document.facing_away(&selected, self.viewer()).unwrap(),
                    reason: FlipReason::FaceMe,
                }
            }
            EditKind::Pin => Edit::Pin(self.points()),
            EditKind::Unpin => Edit::Unpin(document.marks().pinned().clone()),
            EditKind::PropagateFrom => Edit::PropagateFrom(self.points()),
            EditKind::PropagateInside => Edit::PropagateInside(self.points()),
            EditKind::Select => Edit::Select(self.points()),
            EditKind::Hide => Edit::Hide(self.points()),
            EditKind::Accept => Edit::Accept(self.points()),
            EditKind::SetParameters => Edit::SetParameters(Parameters {
                k_graph: 4 + self.below(9),
                ..document.parameters()
            }),
            EditKind::SetScanner => Edit::SetScanner(ScannerChoice {
                without_file: self.below(2) == 0,
                own: [crate::evidence::Station {
                    points: 0..7,
                    position: self.0.direction(),
                }]
                .into(),
            }),
            EditKind::SetViewpoints => {
                let n_places = self.below(4);
                Edit::SetViewpoints((0..n_places).map(|_| self.0.direction().as_vec3()).collect())
            }
            EditKind::Recipe => return None,
        })
    }
}

#[test]
fn a_thousand_edits_of_every_kind_are_undone_and_done_again() {
    let mut document = document();
    let state_of = |document: &Document| (document.state().clone(), document.orientation().unwrap().clone());
    let mut states = vec![state_of(&document)];
    let mut hand = Hand(Random::new(7));
    let mut done = BTreeSet::new();
    while states.len() <= N_EDITS {
        let kind = EditKind::ALL[hand.below(EditKind::ALL.len())];
        let revision = document.revision();
        if kind == EditKind::Recipe {
            // What a recipe says is one step, whatever it changes.
            let (wanted, _) = states[hand.below(states.len())].clone();
            let change = StateChange::between(document.state(), &wanted);
            document.apply_recorded(kind, change, 0).unwrap();
        } else if let Some(edit) = hand.edit(kind, &document) {
            assert_eq!(edit.kind(), kind);
            // A pinned point or a vouched patch is refused; then nothing changes.
            let preview = document.preview(&edit);
            assert_eq!(document.apply(edit), preview);
        }
        if document.revision() == revision {
            assert_eq!(&state_of(&document), &states[states.len() - 1]);
        } else {
            done.insert(kind);
            states.push(state_of(&document));
        }
    }
    assert_eq!(done, BTreeSet::from(EditKind::ALL));
    for expect in states.iter().rev().skip(1) {
        assert!(document.undo().is_some());
        assert_eq!(&state_of(&document), expect);
    }
    assert!(document.undo().is_none());
    for expect in states.iter().skip(1) {
        assert!(document.redo().is_some());
        assert_eq!(&state_of(&document), expect);
    }
    assert!(document.redo().is_none());
}
