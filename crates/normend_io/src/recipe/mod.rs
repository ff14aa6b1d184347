//! Recipes and journals: what a user decided about a scan, as lines of JSON that survive crashes and versions.
//!
//! One format for both. The first line, the [`Head`], says which scan and which parameters it began with; every other line is one
//! [`Event`], in the order they happened. docs/recipe.md describes it for other programs.
//!
//! Invariants: what is written is read back bit for bit; a file that is cut off or damaged anywhere gives the events before that
//! place, or an error, and never other ones. A recipe names no file to write.
//! Not here: what the steps mean, that is [`normend_core::document`]; when a journal is written, that is the editor's.

mod fields;
mod lines;

#[cfg(test)]
mod tests;

use std::path::Path;

use normend_core::document::State;
use normend_core::{Document, EditKind, Parameters, Silent, StateChange};

pub use fields::NamedParameters;
pub use lines::{End, LineWriter, Reading};

use crate::error::{ReadError, WriteError};
use crate::scan::read_file;

/// The extension of recipes, without the dot.
pub const EXTENSION: &str = "normend";

/// Which scan a recipe is of.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ScanIdentity {
    /// The file's name without folders.
    pub name: String,
    /// Where it was, for people to read: it is never opened by this.
    pub path: Option<String>,
    /// The file's size.
    pub n_bytes: u64,
    /// BLAKE3 of the file's content.
    pub hash: [u8; 32],
    /// Points that were read from it.
    pub n_points: u64,
    /// The names that a text's columns were given ([`crate::ReadOptions::columns`]); `None` where it was read as it is.
    pub columns: Option<Vec<String>>,
    /// Of a scan of several files, each of them in order, and the fields above are of all: sizes and points added up, and the hash that
    /// of the files' hashes. Empty for one file.
    pub files: Vec<ScanIdentity>,
}

impl ScanIdentity {
    /// Whether the content is the same and was read in the same way, wherever the files are.
    pub fn is_same_content(&self, other: &Self) -> bool {
        let is_same = |(a, b): (&Self, &Self)| a.is_same_content(b);
        (self.n_bytes, self.hash, &self.columns) == (other.n_bytes, other.hash, &other.columns)
            && self.files.len() == other.files.len()
            && self.files.iter().zip(&other.files).all(is_same)
    }
}

/// What stands in the first line.
#[derive(Clone, Debug, PartialEq)]
pub struct Head {
    /// The version of the program that wrote it.
    pub program: String,
    /// The scan.
    pub scan: ScanIdentity,
    /// The parameters before the first event.
    pub parameters: Parameters,
}

impl Head {
    /// The head of what this program writes.
    pub fn new(scan: ScanIdentity, parameters: Parameters) -> Self {
        Self {
            program: env!("CARGO_PKG_VERSION").to_owned(),
            scan,
            parameters,
        }
    }
}

/// One step of a history.
#[derive(Clone, Debug, PartialEq)]
pub struct RecordedStep {
    /// What was done.
    pub kind: EditKind,
    /// What it changed.
    pub change: StateChange,
    /// How many points it turned then.
    pub n_turned: u64,
}

/// What happened.
#[derive(Clone, Debug, PartialEq)]
#[expect(clippy::large_enum_variant, reason = "steps are what nearly all events are")]
pub enum Event {
    /// A step was done; what was undone before is forgotten.
    Step(RecordedStep),
    /// The last step was taken back.
    Undo,
    /// The last step that was taken back was done again.
    Redo,
    /// The present state was exported, so nothing is lost if this is the end.
    Exported,
}

/// A head and its events.
#[derive(Clone, Debug, PartialEq)]
pub struct Recipe {
    /// Which scan, which parameters.
    pub head: Head,
    /// What happened, in order.
    pub events: Vec<Event>,
}

impl Recipe {
    /// The steps of a document that are in force. Those that its history has forgotten are one step at the beginning. O(state and
    /// history).
    pub fn of_document(scan: ScanIdentity, document: &Document) -> Self {
        let before = document.state_before_steps();
        let first = State {
            parameters: before.parameters,
            ..State::default()
        };
        let forgotten = RecordedStep {
            kind: EditKind::Recipe,
            change: StateChange::between(&first, &before),
            n_turned: 0,
        };
        let known = document.steps().take(document.n_done()).map(|step| RecordedStep {
            kind: step.kind(),
            change: step.change().clone(),
            n_turned: step.n_turned(),
        });
        let forgotten = Some(forgotten).filter(|step| !step.change.is_empty());
        Self {
            head: Head::new(scan, before.parameters),
            events: forgotten.into_iter().chain(known).map(Event::Step).collect(),
        }
    }

