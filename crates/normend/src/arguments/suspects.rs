//! What can be typed after `normend suspects`.

use std::path::PathBuf;

use clap::Args;
use clap::builder::RangedU64ValueParser;
use normend_core::{SideRule, suspects};

use super::scanner::ScannerArguments;
use super::{CommonArguments, ReadArguments, one_of};

/// Most suspects that can be asked for: each is a line for a person to read.
const MOST: u64 = 100_000;

/// `normend suspects`.
#[derive(Debug, Args)]
#[command(after_help = "\
The normals of the file are compared with what the automatic method finds: suspects are patches where they differ, and \
patches where they do not, but the automatic method is not sure. A file without normals is oriented first. Nothing is written \
but the report.

A row has the rank, the score (the share of the patch that is expected to be wrong, from 0 to 1), the number of points, the \
coordinates of the one in its middle, and the reasons: whether it differs, how well it goes together with its surroundings \
(seam, from -1 to 1), and how many looks vote for and against its present side. No row is good news.

The report (--json) is an object with input, points, normals (given or automatic), undecided, threshold, and suspects: objects \
with score, points, row (of the one in the middle, from 0), center, kind (differs, doubtful, or whole: a component that is \
mostly the other way round), seam, votes_for, votes_against.

Examples:
  normend suspects oriented.ply
  normend suspects meshlab.ply --threshold 0.6 --top 3
  normend suspects room.ply --rule into-room
  normend suspects scan.ply --json - | jq '.suspects[0].center'")]
pub struct SuspectsArguments {
    /// Scan to look at: PLY, or XYZ text
    #[arg(value_name = "IN")]
    pub input: PathBuf,

    /// How files are read.
    #[command(flatten)]
    pub reading: ReadArguments,

    /// Show at most this many
    #[arg(long, value_name = "N", default_value_t = suspects::MOST, value_parser = RangedU64ValueParser::<usize>::new().range(1..=MOST))]
    pub top: usize,

    /// Show those from this score on
    #[arg(long, value_name = "X", default_value_t = suspects::THRESHOLD, value_parser = share)]
    pub threshold: f32,

    /// Which side is the right one, as in `normend orient`
    #[arg(long, value_name = "NAME", value_parser = one_of(&SideRule::ALL, SideRule::name))]
    pub rule: Option<SideRule>,

    /// Where the scanner stood.
    #[command(flatten)]
    pub scanner: ScannerArguments,

    /// Write a report as JSON to FILE, or to standard output (-) in place of the table
    #[arg(long, value_name = "FILE")]
    pub json: Option<PathBuf>,

    /// Allow the report to replace a file that exists
    #[arg(long)]
    pub overwrite: bool,

    /// What every command takes.
    #[command(flatten)]
    pub common: CommonArguments,
}

/// Parses a number from 0 to 1.
pub(super) fn share(typed: &str) -> Result<f32, String> {
    let parsed = typed.parse().ok().filter(|share| (0.0..=1.0).contains(share));
    parsed.ok_or_else(|| "type a number from 0 to 1, as 0.5".to_owned())
}
