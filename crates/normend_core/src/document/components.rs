//! Edits of whole components: all of one turns as it is, whatever sources and cuts are in it.

use std::collections::BTreeMap;

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

impl Document {
    /// The edit that shows each of these components the side that a rule found for it: those that must turn do so as they are, and a
    /// point of each becomes a source of the rule. `None` when there are no components. O(sources and cuts in them).
    ///
    /// # Errors
    /// [`EditError::NotReady`].
    pub fn show_sides(&self, sides: &[ComponentSide]) -> Result<Option<Edit>, EditError> {
        let derived = self.derived.as_ref().ok_or(EditError::NotReady)?;
        let (mut of_rules, mut others) = (BTreeMap::new(), BTreeMap::new());
        for side in sides {
            let Some(&root) = derived.propagation.tree.roots().get(side.component) else {
                continue;
            };
            let point = self.representative(derived, side.component);
            if side.turned {
                self.turn_component(derived, root, point, &mut others);
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
    /// when there is no such component. O(sources and cuts in it).
    ///
    /// # Errors
    /// [`EditError::NotReady`].
    pub fn turn_component_edit(&self, component: usize) -> Result<Option<Edit>, EditError> {
        let derived = self.derived.as_ref().ok_or(EditError::NotReady)?;
        let Some(&root) = derived.propagation.tree.roots().get(component) else {
            return Ok(None);
        };
        let mut sources = BTreeMap::new();
        let point = self.representative(derived, component);
        self.turn_component(derived, root, point, &mut sources);
        // What a rule said is overruled by the user.
        for source in sources.values_mut() {
            if let Origin::Rule(_) = source.origin {
                source.origin = Origin::Picked;
            }
        }
        Ok(Some(Edit::AddSources(sources.into_values().collect())))
    }

    /// The points of a component, by id; empty past the last one. O(m log m) for m points.
    pub fn points_of_component(&self, component: usize) -> PointSet {
        let tree = self.propagation().map(|propagation| &propagation.tree);
        let Some((tree, &root)) = tree.and_then(|tree| Some((tree, tree.roots().get(component)?))) else {
            return PointSet::new();
        };
        let positions = tree.subtree(root);
        let mut points = tree.order()[positions.start as usize..positions.end as usize].to_vec();
        points.sort_unstable();
        points.into_iter().collect()
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
    fn representative(&self, derived: &Derived, component: usize) -> u32 {
        let tree = &derived.propagation.tree;
        let positions = tree.subtree(tree.roots()[component]);
        let points = &tree.order()[positions.start as usize..positions.end as usize];
        let of_rule = self.state.sources.iter().find(|source| {
            let is_inside = positions.contains(&tree.position(source.point));
            is_inside && matches!(source.origin, Origin::Rule(_)) && source.patch.is_none()
        });
        let turns_patch = |point: u32| {
            self.state
                .sources
                .get(point)
                .is_some_and(|source| source.patch.is_some())
        };
        let default = derived.propagation.default_sources.get(component).copied();
        of_rule
            .map(|source| source.point)
            .or(default.filter(|&point| !turns_patch(point)))
            .or_else(|| points.iter().copied().find(|&point| !turns_patch(point)))
            .unwrap_or(points[0])
    }

    /// Adds the sources that turn the component of a root: those that there are, turned, and one for each part without any. The part
    /// of `representative` gets its one there.
    fn turn_component(&self, derived: &Derived, root: u32, representative: u32, turned: &mut BTreeMap<u32, Source>) {
        let propagation = &derived.propagation;
        let tree = &propagation.tree;
        let positions = tree.subtree(root);
        let own = self.state.sources.iter().map(|source| source.point);
        let voted = propagation.voted_sources.iter().map(|source| source.point);
        let mut vouched: Vec<u32> = own
            .chain(voted)
            .map(|point| tree.position(point))
            .filter(|position| positions.contains(position))
            .collect();
        vouched.sort_unstable();
        vouched.dedup();
        for &position in &vouched {
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
        let mut stops = vouched;
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
