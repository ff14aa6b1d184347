//! Who vouches for which point.

use std::collections::BTreeMap;

use glam::Vec3;

use crate::SideRule;

/// Where a source comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Origin {
    /// The user's click.
    Picked,
    /// A component's default source (its point farthest along +z), vouched for when the user first mended a patch beside
    /// it.
    Default,
    /// A selection that was said to be right, and that the rest follows.
    Selected,
    /// The user's own view, which sees its right side.
    Seen,
    /// A rule for the right side of a component.
    Rule(SideRule),
    /// Viewpoints around the cloud that see it (Liu et al. §3.4).
    Voted,
}

impl Origin {
    /// All origins, in the order of lists; one for each rule.
    pub const ALL: [Self; 11] = [
        Self::Picked,
        Self::Default,
        Self::Selected,
        Self::Seen,
        Self::Rule(SideRule::Automatic),
        Self::Rule(SideRule::Outward),
        Self::Rule(SideRule::TowardScanner),
        Self::Rule(SideRule::Up),
        Self::Rule(SideRule::IntoRoom),
        Self::Rule(SideRule::Given),
        Self::Voted,
    ];

    /// The name in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Picked => "picked",
            Self::Default => "default",
            Self::Selected => "selected",
            Self::Seen => "seen",
            Self::Rule(rule) => rule.name(),
            Self::Voted => "voted",
        }
    }

    /// The name in lists.
    pub fn label(self) -> &'static str {
        match self {
            Self::Picked => "Picked",
            Self::Default => "Default",
            Self::Selected => "Selection",
            Self::Seen => "Seen",
            Self::Rule(_) => "Rule",
            Self::Voted => "Voted",
        }
    }
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
    /// The patch that has the source's side as a whole, as far as no other source says otherwise; `None` for the point alone.
    pub patch: Option<SourcePatch>,
}

/// The patch that a source was made to turn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SourcePatch {
    /// Names the patch: the smallest around the source's point of at least so many points. So it is found again among the
    /// patches of other parameters.
    pub n_points: u32,
    /// Whether mends had turned what is around the patch away from the side it starts with; else the patch is turned
    /// where its source does not vouch for the side it starts with.
    pub amid_mended: bool,
}

impl Source {
    /// Whether a `stored` unit normal of this point must turn to point to the vouched side: their dot product is
    /// negative.
    ///
    /// A perpendicular direction has no side, so its first component that is not zero decides; opposite directions thus
    /// always want opposite signs.
    pub fn turns(&self, stored: Vec3) -> bool {
        direction_turns(self.normal, stored)
    }

    /// The same source vouching for the opposite side; its patch turns.
    pub fn opposite(self) -> Self {
        Self {
            normal: -self.normal,
            ..self
        }
    }

    /// The same source vouching for the opposite side, as a part of something larger that turns: its patch stays turned or
    /// not against what is around it.
    pub fn opposite_amid_opposite(self) -> Self {
        let patch = self.patch.map(|patch| SourcePatch {
            amid_mended: !patch.amid_mended,
            ..patch
        });
        Self {
            patch,
            ..self.opposite()
        }
    }
}

/// Whether a `stored` normal must turn to point to the side of `direction`; see [`Source::turns`].
pub(crate) fn direction_turns(direction: Vec3, stored: Vec3) -> bool {
    let dot = direction.dot(stored);
    if dot != 0.0 {
        return dot < 0.0;
    }
    let first = direction.to_array().into_iter().find(|&component| component != 0.0);
    first.is_some_and(|component| component < 0.0)
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

    /// Whether there is a source at `point`.
    pub fn contains(&self, point: u32) -> bool {
        self.by_point.contains_key(&point)
    }

    /// All sources, ascending by point.
    pub fn iter(&self) -> impl ExactSizeIterator<Item = &Source> + DoubleEndedIterator {
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

#[cfg(test)]
mod tests {
    use super::*;

    fn source(normal: Vec3) -> Source {
        Source {
            point: 3,
            normal,
            origin: Origin::Picked,
            patch: None,
        }
    }

    #[test]
    fn turns_when_the_stored_normal_points_away() {
        assert!(!source(Vec3::Z).turns(Vec3::new(0.6, 0.0, 0.8)));
        assert!(source(Vec3::Z).turns(Vec3::new(0.6, 0.0, -0.8)));
    }

    #[test]
    fn opposite_directions_want_opposite_signs_even_across_a_right_angle() {
        for normal in [
            Vec3::X,
            Vec3::Y,
            -Vec3::Y,
            Vec3::new(0.0, -0.0, 1.0),
            Vec3::new(0.6, 0.8, 0.0),
        ] {
            for stored in [Vec3::X, Vec3::Y, Vec3::Z] {
                let source = source(normal);
                assert_ne!(
                    source.turns(stored),
                    source.opposite().turns(stored),
                    "{normal} on {stored}"
                );
            }
        }
    }

    #[test]
    fn one_source_a_point_ascending() {
        let mut sources = Sources::default();
        let at = |point, normal| Source {
            point,
            ..source(normal)
        };
        assert_eq!(sources.insert(at(7, Vec3::X)), None);
        assert_eq!(sources.insert(at(2, Vec3::Y)), None);
        assert_eq!(sources.insert(at(7, Vec3::Z)), Some(at(7, Vec3::X)));
        assert_eq!(sources.iter().map(|source| source.point).collect::<Vec<_>>(), [2, 7]);
        assert!(sources.contains(2) && !sources.contains(3));
        assert_eq!(sources.remove(2), Some(at(2, Vec3::Y)));
        assert_eq!((sources.len(), sources.is_empty()), (1, false));
    }
}
