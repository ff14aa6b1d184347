//! The regions of the spanning tree that each source orients: MMST (Liu et al., Algorithm 1) as cuts of one tree.
//!
//! Weights do not depend on signs, so the forest that signs spread along from any sources is a subset of the one
//! [`SpanningTree`] (contracting the sources keeps the cycle property). What is left to know is where it is cut.
//! A *base region* is a component of the tree without its initial cuts. Without a vouched source it has its default sign;
//! with some, it is cut at the heaviest edge between each two of them, and each part takes the sign of its source.
//! So a new source cuts one edge, a removed one merges its region over the lightest edge that separates it from another
//! source's, and a changed sign cuts nothing.
//!
//! *Turned patches* change what the edges across their boundaries say, and nothing else: signs travel within a patch
//! and outside it as before. So every sign in a patch turns, and no other: no source is needed to hold the patch.
//!
//! Invariants: a region is known by its top, the position whose parent edge is cut, or a root; it is the top's subtree
//! without the subtrees of the tops in it; it holds at most one source, and where its base region has a source, exactly one. The
//! bits of a region agree with the default signs or are their opposites, so one bit tells all of them. Initial cuts are never merged over.
//! Equal weights are ordered by point id, so the regions depend on the set of sources alone, not on its history.
//!
//! Not here: directions of sources and undo, see [`crate::document`].

use std::collections::BTreeMap;
use std::ops::Range;
use std::sync::Arc;

use fixedbitset::FixedBitSet;

use crate::{Change, Orientation, SpanningTree};

mod position_set;

#[cfg(test)]
pub(crate) mod literal;
#[cfg(test)]
mod tests;

use position_set::PositionSet;

/// Which source orients which point of a spanning tree, and the signs that follow from it.
///
/// Sources are given by point id, with the sign they vouch for: whether the stored normal must turn. An operation
/// climbs the tree (its depth is some thousands at millions of points) and passes over the cuts of the regions it
/// changes; there is no pass over points but the word-wise flip of the turned ranges. Memory is half a byte a point.
#[derive(Clone, Debug)]
pub struct Regions {
    tree: Arc<SpanningTree>,
    /// Roots and initial cuts.
    initial_tops: FixedBitSet,
    /// The signs without any source. Along the edges within a base region they turn as phi does, but for turned patches.
    default_orientation: Orientation,
    /// The tops of all regions: [`Self::initial_tops`] and the cuts between sources.
    tops: PositionSet,
    /// The position of the source of each region that has one, by the region's top.
    source_by_top: BTreeMap<u32, u32>,
    orientation: Orientation,
}

/// What a source at some position orients, given the sources that are there.
enum Part {
    /// The whole region of this top: it has no source, or the source is at this very position.
    Whole { top: u32 },
    /// What a new cut separates from the region's top.
    Below { cut: u32 },
    /// What a new cut leaves to the region's top; the old source keeps the other side.
    Above { top: u32, cut: u32, old: u32 },
}

impl Regions {
    /// The base regions of `tree` with their default signs, without a vouched source. O(n).
    ///
    /// Both sets are by position: the parent edges of `initial_cuts` carry no sign, and of the tops of base regions (roots
    /// and initial cuts) those in `initially_turned` start with their stored normal turned.
    pub fn new(tree: Arc<SpanningTree>, initial_cuts: FixedBitSet, initially_turned: FixedBitSet) -> Self {
        let n_points = tree.n_points();
        let (mut initial_tops, mut turned) = (initial_cuts, initially_turned);
        initial_tops.grow(n_points);
        turned.grow(n_points);
        let mut tops = PositionSet::new(n_points);
        for position in 0..n_points as u32 {
            let index = position as usize;
            match tree.parent(position) {
                Some(parent) if !initial_tops.contains(index) => {
                    let turns = tree.phi(parent) != tree.phi(position);
                    turned.set(index, turned.contains(parent as usize) != turns);
                }
                _ => {
                    initial_tops.insert(index);
                    tops.insert(position);
                }
            }
        }
        Self {
            tree,
            initial_tops,
            default_orientation: Orientation::new(turned.clone()),
            tops,
            source_by_top: BTreeMap::new(),
            orientation: Orientation::new(turned),
        }
    }

    /// The signs that the sources give.
    pub fn orientation(&self) -> &Orientation {
        &self.orientation
    }

