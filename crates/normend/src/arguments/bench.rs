//! What can be typed after `normend bench`.

use std::path::PathBuf;

use clap::{Args, Subcommand};
use normend_core::suspects;

use super::suspects::share;
use super::{CommonArguments, PropagationArguments};

/// `normend bench`.
#[derive(Debug, Args)]
pub struct BenchArguments {
    /// What to measure.
    #[command(subcommand)]
    pub command: BenchCommand,
}

/// What can be measured.
#[derive(Debug, Subcommand)]
pub enum BenchCommand {
    /// Write the generated clouds that methods are compared on
    Clouds(CloudsArguments),
    /// Count the normals that come out wrong, class by class
    Quality(QualityArguments),
    /// Count the clicks of a simulated user until no wrong region is left
    Clicks(ClicksArguments),
    /// Count the suspects that are wrong, and compare confidence with what is right
    Suspects(SuspectsArguments),
    /// Make the figures of the paper as tables
    Paper(PaperArguments),
}

impl BenchCommand {
    /// How signs are to be found, where that can be typed.
    pub(super) fn propagation(&self) -> Option<PropagationArguments> {
        match self {
            Self::Quality(arguments) => Some(arguments.propagation),
            Self::Clicks(arguments) => Some(arguments.propagation),
            Self::Suspects(arguments) => Some(arguments.propagation),
            Self::Clouds(_) | Self::Paper(_) => None,
        }
    }
}

/// `normend bench clouds`.
#[derive(Debug, Args)]
#[command(after_help = "\
Each cloud is DIR/<class>/<name>.raw.ply (positions only) and DIR/<class>/<name>.ply (the same with exact outward \
normals); a scan has <name>.sensors.tsv too: first point, count, and position of the scanner of each station. The clouds \
are the same every time. Files that exist are replaced only with --overwrite.

Examples:
  normend bench clouds generated/
  normend bench clouds generated/ --only wedge_5 --only mug")]
pub struct CloudsArguments {
    /// Folder to write to
    #[arg(value_name = "DIR")]
    pub folder: PathBuf,

    /// Only the clouds of this name or class; can be given several times
    #[arg(long, value_name = "NAME")]
    pub only: Vec<String>,

    /// Allow files that exist to be replaced
    #[arg(long)]
    pub overwrite: bool,

    /// What every command takes.
    #[command(flatten)]
    pub common: CommonArguments,
}

/// `normend bench quality`.
#[derive(Debug, Args)]
#[command(after_help = "\
Each DIR/<class>/<name>.raw.ply is oriented and compared with DIR/<class>/<name>.ply, as `normend check` does; clouds \
without a truth are left out and counted. `normend bench clouds` writes such a folder.

A row has the number of clouds; mean, median and worst share of wrong normals; how many clouds have no wrong normal (at \
0), and no 10 or more connected ones (no region), in the graph of 10 nearest neighbors; the mean angle between the \
normals' lines in degrees; the seconds of all its clouds. Nothing may be flipped, save a whole cloud of the class open. \
Scans of rooms (scan/room…) are a row by themselves.

As many clouds as threads are worked on at once, each on one thread; counts do not depend on it, and with --threads 1 \
nothing else disturbs the seconds.

Examples:
  normend bench quality generated/
  normend bench quality generated/ --only noise --clouds --estimator pca
  normend bench quality generated/ --json - | jq .all.mean_wrong_share")]
pub struct QualityArguments {
    /// Folder of classes of clouds
    #[arg(value_name = "DIR")]
    pub folder: PathBuf,

    /// How signs are found.
    #[command(flatten)]
    pub propagation: PropagationArguments,

    /// Only the clouds of this name or class; can be given several times
    #[arg(long, value_name = "NAME")]
    pub only: Vec<String>,

    /// A row for each cloud too
    #[arg(long)]
    pub clouds: bool,

    /// Write all numbers as JSON to FILE, or to standard output (-) in place of the table
    #[arg(long, value_name = "FILE")]
    pub json: Option<PathBuf>,

    /// Allow the report to replace a file that exists
    #[arg(long)]
    pub overwrite: bool,

    /// What every command takes.
    #[command(flatten)]
    pub common: CommonArguments,
}

