//! `normend bench`: how right and how fast the methods are.

mod clicks;
mod clouds;
mod folder;
mod paper;
mod quality;
mod suspects;

use super::Outcome;
use crate::arguments::bench::{BenchArguments, BenchCommand};

/// Runs one of the benchmarks.
///
/// # Errors
/// Wrong use, files that cannot be read or written, Ctrl-C.
pub fn run(arguments: &BenchArguments) -> anyhow::Result<Outcome> {
    match &arguments.command {
        BenchCommand::Clouds(arguments) => clouds::run(arguments),
        BenchCommand::Quality(arguments) => quality::run(arguments),
        BenchCommand::Paper(arguments) => paper::run(arguments),
        BenchCommand::Clicks(arguments) => clicks::run(arguments),
        BenchCommand::Suspects(arguments) => suspects::run(arguments),
    }
}
