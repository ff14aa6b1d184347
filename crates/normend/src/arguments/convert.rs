//! What can be typed after `normend convert`.

use std::path::PathBuf;

use clap::Args;
use clap::builder::PossibleValuesParser;
use normend_io::FileFormat;

use super::{CommonArguments, ReadArguments};

/// `normend convert`.
#[derive(Debug, Args)]
#[command(after_help = "\
The points of each file are written as they are in the format that the output's extension names, with the normals that they \
have and everything else that the format can hold. What it cannot hold is named; nothing is oriented. Several inputs go to a \
folder under their own names with the extension of --to; one that fails does not stop the others, the exit code is 1 then. A \
file that exists is replaced only with --overwrite.

The report (--json) has a line for each input: an object with input, output, points, left_out (rows without finite \
coordinates), has_normals, and lost (what the format cannot hold, in words). A failed input has input and error.

Examples:
  normend convert scan.xyz -o scan.ply
  normend convert a.ply b.csv -o converted/ --to xyz --json report.jsonl
  normend convert scan.ply -o scan.csv --strict")]
pub struct ConvertArguments {
    /// Scans to convert
    #[arg(required = true, value_name = "IN")]
    pub inputs: Vec<PathBuf>,

    /// File to write; a folder when there are several inputs
    #[arg(short, long, value_name = "OUT")]
    pub output: PathBuf,

    /// How files are read.
    #[command(flatten)]
    pub reading: ReadArguments,

    /// The format of files that go to a folder, by its extension
    #[arg(long, value_name = "EXT", value_parser = extensions())]
    pub to: Option<String>,

    /// Refuse to write what the format cannot hold all of
    #[arg(long)]
    pub strict: bool,

    /// Write a report, a JSON object a line, to FILE or to standard output (-)
    #[arg(long, value_name = "FILE")]
    pub json: Option<PathBuf>,

    /// Allow the output to replace a file that exists, an input too
    #[arg(long)]
    pub overwrite: bool,

    /// What every command takes.
    #[command(flatten)]
    pub common: CommonArguments,
}

/// All extensions that are written.
fn extensions() -> PossibleValuesParser {
    PossibleValuesParser::new(FileFormat::ALL.iter().flat_map(|format| format.extensions()))
}
