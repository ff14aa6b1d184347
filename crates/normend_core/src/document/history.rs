//! Which edits can be taken back and which applied again, within a budget of bytes.

use std::collections::VecDeque;

use super::{EditKind, State, StateChange};
use crate::Parameters;

/// An applied edit with its inverse. It holds points and directions, no signs and no positions in a tree, so it stays
/// valid when the propagation changes.
#[derive(Clone, Debug)]
pub struct Step {
    pub(super) kind: EditKind,
    pub(super) forward: StateChange,
    pub(super) backward: StateChange,
    pub(super) n_turned: u64,
    pub(super) revisions: [Revisions; 2],
    pub(super) sizes: [SetSizes; 2],
}

/// How many points are in the sets of a state.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SetSizes {
    /// Selected points.
    pub selected: u64,
    /// Hidden points.
    pub hidden: u64,
    /// Accepted points.
    pub accepted: u64,
}

impl SetSizes {
    pub(super) fn of(state: &State) -> Self {
        Self {
            selected: state.selected.len(),
            hidden: state.hidden.len(),
            accepted: state.accepted.len(),
        }
    }
}

/// The numbers of a state.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Revisions {
    /// Names the whole state.
    pub all: u64,
    /// Names what signs depend on.
    pub signs: u64,
}

impl Step {
    /// What was done.
    pub fn kind(&self) -> EditKind {
        self.kind
    }

    /// The change of the state that it made.
    pub fn change(&self) -> &StateChange {
        &self.forward
    }

    /// How many points turned when it was first done.
    pub fn n_turned(&self) -> u64 {
        self.n_turned
    }

    /// The sizes of the sets before it and after it.
    pub fn sizes(&self) -> [SetSizes; 2] {
        self.sizes
    }

    /// The parameters before it and after it, where it changed them.
    pub fn parameters(&self) -> Option<[Parameters; 2]> {
        Some([self.backward.parameters?, self.forward.parameters?])
    }

    fn bytes(&self) -> usize {
        size_of::<Self>() + self.forward.heap_bytes() + self.backward.heap_bytes()
    }
}

/// The steps done and undone. The oldest are forgotten when all together take more bytes than the limit, but never the
/// newest.
#[derive(Debug)]
pub(super) struct History {
    done: VecDeque<Step>,
    undone: Vec<Step>,
    bytes: usize,
    limit: usize,
}

impl History {
    pub fn new(limit: usize) -> Self {
        Self {
            done: VecDeque::new(),
            undone: Vec::new(),
            bytes: 0,
            limit,
        }
    }

    pub fn set_limit(&mut self, limit: usize) {
        self.limit = limit;
        self.forget();
    }

    /// Remembers a step just done; what was undone cannot be done again.
    pub fn record(&mut self, step: Step) {
        for undone in self.undone.drain(..) {
            self.bytes -= undone.bytes();
        }
        self.bytes += step.bytes();
        self.done.push_back(step);
        self.forget();
    }

    /// Moves the last step done to the undone ones.
    pub fn undo(&mut self) -> Option<&Step> {
        let step = self.done.pop_back()?;
        self.undone.push(step);
        self.undone.last()
    }

    /// Moves the last step undone to the done ones.
    pub fn redo(&mut self) -> Option<&Step> {
        let step = self.undone.pop()?;
        self.done.push_back(step);
        self.done.back()
    }

    /// All steps in the order they were first done; the first [`Self::n_done`] are in force.
    pub fn steps(&self) -> impl Iterator<Item = &Step> {
        self.done.iter().chain(self.undone.iter().rev())
    }

    pub fn n_done(&self) -> usize {
        self.done.len()
    }

    pub fn last_done(&self) -> Option<&Step> {
        self.done.back()
    }

    pub fn last_undone(&self) -> Option<&Step> {
        self.undone.last()
    }

    fn forget(&mut self) {
        while self.bytes > self.limit
            && self.done.len() + self.undone.len() > 1
            && let Some(oldest) = self.done.pop_front()
        {
            self.bytes -= oldest.bytes();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn step(n_points: u32) -> Step {
        let forward = StateChange {
            sources: (0..n_points).map(|point| (point, None)).collect(),
            ..StateChange::default()
        };
        Step {
            kind: EditKind::Mend,
            backward: forward.clone(),
            forward,
            n_turned: 0,
            revisions: Default::default(),
            sizes: Default::default(),
        }
    }

    fn done(history: &History) -> Vec<u32> {
        history
            .done
            .iter()
            .map(|step| step.forward.sources.len() as u32)
            .collect()
    }

    #[test]
    fn forgets_the_oldest_but_not_the_newest() {
        let mut history = History::new(step(1).bytes() + step(2).bytes());
        history.record(step(1));
        history.record(step(2));
        assert_eq!(done(&history), [1, 2]);
        history.record(step(1));
        assert_eq!(done(&history), [2, 1]);
        history.record(step(500));
        assert_eq!(done(&history), [500]);
        history.record(step(0));
        assert_eq!(done(&history), [0]);
        assert_eq!(history.bytes, step(0).bytes());
    }

    #[test]
    fn undone_steps_count_until_something_else_is_done() {
        let mut history = History::new(usize::MAX);
        (1..=3).for_each(|n| history.record(step(n)));
        let bytes = history.bytes;
        assert_eq!(history.undo().map(|step| step.forward.sources.len()), Some(3));
        assert_eq!(history.undo().map(|step| step.forward.sources.len()), Some(2));
        assert_eq!(history.redo().map(|step| step.forward.sources.len()), Some(2));
        assert_eq!(history.bytes, bytes);
        history.record(step(4));
        assert!(history.redo().is_none());
        assert_eq!(done(&history), [1, 2, 4]);
        assert_eq!(history.bytes, [1, 2, 4].map(|n| step(n).bytes()).iter().sum::<usize>());
    }

    #[test]
    fn a_lower_limit_forgets_at_once() {
        let mut history = History::new(usize::MAX);
        (1..=3).for_each(|n| history.record(step(n)));
        history.set_limit(0);
        assert_eq!(done(&history), [3]);
    }
}