    /// The steps that can still be done or taken back, in order, and how many of them are in force.
    pub fn history(&self) -> (Vec<&RecordedStep>, usize) {
        let (mut steps, mut n_done) = (Vec::new(), 0);
        for event in &self.events {
            match event {
                Event::Step(step) => {
                    steps.truncate(n_done);
                    steps.push(step);
                    n_done += 1;
                }
                Event::Undo => n_done = n_done.saturating_sub(1),
                Event::Redo => n_done = steps.len().min(n_done + 1),
                Event::Exported => {}
            }
        }
        (steps, n_done)
    }

    /// Whether the state at the end was exported.
    pub fn is_exported(&self) -> bool {
        matches!(self.events.last(), Some(Event::Exported))
    }

    /// The same without what can be neither taken back nor done again. Where that is still more than `most_bytes`, the oldest steps
    /// become one. O(size).
    ///
    /// # Errors
    /// As [`Self::encode`].
    pub fn shortened(&self, most_bytes: usize) -> std::io::Result<Self> {
        let (steps, n_done) = self.history();
        let (mut lines, head) = LineWriter::begin(&self.head)?;
        let sizes = steps.iter().map(|step| {
            let line = lines.step(step.kind, &step.change, step.n_turned)?;
            Ok(line.len())
        });
        let sizes = sizes.collect::<std::io::Result<Vec<usize>>>()?;
        let mut n_bytes = head.len() + sizes.iter().sum::<usize>();
        let (mut n_joined, mut state) = (0, self.first_state());
        while n_bytes > most_bytes && n_joined < n_done {
            n_bytes -= sizes[n_joined];
            state.change(&steps[n_joined].change);
            n_joined += 1;
        }
        if n_joined == 1 {
            // One step is one step.
            (n_joined, state) = (0, self.first_state());
        }
        let joined = RecordedStep {
            kind: EditKind::Recipe,
            change: StateChange::between(&self.first_state(), &state),
            n_turned: steps[..n_joined]
                .iter()
                .map(|step| step.n_turned)
                .max()
                .unwrap_or_default(),
        };
        let joined = Some(joined).filter(|_| n_joined > 0);
        let kept = steps[n_joined..].iter().map(|&step| step.clone());
        let undone = std::iter::repeat_n(Event::Undo, steps.len() - n_done);
        let exported = Some(Event::Exported).filter(|_| self.is_exported());
        let steps = joined.into_iter().chain(kept).map(Event::Step);
        Ok(Self {
            head: self.head.clone(),
            events: steps.chain(undone).chain(exported).collect(),
        })
    }

    /// The state before the first event.
    fn first_state(&self) -> State {
        State {
            parameters: self.head.parameters,
            ..State::default()
        }
    }

    /// The state at the end.
    pub fn state(&self) -> State {
        let mut state = self.first_state();
        let (steps, n_done) = self.history();
        for step in &steps[..n_done] {
            state.change(&step.change);
        }
        state
    }

    /// The file's content, and what goes on after it.
    ///
    /// # Errors
    /// None in practice; the encoder promises none.
    pub fn encode(&self) -> std::io::Result<(LineWriter, Vec<u8>)> {
        let (mut lines, mut bytes) = LineWriter::begin(&self.head)?;
        for event in &self.events {
            bytes.extend(lines.event(event)?);
        }
        Ok((lines, bytes))
    }

    /// Writes the recipe to `path`, whole or not at all. A file that is there is replaced.
    ///
    /// # Errors
    /// [`WriteError`]; the target is as it was then.
    pub fn write(&self, path: &Path) -> Result<(), WriteError> {
        let (_, bytes) = self.encode().map_err(WriteError::io(path))?;
        crate::write_bytes(path, &bytes)
    }
}

/// Reads a recipe or a journal.
///
/// # Errors
/// [`ReadError`] when there is no such file, it is no recipe, a newer program wrote it, or its first line is damaged. What is
/// damaged after that is told by [`Reading::end`].
pub fn read(path: &Path) -> Result<Reading, ReadError> {
    let bytes = read_file(path, &Silent)?;
    parse(&bytes, &path.display().to_string())
}

/// Reads a recipe or a journal from memory; `name` stands for the file in messages.
///
/// # Errors
/// As [`read`].
pub fn parse(bytes: &[u8], name: &str) -> Result<Reading, ReadError> {
    lines::parse(bytes).map_err(|broken| ReadError::Broken {
        name: name.to_owned(),
        broken,
    })
}
