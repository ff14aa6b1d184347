//! What each edit changes of the state.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use super::spread::{self, Anchor};
use super::{Derived, Document, Edit, EditError, Mark, StateChange, check_direction, check_scanner, check_viewpoints};
use crate::sources::Origin;
use crate::{PointSet, Source};

impl Document {
    /// What an edit changes; entries of one kind ascend by point.
    pub(super) fn change_of(&self, edit: &Edit) -> Result<StateChange, EditError> {
        let of_sources = |sources: Vec<(u32, Option<Source>)>| StateChange {
            sources,
            ..StateChange::default()
        };
        let toggled = |wanted: &PointSet, present: &PointSet| -> Result<PointSet, EditError> {
            self.check_points(wanted)?;
            Ok(wanted ^ present)
        };
        Ok(match edit {
            &Edit::Mend(point) => of_sources(self.mend(point)?),
            &Edit::TurnPatch { point, n_points } => {
                let derived = self.derived_at(point)?;
                let source = derived.patch_source(point, n_points, Origin::Picked)?;
                of_sources(vec![(point, Some(source))])
            }
            Edit::TurnSeenPatches(patches) => {
                let source = |&(point, n_points): &(u32, u32)| {
                    let source = self.derived_at(point)?.patch_source(point, n_points, Origin::Seen)?;
                    Ok((point, Some(source)))
                };
                of_sources(patches.iter().map(source).collect::<Result<_, EditError>>()?)
            }
            &Edit::TurnWhole(point) => of_sources(self.turn_whole(point)?),
            Edit::AddSources(sources) => {
                let mut after = BTreeMap::new();
                for source in sources {
                    self.check_point(source.point)?;
                    check_direction(source.point, source.normal)?;
                    after.insert(source.point, *source);
                }
                after.retain(|&point, source| self.state.sources.get(point) != Some(source));
                of_sources(after.into_iter().map(|(point, source)| (point, Some(source))).collect())
            }
            Edit::RemoveSources(points) => {
                points.iter().try_for_each(|&point| self.source(point).map(drop))?;
                of_sources(
                    BTreeSet::from_iter(points)
                        .into_iter()
                        .map(|&point| (point, None))
                        .collect(),
                )
            }
            Edit::FlipSources(points) => of_sources(
                BTreeSet::from_iter(points)
                    .into_iter()
                    .map(|&point| Ok((point, Some(self.source(point)?.opposite()))))
                    .collect::<Result<_, EditError>>()?,
            ),
            Edit::FlipPoints { points, .. } => self.flip_points(points)?,
            Edit::Pin(points) => self.pin(points)?,
            Edit::Unpin(points) => self.unpin(points)?,
            Edit::PropagateFrom(points) => self.propagate_from(points)?,
            Edit::PropagateInside(points) => self.propagate_inside(points)?,
            Edit::Select(points) => StateChange {
                selected: toggled(points, &self.state.selected)?,
                ..StateChange::default()
            },
            Edit::Hide(points) => StateChange {
                hidden: toggled(points, &self.state.hidden)?,
                ..StateChange::default()
            },
            Edit::Accept(points) => StateChange {
                accepted: toggled(points, &self.state.accepted)?,
                ..StateChange::default()
            },
            &Edit::SetParameters(parameters) => StateChange {
                parameters: Some(parameters).filter(|&wanted| wanted != self.state.parameters),
                ..StateChange::default()
            },
            Edit::SetViewpoints(places) => {
                check_viewpoints(places)?;
                StateChange {
                    viewpoints: Some(Arc::clone(places)).filter(|wanted| *wanted != self.state.viewpoints),
                    ..StateChange::default()
                }
            }
            Edit::SetScanner(scanner) => {
                check_scanner(scanner)?;
                StateChange {
                    scanner: Some(scanner.clone()).filter(|wanted| *wanted != self.state.scanner),
                    ..StateChange::default()
                }
            }
        })
    }

