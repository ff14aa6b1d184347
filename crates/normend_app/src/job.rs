//! Long work beside the window: one named thread a job, with progress, cancel, and a result that is polled.
//!
//! Dropping a [`Job`] cancels it and closes its channel, so a result for settings that are no longer wanted cannot
//! arrive: there is nobody left to take it.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};
use std::sync::{Arc, Mutex, PoisonError, mpsc};
use std::thread;
use std::time::Instant;

use normend_core::{Cancelled, Progress};

use crate::crash;

/// Why a job gave no result.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum JobError {
    /// The user stopped it.
    Cancelled,
    /// In words for the user.
    Failed(String),
}

impl From<Cancelled> for JobError {
    fn from(_: Cancelled) -> Self {
        Self::Cancelled
    }
}

/// How far a job has come.
#[derive(Clone, Debug, PartialEq)]
pub struct JobStatus {
    /// What is being done now ("Estimating normals").
    pub stage: String,
    /// In 0..=1.
    pub fraction: f32,
    /// Wall seconds left, when they can be told.
    pub seconds_left: Option<f32>,
    /// Whether the user asked to stop.
    pub cancelling: bool,
}

/// Work under way in its own thread.
#[derive(Debug)]
pub struct Job<T> {
    shared: Arc<Shared>,
    result: mpsc::Receiver<Result<T, JobError>>,
    started: Instant,
}

#[derive(Debug)]
struct Shared {
    ctx: egui::Context,
    /// The fraction, as the bits of an `f32`.
    fraction: AtomicU32,
    stage: Mutex<String>,
    cancel: AtomicBool,
}

impl<T: Send + 'static> Job<T> {
    /// Starts `work` in a thread called `name`; `stage` is shown until the work names its own.
    ///
    /// A panic inside becomes [`JobError::Failed`]. `ctx` is asked to repaint when there is something new to show.
    pub fn start(
        ctx: &egui::Context,
        name: &str,
        stage: &str,
        work: impl FnOnce(&dyn Progress) -> Result<T, JobError> + Send + 'static,
    ) -> Self {
        let shared = Arc::new(Shared {
            ctx: ctx.clone(),
            fraction: AtomicU32::new(0),
            stage: Mutex::new(stage.to_owned()),
            cancel: AtomicBool::new(false),
        });
        let (sender, result) = mpsc::channel();
        let progress = Arc::clone(&shared);
        let failure = sender.clone();
        let spawned = thread::Builder::new().name(format!("normend {name}")).spawn(move || {
            let work = || {
                if crash::is_work_panic_asked_for() {
                    std::panic::panic_any("this panic was asked for");
                }
                work(progress.as_ref())
            };
            let outcome = catch_unwind(AssertUnwindSafe(work))
                .unwrap_or_else(|panic| Err(JobError::Failed(in_words(panic.as_ref()))));
            // Nobody listens when the job was dropped meanwhile; then the result is not wanted.
            let _ = sender.send(outcome);
            progress.ctx.request_repaint();
        });
        if let Err(error) = spawned {
            let words = format!(
                "The system gives no thread for this work: {}.",
                normend_io::io_words(&error)
            );
            // The receiver is in this very function, so sending cannot fail.
            let _ = failure.send(Err(JobError::Failed(words)));
        }
        Self {
            shared,
            result,
            started: Instant::now(),
        }
    }

    /// The result, once it is there. Never blocks.
    pub fn poll(&self) -> Option<Result<T, JobError>> {
        match self.result.try_recv() {
            Ok(outcome) => Some(outcome),
            Err(mpsc::TryRecvError::Empty) => None,
            Err(mpsc::TryRecvError::Disconnected) => {
                Some(Err(JobError::Failed("The work ended without a result.".to_owned())))
            }
        }
    }
}

impl<T> Job<T> {
    /// Asks the work to stop; it does at its next report.
    pub fn cancel(&self) {
        self.shared.cancel.store(true, Ordering::Relaxed);
    }

