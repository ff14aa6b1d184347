//! What the program says while it works: words and a bar on standard error, and Ctrl-C.

use std::io::{self, Write};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, OnceLock};

use anyhow::Context;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use normend_core::{Cancelled, Progress};
use normend_io::{NotAllWritten, ReadError, WriteError};
use signal_hook::consts::{SIGINT, SIGTERM};
use signal_hook::flag;

use crate::INTERRUPTED;

/// Steps of a bar; more than any terminal has columns.
const BAR_STEPS: f32 = 1000.0;

/// Writes a line to standard error. A closed standard error is no reason to stop, so failures are left alone.
///
/// Names in files and of files may hold anything, so control characters are written as what they are called: they would be
/// commands to a terminal.
pub fn say(line: &str) {
    let mut shown = String::with_capacity(line.len());
    for letter in line.chars() {
        if letter.is_control() && letter != '\n' {
            shown.extend(letter.escape_default());
        } else {
            shown.push(letter);
        }
    }
    let _ = writeln!(io::stderr().lock(), "{shown}");
}

/// Set when the user asked to stop.
fn stop_flag() -> &'static Arc<AtomicBool> {
    static STOP: OnceLock<Arc<AtomicBool>> = OnceLock::new();
    STOP.get_or_init(Arc::default)
}

/// Whether the user asked to stop.
pub fn is_stopped() -> bool {
    stop_flag().load(Ordering::Relaxed)
}

/// From now on the first Ctrl-C asks the work to stop, so that temporary files are cleared away; the second ends the
/// program at once.
///
/// # Errors
/// When the system refuses the signal handlers.
pub fn stop_on_interrupt() -> anyhow::Result<()> {
    for signal in [SIGINT, SIGTERM] {
        // Handlers run in this order: the first signal finds the flag unset and only sets it.
        flag::register_conditional_shutdown(signal, i32::from(INTERRUPTED), Arc::clone(stop_flag()))
            .and_then(|_| flag::register(signal, Arc::clone(stop_flag())))
            .context("cannot listen for Ctrl-C")?;
    }
    Ok(())
}

/// A bar with the name of the stage, on standard error when that is a terminal. Cancels on Ctrl-C.
pub struct Bar {
    bar: ProgressBar,
    quiet: bool,
}

impl Bar {
    /// A bar titled `title` (a file's name); an invisible one when `quiet`. Invisible, too, without a terminal.
    pub fn new(title: &str, quiet: bool) -> Self {
        let target = if quiet {
            ProgressDrawTarget::hidden()
        } else {
            ProgressDrawTarget::stderr()
        };
        let bar = ProgressBar::with_draw_target(Some(BAR_STEPS as u64), target);
        // A template that does not parse would be a mistake in this line; the bar is then indicatif's plain one.
        if let Ok(style) = ProgressStyle::with_template("{prefix}  {wide_bar} {percent:>3} %  {msg}  {elapsed}") {
            bar.set_style(style);
        }
        bar.set_prefix(title.to_owned());
        Self { bar, quiet }
    }

    /// Writes a line above the bar, unless quiet.
    pub fn say(&self, line: &str) {
        if !self.quiet {
            self.bar.suspend(|| say(line));
        }
    }

    /// Writes a line above the bar, quiet or not: for errors.
    pub fn say_error(&self, line: &str) {
        self.bar.suspend(|| say(line));
    }
}

impl Progress for Bar {
    fn report(&self, fraction: f32) -> Result<(), Cancelled> {
        if is_stopped() {
            return Err(Cancelled);
        }
        self.bar.set_position((fraction.clamp(0.0, 1.0) * BAR_STEPS) as u64);
        Ok(())
    }

    fn stage(&self, name: &str) {
        self.bar.set_message(name.to_owned());
    }
}

impl Drop for Bar {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
    }
}

/// An error in one sentence, causes included.
pub fn in_words(error: &anyhow::Error) -> String {
    let mut words: Vec<String> = Vec::new();
    for cause in error.chain() {
        words.push(match cause.downcast_ref::<io::Error>() {
            Some(error) => normend_io::io_words(error),
            None => cause.to_string(),
        });
        // The errors of files tell their causes themselves.
        if cause.is::<ReadError>() || cause.is::<WriteError>() || cause.is::<NotAllWritten>() {
            break;
        }
    }
    words.join(": ")
}

/// `n` of something whose plural ends in s: `1 point`, `1,200 points`.
pub fn counted(n: usize, singular: &str) -> String {
    let ending = if n == 1 { "" } else { "s" };
    format!("{} {singular}{ending}", thousands(n as u64))
}

/// `1234567` as `1,234,567`.
pub fn thousands(number: u64) -> String {
    let digits = number.to_string();
    let mut grouped = String::with_capacity(digits.len() + digits.len() / 3);
    for (index, digit) in digits.chars().enumerate() {
        if index > 0 && (digits.len() - index).is_multiple_of(3) {
            grouped.push(',');
        }
        grouped.push(digit);
    }
    grouped
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn groups_thousands() {
        fn check(number: u64, expect: &str) {
            assert_eq!(thousands(number), expect);
        }
        check(0, "0");
        check(999, "999");
        check(1000, "1,000");
        check(123_456, "123,456");
        check(u64::MAX, "18,446,744,073,709,551,615");
    }

    #[test]
    fn counts_in_words() {
        fn check(n: usize, expect: &str) {
            assert_eq!(counted(n, "point"), expect);
        }
        check(0, "0 points");
        check(1, "1 point");
        check(1200, "1,200 points");
    }
}