    /// Number of base regions. O(n / 64).
    pub fn n_base_regions(&self) -> usize {
        self.initial_tops.count_ones(..)
    }

    /// The tops of the base regions among the positions of `range`, ascending. O(regions in it).
    pub fn base_tops(&self, range: Range<u32>) -> impl Iterator<Item = u32> {
        let next = move |from: u32| self.tops.next(from).filter(|&top| top < range.end);
        let tops = std::iter::successors(next(range.start), move |&top| next(top + 1));
        tops.filter(|&top| self.initial_tops.contains(top as usize))
    }

    /// The tops of the base regions, ascending, and whether they are turned without any source.
    pub(crate) fn base_signs(&self) -> impl Iterator<Item = (u32, bool)> {
        let tops = self.initial_tops.ones().map(|top| top as u32);
        tops.map(|top| (top, self.default_orientation.is_turned(top)))
    }

    /// Number of regions: each has a source, or is a base region without one. O(n / 64).
    pub fn n_regions(&self) -> usize {
        self.tops.len()
    }

    /// Number of sources.
    pub fn n_sources(&self) -> usize {
        self.source_by_top.len()
    }

    /// The source that orients `point`; `None` where the default sign holds.
    pub fn source_of(&self, point: u32) -> Option<u32> {
        let top = self.top_of(self.tree.position(point));
        self.source_by_top
            .get(&top)
            .map(|&source| self.tree.order()[source as usize])
    }

    /// Makes `point` a source whose stored normal is turned or not, or changes the sign of the source it is.
    pub fn add(&mut self, point: u32, turned: bool) -> Change {
        self.set([(point, Some(turned))])
    }

    /// Takes the source at `point` away; nothing happens when there is none.
    pub fn remove(&mut self, point: u32) -> Change {
        self.set([(point, None)])
    }

    /// Makes each point a source of a sign (`Some(turned)`) or no source (`None`); the result is the same as one by one,
    /// and for sources alone the order does not matter.
    ///
    /// Regions flip once, in the end, so a batch costs little more than finding its cuts.
    pub fn set(&mut self, sources: impl IntoIterator<Item = (u32, Option<bool>)>) -> Change {
        self.set_and_turn(sources, &Change::default())
    }

    /// [`Self::set`], after turning patches, or turning them back: all positions in `patches` turn, by default and with the
    /// sources that there are. Sources in them vouch for their other side from then on, if `sources` does not say otherwise.
    pub fn set_and_turn(&mut self, sources: impl IntoIterator<Item = (u32, Option<bool>)>, patches: &Change) -> Change {
        for range in patches.ranges() {
            self.default_orientation.flip(range.clone());
            self.orientation.flip(range.clone());
        }
        let mut flips = patches.ranges().to_vec();
        let mut wanted = BTreeMap::new();
        for (point, turned) in sources {
            let position = self.tree.position(point);
            match turned {
                Some(turned) => {
                    let top = self.admit(position);
                    wanted.insert(position, (turned, top));
                }
                None => {
                    self.dismiss(position, &mut flips);
                    wanted.remove(&position);
                }
            }
        }
        for (position, (turned, top)) in wanted {
            if self.orientation.is_turned(position) != turned {
                // A later cut or merge may have given the source another top.
                let is_still_top = self.source_by_top.get(&top) == Some(&position);
                let top = if is_still_top { top } else { self.top_of(position) };
                self.flip(top, &mut flips);
            }
        }
        Change::from_flips(&flips)
    }

    /// Whether `a` and `b` are in one region.
    pub fn in_one_region(&self, a: u32, b: u32) -> bool {
        self.top_of(self.tree.position(a)) == self.top_of(self.tree.position(b))
    }

    /// All that follows the same sign as `point`: the ranges of its region.
    pub fn region_of(&self, point: u32) -> Change {
        let top = self.top_of(self.tree.position(point));
        let ranges: Vec<_> = self.own_ranges(top, None).collect();
        Change::from_flips(&ranges)
    }

    /// What [`Self::add`] with the sign that `point` does not have now would turn, without changing anything.
    pub fn preview(&self, point: u32) -> Change {
        self.preview_beside(point, None)
    }

