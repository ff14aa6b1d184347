//! What holds together: a name for the region of each point, to show regions by.
//!
//! A name is the id of a point: the source that the point follows, or where there is none the point that would be its default
//! source. So names stay what they are when other regions change.

use std::cmp::Reverse;
use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;

use super::{Derived, Document};
use crate::patches::Patch;
use crate::{Change, SpanningTree};

/// The regions of a document at one moment, to be read in another thread.
#[derive(Clone, Debug)]
pub struct RegionNames(Derived);

impl RegionNames {
    /// As [`Document::region_names`].
    pub fn of(&self, range: Range<u32>) -> Vec<u32> {
        self.0.region_names(range)
    }

    /// The tree whose positions are meant.
    pub fn tree(&self) -> &SpanningTree {
        &self.0.propagation.tree
    }
}

impl Document {
    /// The name of the region of each position of `range` of the tree's preorder: the point of the source that it follows, or of
    /// the innermost patch that a source has there. Nothing before the first [`Self::install`].
    ///
    /// O(positions + depth of the tree + sources with patches).
    pub fn region_names(&self, range: Range<u32>) -> Vec<u32> {
        let derived = self.derived.as_ref();
        derived.map_or_else(Vec::new, |derived| derived.region_names(range))
    }

    /// The regions as they are now; `None` before the first [`Self::install`]. Copies a few bits a point.
    pub fn snapshot_of_regions(&self) -> Option<RegionNames> {
        self.derived.clone().map(RegionNames)
    }

    /// Where regions begin and how they are called, to find out later what has another name. O(sources).
    pub fn region_outline(&self) -> RegionOutline {
        self.derived
            .as_ref()
            .map_or_else(RegionOutline::default, Derived::outline)
    }

    /// The positions that have another name now than when the document had the outline `before`, under the same propagation; maybe
    /// some more. O(sources + ranges).
    pub fn renamed_since(&self, before: &RegionOutline) -> Change {
        let Some(derived) = &self.derived else {
            return Change::default();
        };
        let now = derived.outline();
        let mut ranges = Vec::new();
        let tops: BTreeSet<u32> = before.tops.keys().chain(now.tops.keys()).copied().collect();
        for top in tops {
            let base = || derived.regions.is_base_top(top).then(|| derived.base_name(top));
            let name = |outline: &RegionOutline| outline.tops.get(&top).copied().or_else(base);
            if name(before) != name(&now) {
                let counts = |source: u32| !now.with_patch.contains(&source);
                ranges.extend(derived.regions.ranges_below(top, counts));
            }
        }
        if let Some(turned) = &derived.turned {
            for &(_, _, patch) in before.patches.symmetric_difference(&now.patches) {
                let positions = turned.patches().positions(patch, &derived.propagation.tree);
                ranges.extend_from_slice(positions.ranges());
            }
        }
        union(ranges)
    }
}

/// Where regions begin and how they are called: those that have a source.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct RegionOutline {
    /// The name of each region that a source gives, by its top.
    tops: BTreeMap<u32, u32>,
    /// The sources that have a patch. Of such the patch is shown, and not what its tree edge separates besides.
    with_patch: BTreeSet<u32>,
    /// Their patches, the innermost last, each with its source.
    patches: BTreeSet<(Reverse<u32>, u32, Patch)>,
}

impl Derived {
    fn outline(&self) -> RegionOutline {
        let patches: BTreeSet<_> = (self.turned.iter())
            .flat_map(|turned| turned.sources().map(|source| (turned.patches(), source)))
            .filter_map(|(all, source)| {
                let patch = all.find(source.point, source.patch?.n_points);
                Some((Reverse(patch.n_points), source.point, patch))
            })
            .collect();
        let with_patch: BTreeSet<u32> = patches.iter().map(|&(_, point, _)| point).collect();
        let tops = self.regions.source_tops();
        RegionOutline {
            tops: tops.filter(|(_, source)| !with_patch.contains(source)).collect(),
            with_patch,
            patches,
        }
    }

    /// The name of a base region without a source, by its top.
    fn base_name(&self, top: u32) -> u32 {
        let tree = &self.propagation.tree;
        let component = tree.component(top);
        let default = self.propagation.default_sources.get(component).copied();
        let is_its = |&default: &u32| self.regions.base_top_of(default) == top;
        default.filter(is_its).unwrap_or(tree.order()[top as usize])
    }

