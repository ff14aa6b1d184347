//! The ground state of a document: all that a user decides, and changes of it that are their own way back.
//!
//! Invariant: [`State::change`] returns the change that restores the state before, bit for bit.
//! Not here: what follows from the state, see [`super::Document`].

use std::sync::Arc;

use glam::Vec3;

use super::Marks;
use crate::evidence::Station;
use crate::{Mark, Parameters, PointSet, Source, Sources};

/// What the user decides about the places of the scanner.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ScannerChoice {
    /// The places that came with the scan count for nothing.
    pub without_file: bool,
    /// The user's own places.
    pub own: Arc<[Station]>,
}

/// All that a user decides about a cloud. Everything else is derived from it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct State {
    /// Points whose sign is vouched for and spreads.
    pub sources: Sources,
    /// Points whose sign is set for themselves alone.
    pub marks: Marks,
    /// The selected points.
    pub selected: PointSet,
    /// The points that are not shown.
    pub hidden: PointSet,
    /// The points that the user looked at and accepts as they are: no suspects any more.
    pub accepted: PointSet,
    /// The parameters that are wanted; those in force are the propagation's.
    pub parameters: Parameters,
    /// Viewpoints that vote for sources instead of the usual ones, in the cloud's own space; empty for the usual ones.
    pub viewpoints: Arc<[Vec3]>,
    /// The places of the scanner.
    pub scanner: ScannerChoice,
}

/// A change of the state: what is there after it.
///
/// Small, and all that is needed to make it again on another machine: sources and marks hold directions, sets hold points.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct StateChange {
    /// Points with the source that each has afterwards; they are set in this order.
    pub sources: Vec<(u32, Option<Source>)>,
    /// Points with the mark that each has afterwards.
    pub marks: Vec<(u32, Option<Mark>)>,
    /// The points that join or leave the selection.
    pub selected: PointSet,
    /// The points that are hidden or shown again.
    pub hidden: PointSet,
    /// The points that are accepted or not any more.
    pub accepted: PointSet,
    /// The parameters, where they change.
    pub parameters: Option<Parameters>,
    /// The viewpoints, where they change.
    pub viewpoints: Option<Arc<[Vec3]>>,
    /// The places of the scanner, where they change.
    pub scanner: Option<ScannerChoice>,
}

impl StateChange {
    /// What makes one state of another.
    pub fn between(before: &State, after: &State) -> Self {
        let gone = before.sources.iter().map(|source| (source.point, None));
        let gone = gone.filter(|&(point, _)| !after.sources.contains(point));
        let new = (after.sources.iter()).filter(|source| before.sources.get(source.point) != Some(source));
        let mut sources: Vec<_> = gone.chain(new.map(|source| (source.point, Some(*source)))).collect();
        sources.sort_unstable_by_key(|&(point, _)| point);
        let gone = before.marks.iter().map(|(point, _)| (point, None));
        let gone = gone.filter(|&(point, _)| after.marks.get(point).is_none());
        let new = (after.marks.iter()).filter(|&(point, mark)| before.marks.get(point) != Some(mark));
        let mut marks: Vec<_> = gone.chain(new.map(|(point, mark)| (point, Some(*mark)))).collect();
        marks.sort_unstable_by_key(|&(point, _)| point);
        Self {
            sources,
            marks,
            selected: &before.selected ^ &after.selected,
            hidden: &before.hidden ^ &after.hidden,
            accepted: &before.accepted ^ &after.accepted,
            parameters: (before.parameters != after.parameters).then_some(after.parameters),
            viewpoints: (before.viewpoints != after.viewpoints).then(|| Arc::clone(&after.viewpoints)),
            scanner: (before.scanner != after.scanner).then(|| after.scanner.clone()),
        }
    }

    /// Whether it changes nothing.
    pub fn is_empty(&self) -> bool {
        !self.is_of_signs() && self.selected.is_empty() && self.hidden.is_empty() && self.accepted.is_empty()
    }

    /// Whether it can change the sign of any point: sources, marks, parameters, viewpoints or places of the scanner.
    pub fn is_of_signs(&self) -> bool {
        let is_of_orienting = self.parameters.is_some() || self.viewpoints.is_some() || self.scanner.is_some();
        !self.sources.is_empty() || !self.marks.is_empty() || is_of_orienting
    }

    /// How many points it names, the largest of its parts.
    pub fn n_points(&self) -> u64 {
        let lists = (self.sources.len() as u64).max(self.marks.len() as u64);
        let sets = [&self.selected, &self.hidden, &self.accepted].map(PointSet::len);
        sets.into_iter().fold(lists, u64::max)
    }

    /// The largest point id that it names; `None` when it names none.
    pub fn largest_point(&self) -> Option<u32> {
        let sources = self.sources.iter().map(|&(point, _)| point).max();
        let marks = self.marks.iter().map(|&(point, _)| point).max();
        let sets = [&self.selected, &self.hidden, &self.accepted].map(PointSet::max);
        sets.into_iter().fold(sources.max(marks), Option::max)
    }

    /// Bytes on the heap, about.
    pub(super) fn heap_bytes(&self) -> usize {
        let sets = [&self.selected, &self.hidden, &self.accepted].map(PointSet::serialized_size);
        size_of_val(&*self.sources)
            + size_of_val(&*self.marks)
            + sets.into_iter().sum::<usize>()
            + self.viewpoints.as_ref().map_or(0, |places| size_of_val(&**places))
            + self.scanner.as_ref().map_or(0, |scanner| size_of_val(&*scanner.own))
    }
}

impl State {
    /// Makes a change; returns the one that takes it back.
    pub fn change(&mut self, change: &StateChange) -> StateChange {
        // Backwards, because a cut undone in reverse has the region it made.
        let mut sources: Vec<_> = (change.sources.iter())
            .map(|&(point, source)| {
                let before = match source {
                    Some(source) => self.sources.insert(source),
                    None => self.sources.remove(point),
                };
                (point, before)
            })
            .collect();
        sources.reverse();
        let mut marks: Vec<_> = (change.marks.iter())
            .map(|&(point, mark)| (point, self.marks.set(point, mark)))
            .collect();
        marks.reverse();
        self.selected ^= &change.selected;
        self.hidden ^= &change.hidden;
        self.accepted ^= &change.accepted;
        StateChange {
            sources,
            marks,
            selected: change.selected.clone(),
            hidden: change.hidden.clone(),
            accepted: change.accepted.clone(),
            parameters: (change.parameters).map(|parameters| std::mem::replace(&mut self.parameters, parameters)),
            viewpoints: (change.viewpoints.clone()).map(|places| std::mem::replace(&mut self.viewpoints, places)),
            scanner: (change.scanner.clone()).map(|scanner| std::mem::replace(&mut self.scanner, scanner)),
        }
    }
}