    fn mend(&self, point: u32) -> Result<Vec<(u32, Option<Source>)>, EditError> {
        let derived = self.derived_at(point)?;
        let mut sources = vec![(point, Some(derived.mended(point, &self.state.sources)))];
        if let Some(default) = derived.default_source_beside(point, &self.state.sources) {
            let source = Source {
                point: default,
                normal: derived.region_normal(default),
                origin: Origin::Default,
                patch: None,
            };
            sources.push((default, Some(source)));
            sources.sort_unstable_by_key(|&(point, _)| point);
        }
        Ok(sources)
    }

    fn turn_whole(&self, point: u32) -> Result<Vec<(u32, Option<Source>)>, EditError> {
        let derived = self.derived_at(point)?;
        let source = match derived.regions.source_of(point) {
            Some(source) => match self.state.sources.get(source) {
                Some(source) => source.opposite_amid_opposite(),
                // A voted source is overruled where it stands.
                None => derived.mended(source, &self.state.sources),
            },
            None => derived.mended(point, &self.state.sources),
        };
        Ok(vec![(source.point, Some(source))])
    }

    /// Marks that give the points at some positions the sign that is asked for, where another is shown. Points whose region says
    /// so already need none.
    fn marks_for(&self, derived: &Derived, wanted: impl Iterator<Item = (u32, bool)>) -> Vec<(u32, Option<Mark>)> {
        let mut marks = Vec::new();
        for (position, turned) in wanted {
            let point = derived.propagation.tree.order()[position as usize];
            let mark = (derived.regions.orientation().is_turned(position) != turned).then(|| Mark {
                normal: derived.normal(point, turned),
                pinned: false,
            });
            if self.state.marks.get(point) != mark.as_ref() {
                marks.push((point, mark));
            }
        }
        marks.sort_unstable_by_key(|&(point, _)| point);
        marks
    }

    /// The positions of points that are not pinned, ascending.
    fn free_positions(&self, derived: &Derived, points: &PointSet) -> Result<Vec<u32>, EditError> {
        self.check_points(points)?;
        let marks = &self.state.marks;
        let free = points.iter().filter(|&point| !marks.is_pinned(point));
        let mut positions: Vec<u32> = free.map(|point| derived.propagation.tree.position(point)).collect();
        if positions.is_empty() && !points.is_empty() {
            return Err(EditError::Pinned { n_pinned: points.len() });
        }
        positions.sort_unstable();
        Ok(positions)
    }

    fn flip_points(&self, points: &PointSet) -> Result<StateChange, EditError> {
        let derived = self.derived.as_ref().ok_or(EditError::NotReady)?;
        let positions = self.free_positions(derived, points)?;
        let shown = derived.overlay.shown();
        let wanted = positions
            .into_iter()
            .map(|position| (position, !shown.is_turned(position)));
        Ok(StateChange {
            marks: self.marks_for(derived, wanted),
            ..StateChange::default()
        })
    }

    fn pin(&self, points: &PointSet) -> Result<StateChange, EditError> {
        let derived = self.derived.as_ref().ok_or(EditError::NotReady)?;
        self.check_points(points)?;
        let pin = |point| Mark {
            normal: derived.oriented_normal(point),
            pinned: true,
        };
        let free = points.iter().filter(|&point| !self.state.marks.is_pinned(point));
        Ok(StateChange {
            marks: free.map(|point| (point, Some(pin(point)))).collect(),
            ..StateChange::default()
        })
    }

    fn unpin(&self, points: &PointSet) -> Result<StateChange, EditError> {
        self.check_points(points)?;
        let pinned = points.iter().filter(|&point| self.state.marks.is_pinned(point));
        let unpinned = pinned.filter_map(|point| {
            let mark = Mark {
                pinned: false,
                ..*self.state.marks.get(point)?
            };
            let says_its_region = self.derived.as_ref().is_some_and(|derived| {
                let position = derived.propagation.tree.position(point);
                let stored = derived.propagation.normals[point as usize];
                mark.turns(stored) == derived.regions.orientation().is_turned(position)
            });
            Some((point, Some(mark).filter(|_| !says_its_region)))
        });
        Ok(StateChange {
            marks: unpinned.collect(),
            ..StateChange::default()
        })
    }