    /// [`Self::preview`] as if `beside`, when given, had been made a source of its present sign before. It is another
    /// point of the region of `point`, which has no source.
    pub fn preview_beside(&self, point: u32, beside: Option<u32>) -> Change {
        let beside = beside.map(|point| self.tree.position(point));
        let ranges: Vec<_> = match self.part(self.tree.position(point), beside) {
            Part::Whole { top } => self.own_ranges(top, None).collect(),
            Part::Below { cut } => self.own_ranges(cut, None).collect(),
            Part::Above { top, cut, .. } => self.own_ranges(top, Some(cut)).collect(),
        };
        Change::from_flips(&ranges)
    }

    /// Whether a base region begins at `position`, with or without sources.
    pub fn is_base_top(&self, position: u32) -> bool {
        self.initial_tops.contains(position as usize)
    }

    /// The top of the base region of `point`, as a position.
    pub fn base_top_of(&self, point: u32) -> u32 {
        let mut position = self.tree.position(point);
        while !self.is_base_top(position)
            && let Some(parent) = self.tree.parent(position)
        {
            position = parent;
        }
        position
    }

    /// The tops of regions with a source, ascending, each with the source's point.
    pub fn source_tops(&self) -> impl Iterator<Item = (u32, u32)> {
        let point = |&position: &u32| self.tree.order()[position as usize];
        self.source_by_top
            .iter()
            .map(move |(&top, source)| (top, point(source)))
    }

    /// The positions below `top`, itself included, without those below another top in between. A top that is no base region's does not
    /// count where `counts` is false for its source. O(tops below).
    pub fn ranges_below(&self, top: u32, counts: impl Fn(u32) -> bool) -> Vec<Range<u32>> {
        let end = self.tree.subtree(top).end;
        let (mut start, mut from) = (top, top + 1);
        let mut ranges = Vec::new();
        while let Some(nested) = self.tops.next(from).filter(|&nested| nested < end) {
            from = nested + 1;
            if self.counts(nested, &counts) {
                ranges.push(start..nested);
                start = self.tree.subtree(nested).end;
                from = start;
            }
        }
        ranges.push(start..end);
        ranges.retain(|range| !range.is_empty());
        ranges
    }

    /// Whether a top is that of a base region, or has a source that counts.
    fn counts(&self, top: u32, counts: impl Fn(u32) -> bool) -> bool {
        let source = self.source_by_top.get(&top);
        self.is_base_top(top) || source.is_none_or(|&source| counts(self.tree.order()[source as usize]))
    }

    /// For each position of `range` the top of its region, and the point of the region's source, if it has one. Sources for which
    /// `counts` is false are taken to be none, and their regions to belong to those above. O(positions + depth of the tree).
    pub fn tops_of(&self, range: Range<u32>, counts: impl Fn(u32) -> bool) -> Vec<(u32, Option<u32>)> {
        let own = |position: u32| {
            if !self.tops.contains(position) || !self.counts(position, &counts) {
                return None;
            }
            let source = self.source_by_top.get(&position);
            let source = source.map(|&source| self.tree.order()[source as usize]);
            Some((position, source.filter(|&source| counts(source))))
        };
        // In preorder the parent of a position is in the range or among the ancestors of its first position.
        let mut path: Vec<u32> = std::iter::successors(Some(range.start).filter(|_| !range.is_empty()), |&position| {
            self.tree.parent(position)
        })
        .collect();
        path.reverse();
        let mut above: Vec<(u32, Option<u32>)> = Vec::with_capacity(path.len());
        for &position in &path {
            let top = own(position).or(above.last().copied());
            above.extend(top);
        }
        let mut tops: Vec<(u32, Option<u32>)> = Vec::with_capacity(range.len());
        for position in range.clone() {
            let top = own(position).or_else(|| {
                let parent = self.tree.parent(position)?;
                match parent.checked_sub(range.start) {
                    Some(index) => tops.get(index as usize).copied(),
                    None => above.get(path.binary_search(&parent).ok()?).copied(),
                }
            });
            // A root is a top of its own.
            tops.push(top.unwrap_or((position, None)));
        }
        tops
    }

    /// The top of the region of `position`: its nearest ancestor, or itself, that is a top.
    fn top_of(&self, mut position: u32) -> u32 {
        while !self.tops.contains(position)
            && let Some(parent) = self.tree.parent(position)
        {
            position = parent;
        }
        position
    }