    fn region_names(&self, range: Range<u32>) -> Vec<u32> {
        let outline = self.outline();
        let tops = self
            .regions
            .tops_of(range.clone(), |source| !outline.with_patch.contains(&source));
        let mut names = Vec::with_capacity(tops.len());
        let mut last = None;
        for (top, source) in tops {
            // Neighbors in preorder mostly share their top.
            let name = match last {
                Some((same, name)) if same == top => name,
                _ => source.unwrap_or_else(|| self.base_name(top)),
            };
            last = Some((top, name));
            names.push(name);
        }
        if let Some(turned) = &self.turned {
            for &(_, point, patch) in &outline.patches {
                for positions in turned.patches().positions(patch, &self.propagation.tree).ranges() {
                    let start = positions.start.max(range.start);
                    let end = positions.end.min(range.end);
                    if start < end {
                        names[(start - range.start) as usize..(end - range.start) as usize].fill(point);
                    }
                }
            }
        }
        names
    }
}

/// The positions that are in any of `ranges`.
fn union(mut ranges: Vec<Range<u32>>) -> Change {
    ranges.sort_unstable_by_key(|range| (range.start, range.end));
    let mut joined: Vec<Range<u32>> = Vec::with_capacity(ranges.len());
    for range in ranges {
        match joined.last_mut() {
            Some(last) if range.start <= last.end => last.end = last.end.max(range.end),
            _ => joined.push(range),
        }
    }
    Change::from_flips(&joined)
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use glam::DVec3;
    use proptest::prelude::*;

    use super::*;
    use crate::shapes::ShapeKind;
    use crate::{Edit, PointCloud, Preset, Propagation, Silent};

    const N_POINTS: u32 = 400;

    fn document() -> Document {
        let cloud = PointCloud::new(DVec3::ZERO, ShapeKind::Torus.generate(N_POINTS as usize).positions).unwrap();
        let propagation = Propagation::new(&cloud, None, Preset::Auto.parameters(), &Silent).unwrap();
        let mut document = Document::new(Arc::new(cloud), None);
        document.install(propagation);
        document
    }

    #[test]
    fn a_region_has_the_name_of_its_source_and_the_rest_keeps_its_own() {
        let mut document = document();
        let before = document.region_names(0..N_POINTS);
        assert!(before.iter().all(|&name| name == before[0]), "one body is one region");
        let change = document
            .apply(Edit::TurnPatch {
                point: 17,
                n_points: 40,
            })
            .unwrap();
        let after = document.region_names(0..N_POINTS);
        for position in 0..N_POINTS {
            let expect = if change.contains(position) { 17 } else { before[0] };
            assert_eq!(after[position as usize], expect, "position {position}");
        }
        document.undo();
        assert_eq!(document.region_names(0..N_POINTS), before);
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(16))]
        #[test]
        fn names_change_only_where_it_is_said(
            edits in proptest::collection::vec((0_u8..6, 0..N_POINTS, 2_u32..100), 1..25),
            cut in 1..N_POINTS,
        ) {
            let mut document = document();
            for (kind, point, n_points) in edits {
                let before = document.region_names(0..N_POINTS);
                let outline = document.region_outline();
                let change = match kind {
                    0 | 1 => document.apply(Edit::Mend(point)).ok(),
                    2 => document.apply(Edit::TurnPatch { point, n_points }).ok(),
                    3 => {
                        let nth = point as usize % document.sources().len().max(1);
                        let source = document.sources().iter().nth(nth).map(|source| source.point);
                        source.and_then(|point| document.apply(Edit::RemoveSources(vec![point])).ok())
                    }
                    4 => document.undo(),
                    _ => document.redo(),
                };
                if change.is_none() {
                    continue;
                }
                let renamed = document.renamed_since(&outline);
                let after = document.region_names(0..N_POINTS);
                for position in 0..N_POINTS {
                    let same = before[position as usize] == after[position as usize];
                    prop_assert!(same || renamed.contains(position), "position {}", position);
                }
                let pieces = [document.region_names(0..cut), document.region_names(cut..N_POINTS)].concat();
                prop_assert_eq!(&pieces, &after);
                let snapshot = document.snapshot_of_regions().unwrap();
                prop_assert_eq!(snapshot.tree().n_points(), N_POINTS as usize);
                prop_assert_eq!(snapshot.of(0..N_POINTS), after);
            }
        }
    }
}
