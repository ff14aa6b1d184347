//! Progress that cancels: every long function takes one and stops when it says so.

use std::ops::Range;
use std::sync::atomic::{AtomicUsize, Ordering};

/// The caller asked to stop. The only way the algorithms of this crate fail.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("cancelled")]
pub struct Cancelled;

/// Receives how far a long function has come, and may stop it.
pub trait Progress: Sync {
    /// Reports `fraction` of the work done, in 0..=1. Called from any thread and often, so it should be cheap.
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

/// Counts finished steps from many threads and reports the fraction, a few hundred times in all.
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
        let before = self.done.fetch_add(count, Ordering::Relaxed);
        let done = before + count;
        let report = |done: usize| done * REPORTS / self.total;
        if report(done) == report(before) {
            return Ok(());
        }
        self.progress.report(done as f32 / self.total as f32)
    }
}

/// How often [`Steps`] reports at most.
const REPORTS: usize = 256;

#[cfg(test)]
mod tests {
    use std::sync::Mutex;

    use super::*;

    /// Notes every report.
    #[derive(Default)]
    struct Notes(Mutex<Vec<f32>>);

    impl Progress for Notes {
        fn report(&self, fraction: f32) -> Result<(), Cancelled> {
            let mut notes = self.0.lock().unwrap();
            notes.push(fraction);
            if fraction > 0.8 { Err(Cancelled) } else { Ok(()) }
        }
    }

    #[test]
    fn a_part_covers_its_range() {
        let notes = Notes::default();
        let half = Part::new(&notes, 0.25..0.75);
        let inner = Part::new(&half, 0.5..1.0);
        for fraction in [0.0, 1.0, 7.0] {
            inner.report(fraction).unwrap();
        }
        assert_eq!(*notes.0.lock().unwrap(), [0.5, 0.75, 0.75]);
    }

    #[test]
    fn steps_report_some_hundred_times_and_cancel() {
        let notes = Notes::default();
        let steps = Steps::new(&notes, 1_000_000);
        let n_done = (0..1_000_000).take_while(|_| steps.advance(1).is_ok()).count();
        assert!((800_000..810_000).contains(&n_done), "{n_done}");
        let notes = notes.0.lock().unwrap();
        assert!((200..=256).contains(&notes.len()), "{}", notes.len());
        assert!(notes.is_sorted());
    }
}
