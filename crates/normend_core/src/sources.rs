//! Who vouches for which point.

use std::collections::BTreeMap;

use glam::Vec3;

/// Where a source comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Origin {
    /// The user's click.
    Picked,
}

/// A point whose sign somebody vouches for.
///
/// It keeps the vouched *direction*, not a sign: normals are estimated again when parameters change, each with an
/// arbitrary sign, and the source still says which side is right.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Source {
    /// The point's id.
    pub point: u32,
    /// The vouched normal, unit length.
    pub normal: Vec3,
    /// Who vouches.
    pub origin: Origin,
}

/// The sources of a document, by point id, at most one a point.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Sources {
    by_point: BTreeMap<u32, Source>,
}

impl Sources {
    /// How many there are.
    pub fn len(&self) -> usize {
        self.by_point.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.by_point.is_empty()
    }

    /// The source at `point`.
    pub fn get(&self, point: u32) -> Option<&Source> {
        self.by_point.get(&point)
    }

    /// All sources, ascending by point.
    pub fn iter(&self) -> impl Iterator<Item = &Source> {
        self.by_point.values()
    }

    /// Puts `source` in place of the one at its point, which is returned.
    pub fn insert(&mut self, source: Source) -> Option<Source> {
        self.by_point.insert(source.point, source)
    }

    /// Takes the source at `point` out.
    pub fn remove(&mut self, point: u32) -> Option<Source> {
        self.by_point.remove(&point)
    }
}
