//! What the editor has to say: shown for a while over the view, kept in the log.

use crate::crash;

/// How important a message is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Level {
    /// Something was done.
    Done,
    /// Something was not done, for a reason that is no failure, or is worth knowing.
    Note,
    /// Something failed. Stays longer.
    Error,
}

/// One message.
#[derive(Clone, Debug, PartialEq)]
pub struct Message {
    /// How important.
    pub level: Level,
    /// One or two sentences.
    pub text: String,
    /// When it was said last, in seconds since the editor started.
    pub at_secs: f64,
    /// When it was said last.
    pub at: jiff::Timestamp,
    /// How often it was said in a row.
    pub n_times: u32,
    /// Seconds since the editor started at which it leaves the view; `None` once it has left.
    pub(crate) shown_until: Option<f64>,
}

/// All messages of this run, oldest first, the last few hundred.
#[derive(Debug, Default)]
pub struct Messages {
    entries: Vec<Message>,
    now: f64,
}

const MAX_ENTRIES: usize = 300;
const INFO_SECS: f64 = 7.0;
const ERROR_SECS: f64 = 30.0;
const MAX_SHOWN_ERRORS: usize = 2;

impl Level {
    /// All levels, from the least important.
    pub const ALL: [Self; 3] = [Self::Done, Self::Note, Self::Error];

    /// The name in the list of messages.
    pub fn label(self) -> &'static str {
        match self {
            Self::Done => "Done",
            Self::Note => "Note",
            Self::Error => "Error",
        }
    }
}

impl Message {
    /// The text, with how often it was said.
    pub fn full_text(&self) -> String {
        if self.n_times > 1 {
            format!("{} (×{})", self.text, self.n_times)
        } else {
            self.text.clone()
        }
    }

    /// The time of day on this machine, as "14:03:59".
    pub fn clock(&self) -> String {
        let local = self.at.to_zoned(jiff::tz::TimeZone::system());
        local.strftime("%H:%M:%S").to_string()
    }
}

impl Messages {
    /// Says that something was done.
    pub fn info(&mut self, text: impl Into<String>) {
        let text = text.into();
        tracing::debug!("{text}");
        self.push(Level::Done, text, Some(self.now + INFO_SECS));
    }

    /// Says what was not done and why, or what is worth knowing.
    pub fn note(&mut self, text: impl Into<String>) {
        let text = text.into();
        tracing::debug!("{text}");
        self.push(Level::Note, text, Some(self.now + INFO_SECS));
    }

    /// Says what failed and what to do.
    pub fn error(&mut self, text: impl Into<String>) {
        let text = text.into();
        tracing::debug!("{text}");
        self.push(Level::Error, text, Some(self.now + ERROR_SECS));
    }

    /// Puts into the log what failed and is already shown elsewhere.
    pub fn log_error(&mut self, text: impl Into<String>) {
        let text = text.into();
        tracing::debug!("{text}");
        self.push(Level::Error, text, None);
    }

    fn push(&mut self, level: Level, text: String, shown_until: Option<f64>) {
        crash::remember(&text);
        if let Some(last) = self.entries.last_mut()
            && last.level == level
            && last.text == text
        {
            last.n_times += 1;
            last.at_secs = self.now;
            last.at = jiff::Timestamp::now();
            last.shown_until = shown_until;
            return;
        }
        if self.entries.len() == MAX_ENTRIES {
            self.entries.remove(0);
        }
        self.entries.push(Message {
            level,
            text,
            at_secs: self.now,
            at: jiff::Timestamp::now(),
            n_times: 1,
            shown_until,
        });
        // Only the newest errors stand in the view's way; the log keeps all.
        let shown = |entry: &&mut Message| entry.level == Level::Error && entry.shown_until.is_some();
        for entry in self.entries.iter_mut().rev().filter(shown).skip(MAX_SHOWN_ERRORS) {
            entry.shown_until = None;
        }
    }

    /// Lets messages leave the view whose time is over at `now` (seconds since the editor started).
    /// Returns the seconds until the next one leaves.
    pub(crate) fn tick(&mut self, now: f64) -> Option<f64> {
        self.now = now;
        for entry in &mut self.entries {
            if entry.shown_until.is_some_and(|until| until <= now) {
                entry.shown_until = None;
            }
        }
        self.entries
            .iter()
            .filter_map(|entry| entry.shown_until)
            .map(|until| until - now)
            .reduce(f64::min)
    }

    /// All that are kept, oldest first.
    pub fn entries(&self) -> &[Message] {
        &self.entries
    }

    /// Forgets all that was said.
    pub(crate) fn clear(&mut self) {
        self.entries.clear();
    }

    pub(crate) fn entries_mut(&mut self) -> &mut [Message] {
        &mut self.entries
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn messages_leave_the_view_and_errors_stay_longer() {
        let mut messages = Messages::default();
        messages.info("Opened.");
        messages.error("Failed.");
        assert_eq!(messages.tick(1.0), Some(INFO_SECS - 1.0));
        assert_eq!(messages.tick(INFO_SECS), Some(ERROR_SECS - INFO_SECS));
        let shown: Vec<_> = messages
            .entries()
            .iter()
            .map(|entry| entry.shown_until.is_some())
            .collect();
        assert_eq!(shown, [false, true]);
        assert_eq!(messages.tick(ERROR_SECS), None);
        assert_eq!(messages.entries().len(), 2, "the log keeps them");
    }

    #[test]
    fn two_errors_at_most_are_in_view() {
        let mut messages = Messages::default();
        messages.tick(2.5);
        for text in ["one", "two", "three"] {
            messages.error(text);
        }
        messages.note("four");
        let entries = messages.entries().iter();
        let shown: Vec<_> = entries.map(|entry| entry.shown_until.is_some()).collect();
        assert_eq!(shown, [false, true, true, true]);
        assert!(messages.entries().iter().all(|entry| entry.at_secs == 2.5));
    }

    #[test]
    fn repeated_messages_are_one_entry_and_the_log_is_bounded() {
        let mut messages = Messages::default();
        messages.error("Failed.");
        messages.error("Failed.");
        assert_eq!(messages.entries().len(), 1);
        assert_eq!(messages.entries()[0].n_times, 2);
        for index in 0..MAX_ENTRIES + 5 {
            messages.info(format!("{index}"));
        }
        assert_eq!(messages.entries().len(), MAX_ENTRIES);
    }
}
