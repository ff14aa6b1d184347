//! Edits of whole components: all of one turns as it is, whatever sources and cuts are in it.

use std::collections::BTreeMap;
use std::ops::Range;

use super::{Derived, Document, Edit, EditError};
use crate::sources::Origin;
use crate::{PointSet, SideRule, Source};

/// The side that a rule found for a component.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ComponentSide {
    /// The component, as an index of the tree's roots.
    pub component: usize,
    /// The rule that decided.
    pub rule: SideRule,
    /// Whether the component must turn against what it shows.
    pub turned: bool,
}

/// Who vouches for points of which component, gathered once for many components.
struct Vouched {
    /// The positions of sources, of the document and voted, ascending.
    positions: Vec<u32>,
    /// By component: the point where a rule has a source.
    by_rule: BTreeMap<usize, u32>,
}

impl Vouched {
    fn new(document: &Document, derived: &Derived) -> Self {
        let tree = &derived.propagation.tree;
        let own = &document.state.sources;
        let is_of_rule = |source: &&Source| matches!(source.origin, Origin::Rule(_)) && source.patch.is_none();
        let of_rules = own.iter().filter(is_of_rule);
        let by_rule = of_rules.map(|source| (tree.component(tree.position(source.point)), source.point));
        let voted = derived.propagation.voted_sources.iter();
        let points = own
            .iter()
            .map(|source| source.point)
            .chain(voted.map(|source| source.point));
        let mut positions: Vec<u32> = points.map(|point| tree.position(point)).collect();
        positions.sort_unstable();
        positions.dedup();
        Self {
            by_rule: by_rule.collect(),
            positions,
        }
    }

    /// The positions in a range.
    fn within(&self, range: &Range<u32>) -> &[u32] {
        let [start, end] =
            [range.start, range.end].map(|end| self.positions.partition_point(|&position| position < end));
        &self.positions[start..end]
    }
}

impl Document {
    /// The edit that shows each of these components the side that a rule found for it: those that must turn do so as they are, and a
    /// point of each becomes a source of the rule. `None` when there are no components. O(sources + cuts in them).
    ///
    /// # Errors
    /// [`EditError::NotReady`].
    pub fn show_sides(&self, sides: &[ComponentSide]) -> Result<Option<Edit>, EditError> {
        let derived = self.derived.as_ref().ok_or(EditError::NotReady)?;
        let vouched = Vouched::new(self, derived);
        let (mut of_rules, mut others) = (BTreeMap::new(), BTreeMap::new());
        for side in sides {
            let Some(&root) = derived.propagation.tree.roots().get(side.component) else {
                continue;
            };
            let point = self.representative(derived, &vouched, side.component);
            if side.turned {
                self.turn_component(derived, &vouched, root, point, &mut others);
            }
            others.remove(&point);
            let shown = derived.region_normal(point);
            let source = Source {
                point,
                normal: if side.turned { -shown } else { shown },
                origin: Origin::Rule(side.rule),
                patch: None,
            };
            of_rules.insert(point, source);
        }
        // Those of rules first: they give the edit its name.
        let sources: Vec<Source> = of_rules.into_values().chain(others.into_values()).collect();
        Ok((!sources.is_empty()).then_some(Edit::AddSources(sources)))
    }

    /// The edit that turns a component as it is: its sources change to the opposite direction, and parts without one get one. `None`
    /// when there is no such component. O(sources + cuts in it).
    ///
    /// # Errors
    /// [`EditError::NotReady`].
    pub fn turn_component_edit(&self, component: usize) -> Result<Option<Edit>, EditError> {
        let derived = self.derived.as_ref().ok_or(EditError::NotReady)?;
        let Some(&root) = derived.propagation.tree.roots().get(component) else {
            return Ok(None);
        };
        let vouched = Vouched::new(self, derived);
        let mut sources = BTreeMap::new();
        let point = self.representative(derived, &vouched, component);
        self.turn_component(derived, &vouched, root, point, &mut sources);
        // What a rule said is overruled by the user.
        for source in sources.values_mut() {
            if let Origin::Rule(_) = source.origin {
                source.origin = Origin::Picked;
            }
        }
        Ok(Some(Edit::AddSources(sources.into_values().collect())))
    }