    fn propagate_inside(&self, points: &PointSet) -> Result<StateChange, EditError> {
        let derived = self.derived.as_ref().ok_or(EditError::NotReady)?;
        let positions = self.free_positions(derived, points)?;
        let tree = &derived.propagation.tree;
        let anchor = |position: u32| {
            let point = tree.order()[position as usize];
            let source = self
                .state
                .sources
                .get(point)
                .copied()
                .or_else(|| derived.propagation.voted_source(point));
            source.map(|source| source.turns(derived.propagation.normals[point as usize]))
        };
        let wanted = spread::inside(tree, &positions, derived.overlay.shown(), |position| {
            match anchor(position) {
                Some(turned) => Anchor::Holds(turned),
                None => Anchor::Follows,
            }
        });
        Ok(StateChange {
            marks: self.marks_for(derived, wanted.into_iter()),
            ..StateChange::default()
        })
    }

    fn propagate_from(&self, points: &PointSet) -> Result<StateChange, EditError> {
        let derived = self.derived.as_ref().ok_or(EditError::NotReady)?;
        self.check_points(points)?;
        let tree = &derived.propagation.tree;
        let shown = derived.overlay.shown();
        let mut positions: Vec<u32> = points.iter().map(|point| tree.position(point)).collect();
        positions.sort_unstable();
        let (mut sources, mut marks) = (BTreeMap::new(), BTreeMap::new());
        for group in positions.chunk_by(|&a, &b| tree.component(a) == tree.component(b)) {
            let component = tree.subtree(tree.roots()[tree.component(group[0])]);
            // The sign of each point of the component is phi, or its opposite: what most of the given points say.
            let is_opposite = |position: u32| shown.is_turned(position) != tree.phi(position);
            let n_opposite = group.iter().filter(|&&position| is_opposite(position)).count();
            let opposite = 2 * n_opposite > group.len();
            let wanted = |position: u32| tree.phi(position) != opposite;
            let source = |position: u32| {
                let point = tree.order()[position as usize];
                Source {
                    point,
                    normal: derived.normal(point, wanted(position)),
                    origin: Origin::Selected,
                    patch: None,
                }
            };
            for old in self.state.sources.iter() {
                if component.contains(&tree.position(old.point)) {
                    sources.insert(old.point, None);
                }
            }
            for position in derived.overlay.marked_in(component.clone()) {
                let point = tree.order()[position as usize];
                if !self.state.marks.is_pinned(point) {
                    marks.insert(point, None);
                }
            }
            let base = &derived.propagation.base_regions;
            // Where the component is cut, or voted for, each part needs its own source; the given points have one in any case.
            let says_else = |&position: &u32| base.orientation().is_turned(position) != wanted(position);
            let tops = base.base_tops(component.clone()).filter(says_else);
            let voted = derived.propagation.voted_sources.iter();
            let voted = voted
                .map(|voted| tree.position(voted.point))
                .filter(|position| component.contains(position));
            let spreads = group
                .iter()
                .find(|&&position| is_opposite(position) == opposite)
                .copied();
            for position in tops.chain(voted.filter(says_else)).chain(spreads) {
                let source = source(position);
                sources.insert(source.point, Some(source));
            }
            for &position in group {
                let point = tree.order()[position as usize];
                if shown.is_turned(position) != wanted(position) && !self.state.marks.is_pinned(point) {
                    let mark = Mark {
                        normal: derived.normal(point, shown.is_turned(position)),
                        pinned: false,
                    };
                    marks.insert(point, Some(mark));
                }
            }
        }
        let present = &self.state;
        sources.retain(|&point, source| present.sources.get(point) != source.as_ref());
        marks.retain(|&point, mark| present.marks.get(point) != mark.as_ref());
        Ok(StateChange {
            sources: sources.into_iter().collect(),
            marks: marks.into_iter().collect(),
            ..StateChange::default()
        })
    }
}