    /// How far it has come.
    pub fn status(&self) -> JobStatus {
        let fraction = f32::from_bits(self.shared.fraction.load(Ordering::Relaxed));
        let elapsed_secs = self.started.elapsed().as_secs_f32();
        // The first moments say little about the rest.
        let meaningful = elapsed_secs > 2.0 && fraction > 0.05;
        JobStatus {
            stage: self.shared.stage.lock().unwrap_or_else(PoisonError::into_inner).clone(),
            fraction,
            seconds_left: meaningful.then(|| elapsed_secs * (1.0 - fraction) / fraction),
            cancelling: self.shared.cancel.load(Ordering::Relaxed),
        }
    }
}

impl<T> Drop for Job<T> {
    fn drop(&mut self) {
        self.cancel();
    }
}

impl Progress for Shared {
    fn report(&self, fraction: f32) -> Result<(), Cancelled> {
        if self.cancel.load(Ordering::Relaxed) {
            return Err(Cancelled);
        }
        let fraction = fraction.clamp(0.0, 1.0);
        let before = f32::from_bits(self.fraction.swap(fraction.to_bits(), Ordering::Relaxed));
        // One repaint for each percent is enough for a bar.
        if (before * 100.0).floor() != (fraction * 100.0).floor() {
            self.ctx.request_repaint();
        }
        Ok(())
    }

    fn stage(&self, name: &str) {
        name.clone_into(&mut self.stage.lock().unwrap_or_else(PoisonError::into_inner));
        self.ctx.request_repaint();
    }
}

fn in_words(panic: &(dyn std::any::Any + Send)) -> String {
    let reason = panic
        .downcast_ref::<&str>()
        .map(|text| (*text).to_owned())
        .or_else(|| panic.downcast_ref::<String>().cloned())
        .unwrap_or_else(|| "no reason given".to_owned());
    let report = crash::take_report_of_work()
        .map(|path| format!(" A report is at {}.", path.display()))
        .unwrap_or_default();
    format!("An internal error stopped this work ({reason}). Your scan and mends are unchanged.{report}")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn wait<T: Send + 'static>(job: &Job<T>) -> Result<T, JobError> {
        loop {
            if let Some(outcome) = job.poll() {
                return outcome;
            }
            thread::yield_now();
        }
    }

    #[test]
    fn a_result_arrives_with_its_stage_and_fraction() {
        let (go, gate) = mpsc::channel::<()>();
        let (said, reported) = mpsc::channel::<()>();
        let job = Job::start(&egui::Context::default(), "test", "Starting", move |progress| {
            progress.stage("Halfway");
            progress.report(0.5)?;
            said.send(()).unwrap();
            gate.recv().unwrap();
            Ok(thread::current().name().map(str::to_owned))
        });
        reported.recv().unwrap();
        let status = job.status();
        assert_eq!(
            (status.stage.as_str(), status.fraction, status.cancelling),
            ("Halfway", 0.5, false)
        );
        assert_eq!(job.poll(), None);
        go.send(()).unwrap();
        assert_eq!(wait(&job), Ok(Some("normend test".to_owned())));
    }

    #[test]
    fn cancel_stops_at_the_next_report() {
        let (go, gate) = mpsc::channel::<()>();
        let job = Job::<()>::start(&egui::Context::default(), "test", "Starting", move |progress| {
            gate.recv().unwrap();
            loop {
                progress.report(0.1)?;
            }
        });
        job.cancel();
        assert!(job.status().cancelling);
        go.send(()).unwrap();
        assert_eq!(wait(&job), Err(JobError::Cancelled));
    }

    #[test]
    fn a_dropped_job_stops_and_its_result_goes_nowhere() {
        let (done, stopped) = mpsc::channel();
        let job = Job::<()>::start(&egui::Context::default(), "test", "Starting", move |progress| {
            let outcome = loop {
                if let Err(cancelled) = progress.report(0.1) {
                    break cancelled;
                }
            };
            done.send(outcome).unwrap();
            Err(outcome.into())
        });
        drop(job);
        assert_eq!(stopped.recv().unwrap(), Cancelled);
    }

    #[test]
    fn a_panic_becomes_words() {
        let job = Job::<()>::start(&egui::Context::default(), "test", "Starting", |_| {
            panic!("a tree without a root")
        });
        let Err(JobError::Failed(words)) = wait(&job) else {
            panic!("a panic gave a result")
        };
        assert!(words.contains("a tree without a root"), "{words}");
    }
}