    /// What a source at `position` orients, where a region without a source is taken to have one at `assumed`.
    fn part(&self, position: u32, assumed: Option<u32>) -> Part {
        let top = self.top_of(position);
        match self.source_by_top.get(&top).copied().or(assumed) {
            Some(old) if old != position => {
                let (cut, is_above_old) = self.heaviest_edge(position, old);
                if is_above_old {
                    Part::Above { top, cut, old }
                } else {
                    Part::Below { cut }
                }
            }
            _ => Part::Whole { top },
        }
    }

    /// The heaviest edge on the path between two different positions `a` and `b` of one region, as the position whose
    /// parent edge it is, and whether it is on the way up from `b`.
    fn heaviest_edge(&self, mut a: u32, mut b: u32) -> (u32, bool) {
        let mut heaviest = (a.max(b), b > a);
        // In preorder an ancestor comes first, so the later one of two is never an ancestor of the other.
        while a != b {
            let is_from_b = b > a;
            let climber = if is_from_b { &mut b } else { &mut a };
            if self.tree.compare_edges(*climber, heaviest.0).is_gt() {
                heaviest = (*climber, is_from_b);
            }
            let Some(parent) = self.tree.parent(*climber) else {
                break;
            };
            *climber = parent;
        }
        heaviest
    }

    /// Makes `position` a source, with one cut at most and without turning anything; returns the top of its region.
    fn admit(&mut self, position: u32) -> u32 {
        let top = match self.part(position, None) {
            Part::Whole { top } => top,
            Part::Below { cut } => {
                self.tops.insert(cut);
                cut
            }
            Part::Above { top, cut, old } => {
                self.tops.insert(cut);
                self.source_by_top.insert(cut, old);
                top
            }
        };
        self.source_by_top.insert(top, position);
        top
    }

    /// Takes the source at `position` away, if it is one; its region joins the neighbor over the lightest cut and takes its
    /// signs, or takes the default sign when the base region has no other source.
    fn dismiss(&mut self, position: u32, flips: &mut Vec<Range<u32>>) {
        let top = self.top_of(position);
        if self.source_by_top.get(&top) != Some(&position) {
            return;
        }
        self.source_by_top.remove(&top);
        let lightest = std::iter::once(top)
            .chain(self.nested_tops(top, None))
            .filter(|&cut| !self.initial_tops.contains(cut as usize))
            .min_by(|&a, &b| self.tree.compare_edges(a, b));
        // A cut between sources is no root, so it has a parent.
        let Some((cut, parent)) = lightest.and_then(|cut| Some((cut, self.tree.parent(cut)?))) else {
            if self.is_opposite(top) {
                self.flip(top, flips);
            }
            return;
        };
        if self.is_opposite(cut) != self.is_opposite(parent) {
            self.flip(top, flips);
        }
        self.tops.remove(cut);
        if cut != top
            && let Some(neighbor) = self.source_by_top.remove(&cut)
        {
            self.source_by_top.insert(top, neighbor);
        }
    }

    /// Whether the sign at `position` is not the default one.
    fn is_opposite(&self, position: u32) -> bool {
        self.orientation.is_turned(position) != self.default_orientation.is_turned(position)
    }

    /// Flips the region of `top` and remembers its ranges.
    fn flip(&mut self, top: u32, flips: &mut Vec<Range<u32>>) {
        let n_before = flips.len();
        flips.extend(self.own_ranges(top, None));
        for range in &flips[n_before..] {
            self.orientation.flip(range.clone());
        }
    }

    /// The ranges of positions of the region of `top`, ascending, as if there were one more top `extra` in it.
    fn own_ranges(&self, top: u32, extra: Option<u32>) -> impl Iterator<Item = Range<u32>> {
        let end = self.tree.subtree(top).end;
        let mut start = top;
        self.nested_tops(top, extra)
            .map(|nested| self.tree.subtree(nested))
            .chain(std::iter::once(end..end))
            .map(move |nested| std::mem::replace(&mut start, nested.end)..nested.start)
            .filter(|range| !range.is_empty())
    }

    /// The tops that bound the region of `top` below, ascending, as if there were one more top `extra` in it; those
    /// further down are jumped over.
    fn nested_tops(&self, top: u32, extra: Option<u32>) -> impl Iterator<Item = u32> {
        let end = self.tree.subtree(top).end;
        let mut from = top + 1;
        std::iter::from_fn(move || {
            let extra = extra.filter(|&extra| extra >= from);
            let nested = self.tops.next(from).into_iter().chain(extra).min()?;
            from = self.tree.subtree(nested).end;
            (nested < end).then_some(nested)
        })
    }
}
