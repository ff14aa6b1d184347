//! Progress that cancels: every long function takes one and stops when it says so.

use std::ops::Range;
use std::sync::atomic::{AtomicUsize, Ordering};

/// The caller asked to stop. The only way the algorithms of this crate fail.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("cancelled")]
pub struct Cancelled;

/// Receives how far a long function has come, and may stop it.
pub trait Progress: Sync {
    /// Reports `fraction` of the work done, in 0..=1. Called from any thread, some hundred times a job.
    ///
    /// # Errors
    /// [`Cancelled`] when the work should stop.
    fn report(&self, fraction: f32) -> Result<(), Cancelled>;

    /// Names the stage that begins now, in words for the user ("Estimating normals").
    fn stage(&self, _name: &str) {}
}

/// A progress that shows nothing and never cancels.
#[derive(Clone, Copy, Debug, Default)]
pub struct Silent;

impl Progress for Silent {
    fn report(&self, _fraction: f32) -> Result<(), Cancelled> {
        Ok(())
    }
}

/// A slice of another progress: 0..=1 here is `range` there.
pub struct Part<'a> {
    whole: &'a dyn Progress,
    range: Range<f32>,
}

impl<'a> Part<'a> {
    /// The part of `whole` that covers `range` (within 0..=1).
    pub fn new(whole: &'a dyn Progress, range: Range<f32>) -> Self {
        Self { whole, range }
    }
}

impl Progress for Part<'_> {
    fn report(&self, fraction: f32) -> Result<(), Cancelled> {
        self.whole
            .report(self.range.start + (self.range.end - self.range.start) * fraction.clamp(0.0, 1.0))
    }

    fn stage(&self, name: &str) {
        self.whole.stage(name);
    }
}

/// Counts finished steps from many threads and reports the fraction.
pub(crate) struct Steps<'a> {
    progress: &'a dyn Progress,
    done: AtomicUsize,
    total: usize,
}

impl<'a> Steps<'a> {
    /// Of `total` steps none is done.
    pub fn new(progress: &'a dyn Progress, total: usize) -> Self {
        Self {
            progress,
            done: AtomicUsize::new(0),
            total: total.max(1),
        }
    }

    /// `count` more steps are done.
    ///
    /// # Errors
    /// [`Cancelled`] when the work should stop.
    pub fn advance(&self, count: usize) -> Result<(), Cancelled> {
        let done = self.done.fetch_add(count, Ordering::Relaxed) + count;
        self.progress.report(done as f32 / self.total as f32)
    }
}
