//! `normend bench`: how right and how fast the methods are.

mod clouds;

use super::Outcome;
use crate::arguments::bench::{BenchArguments, BenchCommand};

/// Runs one of the benchmarks.
///
/// # Errors
/// Wrong use, files that cannot be read or written, Ctrl-C.
pub fn run(arguments: &BenchArguments) -> anyhow::Result<Outcome> {
    match &arguments.command {
        BenchCommand::Clouds(arguments) => clouds::run(arguments),
    }
}
