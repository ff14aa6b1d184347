//! Which edits can be taken back and which applied again, within a budget of bytes.

use std::collections::VecDeque;

use super::Edit;
use crate::Source;

/// The source at one point before and after an edit.
#[derive(Clone, Copy, Debug)]
pub(super) struct SourceChange {
    pub point: u32,
    pub before: Option<Source>,
    pub after: Option<Source>,
}

/// An applied edit with its inverse. It holds points and directions, no signs and no positions in a tree, so it stays
/// valid when the propagation changes.
#[derive(Debug)]
pub(super) struct Step {
    pub edit: Edit,
    pub changes: Box<[SourceChange]>,
    pub revision_before: u64,
    pub revision_after: u64,
}

impl Step {
    fn bytes(&self) -> usize {
        size_of::<Self>() + self.edit.heap_bytes() + size_of_val(&*self.changes)
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
        let changes = (0..n_points)
            .map(|point| SourceChange {
                point,
                before: None,
                after: None,
            })
            .collect();
        Step {
            edit: Edit::Mend(n_points),
            changes,
            revision_before: 0,
            revision_after: 1,
        }
    }

    fn done(history: &History) -> Vec<u32> {
        history.done.iter().map(|step| step.changes.len() as u32).collect()
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
        assert_eq!(history.undo().map(|step| step.changes.len()), Some(3));
        assert_eq!(history.undo().map(|step| step.changes.len()), Some(2));
        assert_eq!(history.redo().map(|step| step.changes.len()), Some(2));
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