/// `normend bench clicks`.
#[derive(Debug, Args)]
#[command(after_help = "\
Each DIR/<class>/<name>.raw.ply is oriented; then a user who knows DIR/<class>/<name>.ply clicks the middle of the largest \
wrong region, until none of 10 or more connected points is left, or 60 times. Wholes of the class open, and scans of rooms \
(scan/room…), may be flipped before the first click.

A row for each kind of user: tree mends along the tree, default takes the patch that is offered first, wheel turns the \
wheel to the patch that mends most. Where there are no patches, all mend along the tree. Over the clouds that had a wrong \
region, it has the mean and median of clicks, the mean of steps of the wheel, the share of harmful clicks (more points are \
wrong than before), the points that a click turns, on how many clouds the user gave up, and how long a preview with its \
click takes.

Examples:
  normend bench clicks generated/
  normend bench clicks generated/ --only close_sheets --clouds")]
pub struct ClicksArguments {
    /// Folder of classes of clouds
    #[arg(value_name = "DIR")]
    pub folder: PathBuf,

    /// How signs are found.
    #[command(flatten)]
    pub propagation: PropagationArguments,

    /// Only the clouds of this name or class; can be given several times
    #[arg(long, value_name = "NAME")]
    pub only: Vec<String>,

    /// Rows for each cloud that had a wrong region too
    #[arg(long)]
    pub clouds: bool,

    /// What every command takes.
    #[command(flatten)]
    pub common: CommonArguments,
}

/// `normend bench suspects`.
#[derive(Debug, Args)]
#[command(after_help = "\
Each DIR/<class>/<name>.raw.ply is oriented and searched for suspects, as `normend suspects` does, and both are compared with \
DIR/<class>/<name>.ply. With another preset than auto, its result is what is searched. Wholes of the class open, and scans of \
rooms (scan/room…), may be flipped, and are no suspects then.

A row has the clouds without a wrong region (10 or more connected points) and on how many of them there is a suspect all the \
same; the clouds with one and on how many of them there is a suspect; and on these how many are right, which is when most of \
its points are wrong: of the first ones, the first three, and all.

The table below has the points by the confidence of the automatic method: where a bin begins, how many points, their mean \
confidence, and the share that is right. The class real is left out of it, where the side of an unknown scanner is asked for.

Examples:
  normend bench suspects generated/
  normend bench suspects generated/ --preset tree --clouds")]
pub struct SuspectsArguments {
    /// Folder of classes of clouds
    #[arg(value_name = "DIR")]
    pub folder: PathBuf,

    /// How signs are found.
    #[command(flatten)]
    pub propagation: PropagationArguments,

    /// The score from which on a patch is a suspect
    #[arg(long, value_name = "X", default_value_t = suspects::THRESHOLD, value_parser = share)]
    pub threshold: f32,

    /// Only the clouds of this name or class; can be given several times
    #[arg(long, value_name = "NAME")]
    pub only: Vec<String>,

    /// A row for each cloud with a wrong region or a suspect too
    #[arg(long)]
    pub clouds: bool,

    /// What every command takes.
    #[command(flatten)]
    pub common: CommonArguments,
}

/// `normend bench paper`.
#[derive(Debug, Args)]
#[command(after_help = "\
Tables in Markdown after the figures of Liu et al., *Mendable Consistent Orientation of Point Clouds*, over the clouds \
DIR/<class>/<name>.raw.ply with their truth <name>.ply: number and purity of sources against eta (Fig. 5), normal \
estimators (Fig. 6), noise on a generated octahedron (Fig. 12), sorted shares of wrong normals (Fig. 14), and the time of \
each stage.

Examples:
  normend bench paper generated/ -o paper.md
  normend bench paper given/ generated/ --only sharp")]
pub struct PaperArguments {
    /// Folders of classes of clouds
    #[arg(required = true, value_name = "DIR")]
    pub folders: Vec<PathBuf>,

    /// Only the clouds of this name or class; can be given several times
    #[arg(long, value_name = "NAME")]
    pub only: Vec<String>,

    /// File to write, in place of standard output
    #[arg(short, long, value_name = "FILE")]
    pub output: Option<PathBuf>,

    /// Allow the output to replace a file that exists
    #[arg(long)]
    pub overwrite: bool,

    /// What every command takes.
    #[command(flatten)]
    pub common: CommonArguments,
}
