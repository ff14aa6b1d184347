//! What can be typed after `normend replay`, and after `normend rehearse`, which tests use.

use std::path::PathBuf;

use clap::Args;

use super::scanner::ScannerArguments;
use super::{CommonArguments, PropagationArguments};

/// `normend replay`.
#[derive(Debug, Args)]
#[command(after_help = "\
Does again what was decided in the editor: the output has the same bytes as an export from there. A recipe is saved in the \
editor (Ctrl-S); journals, which the editor keeps of unexported edits, are recipes too. Nothing is written but the output and the \
report.

The recipe must be of IN's very content. Where IN holds the same points in the same order but other values beside them, \
--same-points allows it. Flags of the method replace parameters of the recipe; what was decided stays as it is, and the rest is \
oriented anew around it. Places of the scanner that the editor found with the scan are found again, those that were typed are in the \
recipe.

A recipe of several files takes these in its order, and each is written to its own file in the folder OUT.

The report (--json) has a line for each file, an object with recipe, input, output, points, left_out (rows without finite coordinates), edits, \
sources, marks (points set for themselves), pinned, same_content, rule (what decided the sides, in words), parameters, seconds \
(read, orient, write, total) and peak_rss_bytes (null where the system does not tell). A failed replay has recipe, input and error.

Examples:
  normend replay church.normend church.ply -o church_oriented.ply
  normend replay church.normend church.ply -o church_tree.ply --preset tree --k-graph 8
  normend replay abbey.normend nave.laz tower.e57 -o oriented/
  normend replay church.normend church_colored.ply -o out.ply --same-points --json - | jq .edits")]
pub struct ReplayArguments {
    /// Recipe that the editor saved
    #[arg(value_name = "RECIPE")]
    pub recipe: PathBuf,

    /// Scan that it was made for; of several files, all of them in the order of the recipe
    #[arg(value_name = "IN", required = true)]
    pub inputs: Vec<PathBuf>,

    /// File to write, or a folder for files of the same names
    #[arg(short, long, value_name = "OUT")]
    pub output: PathBuf,

    /// IN is another file than the recipe's, with the same points in the same order
    #[arg(long)]
    pub same_points: bool,

    /// How signs are found, in place of what the recipe says.
    #[command(flatten)]
    pub propagation: PropagationArguments,

    /// Where the scanner stood.
    #[command(flatten)]
    pub scanner: ScannerArguments,

    /// Write how sure the automatic method is of each normal before any mend: confidence and oriented, as normend orient does
    #[arg(long)]
    pub confidence: bool,

    /// Write a report, a JSON object, to FILE or to standard output (-)
    #[arg(long, value_name = "FILE")]
    pub json: Option<PathBuf>,

    /// Allow the output to replace a file that exists, the input too
    #[arg(long)]
    pub overwrite: bool,

    /// What every command takes.
    #[command(flatten)]
    pub common: CommonArguments,
}

/// `normend rehearse`.
#[derive(Debug, Args)]
pub struct RehearseArguments {
    /// Recipe whose events are done one after another
    #[arg(value_name = "RECIPE")]
    pub recipe: PathBuf,

    /// Scan that it was made for
    #[arg(value_name = "IN", required = true)]
    pub inputs: Vec<PathBuf>,
}
