//! Which patches the sources turn.
//!
//! The patch of a source is turned when the source vouches for the other side than its surroundings give its point. Patches
//! are nested, so what surrounds one is the larger ones: each is decided after those, of equal ones that of the smaller
//! point id first. So the turned patches depend on the set of sources alone, and a source that goes takes no other's
//! side with it: a patch in its patch turns the other way then, and so stays as it is.

use std::cmp::Reverse;
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use crate::patches::{Offer, Patch};
use crate::{Change, Patches, Source, SpanningTree};

/// The patches of the sources, and which of them are turned.
#[derive(Clone, Debug)]
pub(super) struct TurnedPatches {
    patches: Arc<Patches>,
    /// The sources by the leaf of their point.
    sources: BTreeMap<u32, Vouched>,
    /// The turned patches, each with the point of its source.
    turned: BTreeSet<(Patch, u32)>,
}

/// A source and its patch.
#[derive(Clone, Copy, Debug)]
struct Vouched {
    source: Source,
    patch: Option<Patch>,
}

impl Vouched {
    /// Whether `patch`, which holds the source's point and the leaf of a click, cannot be turned by the click: it would turn
    /// the point, or it would leave the clicked point as it is, which belongs to the patch of the source.
    fn hinders(&self, patch: Patch, clicked: u32) -> bool {
        self.patch
            .is_none_or(|own| own.n_points >= patch.n_points || own.leaves().contains(&clicked))
    }
}

impl TurnedPatches {
    /// No sources, so no patch is turned.
    pub fn new(patches: Arc<Patches>) -> Self {
        Self {
            patches,
            sources: BTreeMap::new(),
            turned: BTreeSet::new(),
        }
    }

    /// All patches.
    pub fn patches(&self) -> &Patches {
        &self.patches
    }

    /// All sources.
    pub fn sources(&self) -> impl Iterator<Item = &Source> {
        self.sources.values().map(|vouched| &vouched.source)
    }

    /// The patches to turn at `point`; see [`Patches::offer`].
    pub fn offer(&self, point: u32) -> Option<Offer> {
        // Who does not hinder a patch does not hinder a larger one, so each source is looked at once.
        let leaf = self.patches.leaf(point);
        let mut seen = leaf..leaf;
        self.patches.offer(point, |patch| {
            let leaves = patch.leaves();
            let added = [leaves.start..seen.start, seen.end..leaves.end];
            seen = leaves;
            let mut added = added.into_iter().flat_map(|leaves| self.sources.range(leaves));
            !added.any(|(_, vouched)| vouched.hinders(patch, leaf))
        })
    }

    /// How many sources `patch` cannot be turned for at `point`.
    pub fn n_hindering(&self, patch: Patch, point: u32) -> usize {
        let leaf = self.patches.leaf(point);
        let sources = self.sources.range(patch.leaves());
        sources.filter(|(_, vouched)| vouched.hinders(patch, leaf)).count()
    }

    /// The positions that turn with `patch`: all but those of patches in it that sources vouch for.
    pub fn positions(&self, patch: Patch, tree: &SpanningTree) -> Change {
        let within = self
            .sources
            .range(patch.leaves())
            .filter_map(|(_, vouched)| vouched.patch);
        let mut within: Vec<Patch> = within.filter(|within| within.n_points < patch.n_points).collect();
        within.sort_unstable_by_key(|within| (within.leaves().start, Reverse(within.n_points)));
        let mut flips = Flips::default();
        flips.flip(patch);
        let mut end = 0;
        for outermost in within {
            if outermost.leaves().start >= end {
                flips.flip(outermost);
                end = outermost.leaves().end;
            }
        }
        flips.positions(&self.patches, tree)
    }

    /// Whether the turned patches that hold `patch`, itself included, turn its points together. `point` is one of them.
    pub fn turns(&self, patch: Patch, point: u32) -> bool {
        self.turn(
            self.patches
                .around(point)
                .filter(|larger| larger.n_points >= patch.n_points),
        )
    }

    /// Whether the turned patches around `point` together turn it.
    pub fn turns_at(&self, point: u32) -> bool {
        self.turn(self.patches.around(point))
    }

    /// Whether an odd number of sources has turned these patches.
    fn turn(&self, patches: impl Iterator<Item = Patch>) -> bool {
        let n_turns: usize = patches
            .map(|patch| self.turned.range((patch, 0)..=(patch, u32::MAX)).count())
            .sum();
        n_turns % 2 == 1
    }

    /// Sets or takes away the source at each point, and returns the positions whose patches turn by that. `is_flipped` says
    /// whether a source vouches for another side than the one that its point starts with.
    ///
    /// Only patches within those of the given sources are decided anew.
    pub fn set(
        &mut self,
        sources: impl IntoIterator<Item = (u32, Option<Source>)>,
        is_flipped: impl Fn(&Source) -> bool,
        tree: &SpanningTree,
    ) -> Change {
        let mut flips = Flips::default();
        let mut changed = Vec::new();
        for (point, after) in sources {
            let leaf = self.patches.leaf(point);
            let after = after.map(|source| Vouched {
                source,
                patch: source.patch.map(|patch| self.patches.find(point, patch.n_points)),
            });
            let before = match after {
                Some(vouched) => self.sources.insert(leaf, vouched),
                None => self.sources.remove(&leaf),
            };
            if let Some(patch) = before.and_then(|vouched| vouched.patch) {
                self.turn_back(patch, point, &mut flips);
                changed.push(patch);
            }
            changed.extend(after.and_then(|vouched| vouched.patch));
        }
        let mut undecided = BTreeSet::new();
        for patch in changed {
            for vouched in self.sources.range(patch.leaves()).map(|(_, vouched)| vouched) {
                let within = vouched.patch.filter(|within| within.n_points <= patch.n_points);
                undecided.extend(within.map(|within| (Reverse(within.n_points), vouched.source.point, within)));
            }
        }
        for &(_, point, patch) in &undecided {
            self.turn_back(patch, point, &mut flips);
        }
        for (_, point, patch) in undecided {
            let source = &self.sources[&self.patches.leaf(point)].source;
            let mended = source.patch.is_some_and(|patch| patch.amid_mended);
            if is_flipped(source) != (self.turns(patch, point) != mended) {
                self.turned.insert((patch, point));
                flips.flip(patch);
            }
        }
        flips.positions(&self.patches, tree)
    }

    fn turn_back(&mut self, patch: Patch, point: u32, flips: &mut Flips) {
        if self.turned.remove(&(patch, point)) {
            flips.flip(patch);
        }
    }
}

/// Patches that were flipped an odd number of times.
#[derive(Default)]
struct Flips(BTreeSet<Patch>);

impl Flips {
    fn flip(&mut self, patch: Patch) {
        if !self.0.remove(&patch) {
            self.0.insert(patch);
        }
    }

    fn positions(self, patches: &Patches, tree: &SpanningTree) -> Change {
        let changes = self.0.into_iter().map(|patch| patches.positions(patch, tree));
        let ranges: Vec<_> = changes.flat_map(|change| change.ranges().to_vec()).collect();
        Change::from_flips(&ranges)
    }
}