    /// The unpinned marks that show another side than their region does: flipping them takes what the user flipped back. O(marks).
    pub fn flipped_alone(&self) -> PointSet {
        let Some(derived) = &self.derived else {
            return PointSet::new();
        };
        let differs = |point: u32| {
            let position = derived.propagation.tree.position(point);
            derived.overlay.shown().is_turned(position) != derived.regions.orientation().is_turned(position)
        };
        let free = self.state.marks.iter().filter(|(_, mark)| !mark.pinned);
        free.map(|(point, _)| point).filter(|&point| differs(point)).collect()
    }

    /// The point of a component that stands for it: where a rule has a source already, else the default source, else the first point
    /// that turns no patch of its own.
    fn representative(&self, derived: &Derived, vouched: &Vouched, component: usize) -> u32 {
        let tree = &derived.propagation.tree;
        let positions = tree.subtree(tree.roots()[component]);
        let points = &tree.order()[positions.start as usize..positions.end as usize];
        let turns_patch = |point: u32| {
            self.state
                .sources
                .get(point)
                .is_some_and(|source| source.patch.is_some())
        };
        let default = derived.propagation.default_sources.get(component).copied();
        let of_rule = vouched.by_rule.get(&component).copied();
        of_rule
            .or(default.filter(|&point| !turns_patch(point)))
            .or_else(|| points.iter().copied().find(|&point| !turns_patch(point)))
            .unwrap_or(points[0])
    }

    /// Adds the sources that turn the component of a root: those that there are, turned, and one for each part without any. The part
    /// of `representative` gets its one there.
    fn turn_component(
        &self,
        derived: &Derived,
        vouched: &Vouched,
        root: u32,
        representative: u32,
        turned: &mut BTreeMap<u32, Source>,
    ) {
        let propagation = &derived.propagation;
        let tree = &propagation.tree;
        let positions = tree.subtree(root);
        let vouched = vouched.within(&positions);
        for &position in vouched {
            let point = tree.order()[position as usize];
            let source = match self.state.sources.get(point) {
                Some(source) => source.opposite_amid_opposite(),
                // A voted source is overruled where it stands.
                None => derived.mended(point, &self.state.sources),
            };
            turned.insert(point, source);
        }
        // The innermost part around each vouched point has a source; parts are nested, so those still open are a stack.
        let tops: Vec<u32> = propagation.base_regions.base_tops(positions).collect();
        let mut has_source = vec![false; tops.len()];
        let mut holder = None;
        let mut open: Vec<usize> = Vec::new();
        let mut next_top = 0;
        let mut visit = |position: u32| {
            while let Some(&top) = tops.get(next_top).filter(|&&top| top <= position) {
                while open.last().is_some_and(|&last| tree.subtree(tops[last]).end <= top) {
                    open.pop();
                }
                open.push(next_top);
                next_top += 1;
            }
            while open
                .last()
                .is_some_and(|&last| tree.subtree(tops[last]).end <= position)
            {
                open.pop();
            }
            open.last().copied()
        };
        let stands_at = tree.position(representative);
        let mut stops = vouched.to_vec();
        if let Err(index) = stops.binary_search(&stands_at) {
            stops.insert(index, stands_at);
        }
        for position in stops {
            let Some(part) = visit(position) else { continue };
            let point = tree.order()[position as usize];
            if turned.contains_key(&point) {
                has_source[part] = true;
            }
            if position == stands_at {
                holder = Some(part);
            }
        }
        for (part, &top) in tops.iter().enumerate() {
            if !has_source[part] {
                let point = if holder == Some(part) {
                    representative
                } else {
                    tree.order()[top as usize]
                };
                turned.insert(point, derived.mended(point, &self.state.sources));
            }
        }
    }
}
