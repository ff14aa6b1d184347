//! Points whose sign is set for themselves alone, over what the sources say.
//!
//! A mark does not spread: flipping a selection turns exactly the selection, and pinning it turns nothing. A region that turns
//! takes its marked points along, unless they are pinned: those stay.
//!
//! Invariant: a marked point shows the direction of its mark; any other what its region says.

use std::collections::BTreeMap;

use glam::Vec3;

use crate::sources::direction_turns;
use crate::{Change, Orientation, PointSet, Propagation, Regions};

/// The direction of one point, set for itself alone.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mark {
    /// The direction that the point's normal shall have, unit length.
    pub normal: Vec3,
    /// Whether it is protected: nothing turns it but to unpin it first.
    pub pinned: bool,
}

impl Mark {
    /// The same mark for the opposite direction.
    pub fn opposite(self) -> Self {
        Self {
            normal: -self.normal,
            ..self
        }
    }

    /// Whether a `stored` unit normal of the point must turn; see [`crate::Source::turns`].
    pub fn turns(&self, stored: Vec3) -> bool {
        direction_turns(self.normal, stored)
    }
}

/// The marks of a document, by point id.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Marks {
    by_point: BTreeMap<u32, Mark>,
    /// The points that are pinned, and the others.
    pinned: PointSet,
    free: PointSet,
}

impl Marks {
    /// How many there are.
    pub fn len(&self) -> usize {
        self.by_point.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.by_point.is_empty()
    }

    /// How many of them are pinned.
    pub fn n_pinned(&self) -> usize {
        self.pinned.len() as usize
    }

    /// The points whose marks are pinned.
    pub fn pinned(&self) -> &PointSet {
        &self.pinned
    }

    /// The points whose marks are not pinned.
    pub fn free(&self) -> &PointSet {
        &self.free
    }

    /// The mark at `point`.
    pub fn get(&self, point: u32) -> Option<&Mark> {
        self.by_point.get(&point)
    }

    /// Whether the point is pinned.
    pub fn is_pinned(&self, point: u32) -> bool {
        self.get(point).is_some_and(|mark| mark.pinned)
    }

    /// All marks with their points, ascending by point.
    pub fn iter(&self) -> impl ExactSizeIterator<Item = (u32, &Mark)> {
        self.by_point.iter().map(|(&point, mark)| (point, mark))
    }

    /// Sets the mark at `point`, or takes it away; returns the one before.
    pub(super) fn set(&mut self, point: u32, mark: Option<Mark>) -> Option<Mark> {
        let before = match mark {
            Some(mark) => self.by_point.insert(point, mark),
            None => self.by_point.remove(&point),
        };
        set(&mut self.pinned, point, mark.is_some_and(|mark| mark.pinned));
        set(&mut self.free, point, mark.is_some_and(|mark| !mark.pinned));
        before
    }
}

/// The signs that are shown: those of the regions, with the marks over them.
#[derive(Clone, Debug)]
pub(super) struct Overlay {
    shown: Orientation,
    /// Positions of marks.
    marked: PointSet,
    /// Those of them that are pinned.
    pinned: PointSet,
}

impl Overlay {
    /// The signs of `regions`, no marks yet.
    pub fn new(regions: &Regions) -> Self {
        Self {
            shown: regions.orientation().clone(),
            marked: PointSet::new(),
            pinned: PointSet::new(),
        }
    }

    /// The signs that are shown, by position.
    pub fn shown(&self) -> &Orientation {
        &self.shown
    }

    /// Brings the shown signs in line after the regions turned and the marks at some points changed. Returns the positions that turn.
    pub fn show(
        &mut self,
        propagation: &Propagation,
        regions: &Regions,
        marks: &Marks,
        turned: &Change,
        changed: impl Iterator<Item = u32>,
    ) -> Change {
        let tree = &propagation.tree;
        let mut looked_at = PointSet::new();
        for range in turned.ranges() {
            self.shown.flip(range.clone());
            looked_at.extend(self.marked.range(range.clone()));
        }
        for point in changed {
            let position = tree.position(point);
            set(&mut self.marked, position, marks.get(point).is_some());
            set(&mut self.pinned, position, marks.is_pinned(point));
            looked_at.insert(position);
        }
        let mut flips = turned.ranges().to_vec();
        for position in looked_at {
            let point = tree.order()[position as usize];
            let wanted = marks.get(point).map_or_else(
                || regions.orientation().is_turned(position),
                |mark| mark.turns(propagation.normals[point as usize]),
            );
            if self.shown.is_turned(position) != wanted {
                self.shown.flip(position..position + 1);
                flips.push(position..position + 1);
            }
        }
        Change::from_flips(&flips)
    }

    /// The positions of marks in a range, ascending.
    pub fn marked_in(&self, range: std::ops::Range<u32>) -> impl Iterator<Item = u32> {
        self.marked.range(range)
    }

    /// The marked positions among those of `turned` that are not pinned: they go along.
    pub fn along(&self, turned: &Change) -> Vec<u32> {
        let ranges = turned.ranges().iter().cloned();
        let marked = ranges.flat_map(|range| self.marked.range(range));
        marked.filter(|&position| !self.pinned.contains(position)).collect()
    }

    /// `turned` without the pinned positions.
    pub fn without_pinned(&self, turned: Change) -> Change {
        if self.pinned.is_empty() {
            return turned;
        }
        let mut flips = turned.ranges().to_vec();
        let held = turned
            .ranges()
            .iter()
            .cloned()
            .flat_map(|range| self.pinned.range(range));
        flips.extend(held.map(|position| position..position + 1));
        Change::from_flips(&flips)
    }

    /// How many pinned positions are among those of `turned`.
    pub fn n_pinned_in(&self, turned: &Change) -> u64 {
        let ranges = turned.ranges().iter().cloned();
        ranges.map(|range| self.pinned.range_cardinality(range)).sum()
    }
}

/// Puts a point or position into a set, or takes it out.
fn set(members: &mut PointSet, member: u32, holds: bool) {
    if holds {
        members.insert(member);
    } else {
        members.remove(member);
    }
}
