//! What can be typed after `normend bench`.

use std::path::PathBuf;

use clap::{Args, Subcommand};

use super::CommonArguments;

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
