//! What can be typed: the one table of commands and flags, which gives the parser and the help.

pub mod bench;
pub mod convert;
pub mod replay;
pub mod scanner;
pub mod suspects;

use std::fmt;
use std::path::PathBuf;

use clap::builder::{PossibleValuesParser, RangedU64ValueParser, TypedValueParser};
use clap::error::{ContextKind, ErrorKind};
use clap::{Args, CommandFactory, Parser, Subcommand};
use normend_core::propagation::{ETA, VIEWS};
use normend_core::shapes::ShapeKind;
use normend_core::{EdgeRule, Estimator, Method, Parameters, Preset, SideRule, SourceRule, Start};
use normend_io::ReadOptions;
use normend_render::{DisplayMode, StandardView, UpAxis};

use self::bench::BenchArguments;
use self::convert::ConvertArguments;
use self::replay::{RehearseArguments, ReplayArguments};
use self::scanner::ScannerArguments;
use self::suspects::SuspectsArguments;
use crate::commands::render::{PaletteName, PictureSize};

/// Most neighbors that can be asked for: each costs 4 bytes a point, and no surface is flat over a thousand points.
const MAX_K: u64 = 1000;
/// Most threads that can be asked for; a mistyped number must not exhaust the system.
const MAX_THREADS: u64 = 1024;
/// Most points that can be generated, for the same reason.
const MAX_POINTS: u64 = 1_000_000_000;

/// Makes the normals of a point cloud point to the right side, and lets you mend where they do not.
///
/// Without a command the editor opens.
#[derive(Debug, Parser)]
#[command(
    name = "normend",
    version,
    args_conflicts_with_subcommands = true,
    after_help = "\
Examples:
  normend                                       open the editor
  normend scan.ply                              open a scan in the editor
  normend a.ply b.e57                           open files as layers of one cloud
  normend orient scan.ply -o oriented.ply       orient without a window
  normend check oriented.ply --reference truth.ply
  normend render oriented.ply -o picture.png

Exit codes: 0 done, 1 something failed, 2 wrong use, 130 stopped by Ctrl-C."
)]
pub struct Arguments {
    /// What to do without a window.
    #[command(subcommand)]
    pub command: Option<Command>,

    /// Scan to open in the editor; several files are layers of one cloud
    #[arg(value_name = "SCAN")]
    pub scans: Vec<PathBuf>,

    /// Restore the edits of the scan that were not exported, without asking
    #[arg(long, requires = "scans")]
    pub restore: bool,
}

impl Arguments {
    /// What was typed. Help, version and wrong use end the program here.
    pub fn of_program() -> Self {
        let arguments = Self::try_parse().unwrap_or_else(|error| {
            // The parser takes the second name for a command and speaks of that.
            let is_second_scan =
                error.kind() == ErrorKind::ArgumentConflict && error.get(ContextKind::InvalidSubcommand).is_some();
            if is_second_scan {
                usage_error(None, "a command (orient, check, …) comes first, then the files").exit()
            }
            error.exit()
        });
        if let Some(command) = &arguments.command
            && let Some(flag) = command.propagation().and_then(|typed| typed.against_auto())
        {
            let sentence = format!(
                "--preset auto takes neighborhoods, normals and sources of its own: leave out {flag}, or type --preset tree"
            );
            usage_error(Some(command.name()), sentence).exit()
        }
        arguments
    }
}

/// An error with the usage of the command called `name`, or of the program.
pub fn usage_error(name: Option<&str>, sentence: impl fmt::Display) -> clap::Error {
    let mut program = Arguments::command();
    // Else commands do not know that their names begin with the program's.
    program.build();
    match name.and_then(|name| program.find_subcommand_mut(name)) {
        Some(command) => command.error(ErrorKind::ValueValidation, sentence),
        None => program.error(ErrorKind::ValueValidation, sentence),
    }
}

/// The commands that run without a window.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Orient the normals of scans and write the same files with nx ny nz
    Orient(OrientArguments),
    /// Write scans in another format, as they are
    Convert(ConvertArguments),
    /// Count the normals that point to the wrong side
    Check(CheckArguments),
    /// List the patches that probably point to the wrong side
    Suspects(SuspectsArguments),
    /// Draw a scan into a PNG picture
    Render(RenderArguments),
    /// Write a generated scan whose normals are known
    Generate(GenerateArguments),
    /// Do again what was decided in the editor, and write the scan as its export does
    Replay(ReplayArguments),
    /// Do a recipe's events one after another, with a journal
    #[command(hide = true)]
    Rehearse(RehearseArguments),
    /// Measure the methods on clouds whose normals are known
    Bench(BenchArguments),
}

impl Command {
    /// The name that is typed.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Orient(_) => "orient",
            Self::Convert(_) => "convert",
            Self::Check(_) => "check",
            Self::Suspects(_) => "suspects",
            Self::Render(_) => "render",
            Self::Generate(_) => "generate",
            Self::Replay(_) => "replay",
            Self::Rehearse(_) => "rehearse",
            Self::Bench(_) => "bench",
        }
    }

    /// How signs are to be found, where that can be typed.
    fn propagation(&self) -> Option<PropagationArguments> {
        match self {
            Self::Orient(arguments) => Some(arguments.propagation),
            Self::Replay(arguments) => Some(arguments.propagation),
            Self::Bench(arguments) => arguments.command.propagation(),
            Self::Convert(_)
            | Self::Check(_)
            | Self::Suspects(_)
            | Self::Render(_)
            | Self::Generate(_)
            | Self::Rehearse(_) => None,
        }
    }
}

/// Flags of every command.
#[derive(Clone, Copy, Debug, Args)]
pub struct CommonArguments {
    /// Threads to work with [default: one per processor]
    #[arg(long, value_name = "N", value_parser = RangedU64ValueParser::<usize>::new().range(1..=MAX_THREADS))]
    pub threads: Option<usize>,

    /// No bar and no words, only errors
    #[arg(long, short)]
    pub quiet: bool,
}

/// What is known of files that they do not say.
#[derive(Clone, Debug, Default, Args)]
pub struct ReadArguments {
    /// Names of a text's columns from the first on, in place of what stands in it: x y z, nx ny nz, red green blue, any others;
    /// - for none
    #[arg(long, value_name = "\"x y z …\"", value_parser = column_names, allow_hyphen_values = true)]
    pub columns: Option<ColumnNames>,
}

/// Names of columns, as typed.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ColumnNames(pub Vec<String>);

impl ReadArguments {
    /// How a file is read that these belong to.
    pub fn options(&self) -> ReadOptions {
        ReadOptions {
            columns: self.columns.as_ref().map(|names| names.0.clone()),
        }
    }
}

/// Parses names with spaces or commas between them.
fn column_names(typed: &str) -> Result<ColumnNames, String> {
    let is_separator = |letter: char| letter.is_whitespace() || letter == ',' || letter == ';';
    let names: Vec<String> = typed
        .split(is_separator)
        .filter(|name| !name.is_empty())
        .map(str::to_owned)
        .collect();
    let has = |wanted: &str| names.iter().any(|name| name.eq_ignore_ascii_case(wanted));
    if ["x", "y", "z"].into_iter().all(has) {
        Ok(ColumnNames(names))
    } else {
        Err("name x, y and z among them, as in \"x y z - nx ny nz\"".to_owned())
    }
}

/// How signs are found: a preset, and what is typed in place of its parameters.
#[derive(Clone, Copy, Debug, Args)]
pub struct PropagationArguments {
    /// A whole method; the flags below replace parts of it. Those of normals, graph and sources are not for auto; where no preset is
    /// named they choose tree [default: auto]
    #[arg(long, value_name = "NAME", value_parser = one_of(&Preset::ALL, Preset::name))]
    pub preset: Option<Preset>,

    /// How normals are fitted to neighborhoods
    #[arg(long, value_name = "NAME", value_parser = one_of(&Estimator::ALL, Estimator::name))]
    pub estimator: Option<Estimator>,

    /// Neighbors that a normal is fitted to
    #[arg(long, value_name = "N", value_parser = RangedU64ValueParser::<usize>::new().range(3..=MAX_K))]
    pub k_normals: Option<usize>,

    /// Neighbors of each point in the graph that signs travel along
    #[arg(long, value_name = "N", value_parser = RangedU64ValueParser::<usize>::new().range(1..=MAX_K))]
    pub k_graph: Option<usize>,

    /// How the normals of neighbors are compared
    #[arg(long, value_name = "NAME", value_parser = one_of(&EdgeRule::ALL, EdgeRule::name))]
    pub edge_rule: Option<EdgeRule>,

    /// Estimate normals, or keep those of the file with their signs
    #[arg(long, value_name = "NAME", value_parser = one_of(&Start::ALL, Start::name))]
    pub start: Option<Start>,

    /// Who vouches for the first signs
    #[arg(long, value_name = "NAME", value_parser = one_of(&SourceRule::ALL, SourceRule::name))]
    pub sources: Option<SourceRule>,

    /// Viewpoints that vote for sources: 8 are the corners of the bounding box, 14 its faces too, 26 its edges too
    #[arg(long, value_name = "N", value_parser = RangedU64ValueParser::<usize>::new().range(*VIEWS.start() as u64..=*VIEWS.end() as u64))]
    pub views: Option<usize>,

    /// How far from the ends of the votes sources are taken: in votes, or as a share for mended ones
    #[arg(long, value_name = "X", value_parser = eta)]
    pub eta: Option<f32>,

    /// Which side is the right one: what the points tell (auto), outside of objects, the scanner's, the upper one, inside of rooms, that of given normals
    /// [default: auto, or toward-scanner where its place is given]
    #[arg(long, value_name = "NAME", value_parser = one_of(&SideRule::ALL, SideRule::name))]
    pub rule: Option<SideRule>,
}

impl PropagationArguments {
    /// The first flag that was typed and that the automatic method has no use for.
    fn of_tree(&self) -> Option<&'static str> {
        let flags = [
            (self.estimator.is_some(), "--estimator"),
            (self.k_normals.is_some(), "--k-normals"),
            (self.k_graph.is_some(), "--k-graph"),
            (self.edge_rule.is_some(), "--edge-rule"),
            (self.sources.is_some(), "--sources"),
            (self.views.is_some(), "--views"),
            (self.eta.is_some(), "--eta"),
        ];
        flags.into_iter().find(|(is_typed, _)| *is_typed).map(|(_, flag)| flag)
    }

    /// A flag that contradicts the automatic method, which was asked for by its name.
    fn against_auto(&self) -> Option<&'static str> {
        self.of_tree().filter(|_| self.preset == Some(Preset::Auto))
    }

    /// A flag that has the spanning tree take the place of the automatic method, where no preset was named.
    pub fn turns_to_tree(&self) -> Option<&'static str> {
        self.of_tree().filter(|_| self.preset.is_none())
    }

    /// `base` with what was typed in its place.
    pub fn over(self, base: Parameters) -> Parameters {
        let base = self.preset.map_or(base, Preset::parameters);
        Parameters {
            method: if self.of_tree().is_some() {
                Method::SpanningTree
            } else {
                base.method
            },
            estimator: self.estimator.unwrap_or(base.estimator),
            k_normals: self
                .k_normals
                .or(self.estimator.map(Estimator::usual_k))
                .unwrap_or(base.k_normals),
            k_graph: self.k_graph.unwrap_or(base.k_graph),
            edge_rule: self.edge_rule.unwrap_or(base.edge_rule),
            start: self.start.unwrap_or(base.start),
            sources: self.sources.unwrap_or(base.sources),
            views: self.views.unwrap_or(base.views),
            eta: self.eta.unwrap_or(base.eta),
            rule: self.rule.unwrap_or(base.rule),
        }
    }
}

impl From<PropagationArguments> for Parameters {
    fn from(typed: PropagationArguments) -> Self {
        typed.over(Self::default())
    }
}

/// `normend orient`.
#[derive(Debug, Args)]
#[command(after_help = "\
The output is the file that came in, points in its order, with unit normals nx ny nz. Several inputs go to a folder \
under their own names; one that fails does not stop the others, the exit code is 1 then. A file that exists is replaced \
only with --overwrite.

The output's extension says its format; without one, or with the input's, it is the input's. In another format goes all that \
it can hold; the rest is named before the work.

The report (--json) has a line for each input: an object with input, output, points, left_out (rows without finite \
coordinates), components, sources (places where signs start), voted_sources (those found by visibility), \
without_evidence (components that no evidence tells the side of), undecided (points whose sign is no more than a guess; null \
where the method does not know), rule (what decided the sides, in words), lost (what the output's format cannot hold), found_station ([x, y, z] where all was scanned from, \
if --rule auto found it, else null), scanner (the places of the scanner that were known, in words, else null), parameters, seconds (read, neighbors, normals, \
sources where voted, graph, tree, signs, write, total) and peak_rss_bytes (of the program so far; null where the system \
does not tell). A failed input has input and error. With --together components, sources, times and the like are those of the whole \
cloud in each line, and one input that cannot be read fails all.

Where the scanner was is read from the scan (E57, PTX, PCD), from SCAN.sensors.tsv or SCAN.trajectory.txt beside it, or from \
what --scanner, --sensors or --trajectory name; points face the place that they were measured from.

The right side of each component (--rule) is decided by the scanner's places where they are known, or all was scanned from one \
place and that is found, and else as by outward (auto); by what is seen of it from outside (outward), by the scanner's place \
(toward-scanner), by +z (up), by what is seen from within (into-room), or by the file's normals (given); where that says \
nothing, by what is seen from outside.

Examples:
  normend orient scan.ply -o oriented.ply
  normend orient a.ply b.xyz -o oriented/ --json report.jsonl
  normend orient scan.ply -o oriented.ply --estimator pca --k-graph 6 --json - | jq .seconds
  normend orient meshlab.ply -o filled.ply --start keep
  normend orient nave.laz tower.e57 --together -o oriented/
  normend orient room.ply -o oriented.ply --rule into-room
  normend orient tower.ply -o oriented.ply --scanner 1.5,0,-2
  normend orient drive.laz -o oriented.laz --trajectory drive.csv")]
pub struct OrientArguments {
    /// Scans to orient: PLY, or XYZ text
    #[arg(required = true, value_name = "IN")]
    pub inputs: Vec<PathBuf>,

    /// File to write; a folder when there are several inputs
    #[arg(short, long, value_name = "OUT")]
    pub output: PathBuf,

    /// How files are read.
    #[command(flatten)]
    pub reading: ReadArguments,

    /// How signs are found.
    #[command(flatten)]
    pub propagation: PropagationArguments,

    /// Where the scanner stood.
    #[command(flatten)]
    pub scanner: ScannerArguments,

    /// Write how sure each normal is of its side: confidence (of points at 0.9 nine in ten are right) and oriented (0 where the
    /// side is no more than a guess). For the preset auto; to PLY from PLY, or text whose columns have names
    #[arg(long)]
    pub confidence: bool,

    /// Orient all inputs as one cloud, parts of one scan in the same coordinates; each is written to its own file
    #[arg(long)]
    pub together: bool,

    /// Refuse to write what the output's format cannot hold all of
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

/// `normend check`.
#[derive(Debug, Args)]
#[command(after_help = "\
A normal is wrong when it points away from the reference normal (dot product below 0) or is missing. Points whose \
reference normal is zero are not judged. Both files hold the same points in the same order. Counted are the normals as \
they are, after the best flip of the whole cloud, and after the best flip of each component of the graph of 10 nearest \
neighbors.

Examples:
  normend check oriented.ply --reference truth.ply
  normend check oriented.ply --reference truth.ply --json | jq .wrong")]
pub struct CheckArguments {
    /// Scan with the normals to check
    pub result: PathBuf,

    /// The same scan with the right normals
    #[arg(long, value_name = "TRUTH")]
    pub reference: PathBuf,

    /// How files are read.
    #[command(flatten)]
    pub reading: ReadArguments,

    /// Write one JSON object to standard output
    #[arg(long)]
    pub json: bool,

    /// What every command takes.
    #[command(flatten)]
    pub common: CommonArguments,
}

/// `normend render`.
#[derive(Debug, Args)]
#[command(after_help = "\
Normals of the file are drawn as they are; points without normals get oriented ones first, as `normend orient` gives \
them. No display is needed, only a graphics driver, which may be software (Mesa's lavapipe; where XDG_RUNTIME_DIR is not \
set, Mesa itself complains of that on standard error, and draws all the same). A picture that exists is replaced only with \
--overwrite.

Examples:
  normend render oriented.ply -o picture.png
  normend render oriented.ply -o top.png --size 1920x1080 --view top --palette paper
  normend render oriented.ply -o figure.png --size 7680x4320 --mode lit --transparent
  normend render oriented.ply -o film.png --turntable 72")]
pub struct RenderArguments {
    /// Scan to draw: PLY, or XYZ text
    pub input: PathBuf,

    /// Picture to write (PNG)
    #[arg(short, long, value_name = "PNG")]
    pub output: PathBuf,

    /// How files are read.
    #[command(flatten)]
    pub reading: ReadArguments,

    /// Width and height in pixels
    #[arg(long, value_name = "WxH", default_value_t = PictureSize::default())]
    pub size: PictureSize,

    /// Coloring of the splats; colors are those of the file
    #[arg(long, value_name = "NAME", value_parser = one_of(&DisplayMode::ALL, DisplayMode::name), default_value = DisplayMode::default().name())]
    pub mode: DisplayMode,

    /// Side to look from
    #[arg(long, value_name = "NAME", value_parser = one_of(&StandardView::ALL, StandardView::name), default_value = StandardView::Corner.name())]
    pub view: StandardView,

    /// Axis that stands upright; sides are named after it
    #[arg(long, value_name = "AXIS", allow_hyphen_values = true, value_parser = one_of(&UpAxis::ALL, UpAxis::name), default_value = UpAxis::default().name())]
    pub up: UpAxis,

    /// Colors of front and back
    #[arg(long, value_name = "NAME", value_parser = one_of(&PaletteName::ALL, PaletteName::name), default_value = PaletteName::default().name())]
    pub palette: PaletteName,

    /// Draw so many pictures while the scan turns once around, numbered before .png: PNG_000.png and so on
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(2..=999))]
    pub turntable: Option<u32>,

    /// Leave the background out, for a page of any color
    #[arg(long)]
    pub transparent: bool,

    /// Allow the picture to replace a file that exists
    #[arg(long)]
    pub overwrite: bool,

    /// What every command takes.
    #[command(flatten)]
    pub common: CommonArguments,
}

/// `normend generate`.
#[derive(Debug, Args)]
#[command(after_help = "\
The scan has positions only; --truth writes the same points with their exact outward normals, to check a result \
against. Files that exist are replaced only with --overwrite.

Examples:
  normend generate torus -o torus.ply --truth torus_truth.ply --points 100000
  normend orient torus.ply -o oriented.ply
  normend check oriented.ply --reference torus_truth.ply")]
pub struct GenerateArguments {
    /// Which shape
    #[arg(value_parser = one_of(&ShapeKind::ALL, ShapeKind::name))]
    pub shape: ShapeKind,

    /// File to write: .ply, .xyz, .csv, …
    #[arg(short, long, value_name = "OUT")]
    pub output: PathBuf,

    /// File to write the same points to with their exact normals
    #[arg(long, value_name = "FILE")]
    pub truth: Option<PathBuf>,

    /// Number of points
    #[arg(
        long,
        value_name = "N",
        default_value_t = 100_000,
        value_parser = RangedU64ValueParser::<usize>::new().range(1..=MAX_POINTS)
    )]
    pub points: usize,

    /// Standard deviation of noise on each axis, as a share of the bounding box's diagonal
    #[arg(long, value_name = "S", default_value_t = 0.0, value_parser = noise)]
    pub noise: f32,

    /// Number that the noise follows from
    #[arg(long, value_name = "N", default_value_t = 1)]
    pub seed: u64,

    /// Allow the outputs to replace files that exist
    #[arg(long)]
    pub overwrite: bool,

    /// What every command takes.
    #[command(flatten)]
    pub common: CommonArguments,
}

/// Parses a standard deviation: noise of more than the whole shape has no surface left.
fn noise(typed: &str) -> Result<f32, String> {
    let parsed: Option<f32> = typed.parse().ok();
    parsed
        .filter(|deviation| (0.0..=1.0).contains(deviation))
        .ok_or_else(|| "type a number from 0 to 1".to_owned())
}

/// Parses how far from the ends of the votes sources are taken.
fn eta(typed: &str) -> Result<f32, String> {
    let parsed: Option<f32> = typed.parse().ok();
    parsed
        .filter(|eta| ETA.contains(eta))
        .ok_or_else(|| format!("type a number from {} to {}", ETA.start(), ETA.end()))
}

/// Parses one of `all` by its name, so that the lists of the crates are the only ones.
fn one_of<T>(all: &'static [T], name: fn(T) -> &'static str) -> impl TypedValueParser<Value = T>
where
    T: Copy + Send + Sync + 'static,
{
    PossibleValuesParser::new(all.iter().map(|&value| name(value))).try_map(move |typed| {
        let found = all.iter().copied().find(|&value| name(value) == typed);
        found.ok_or("is not one of the names")
    })
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;

    #[test]
    fn the_table_of_flags_is_consistent() {
        Arguments::command().debug_assert();
    }

    #[test]
    fn a_file_opens_the_editor_and_a_name_runs_a_command() {
        let opened = Arguments::try_parse_from(["normend", "scan.ply"]).unwrap();
        assert!(opened.command.is_none());
        assert_eq!(opened.scans, [PathBuf::from("scan.ply")]);
        let empty = Arguments::try_parse_from(["normend"]).unwrap();
        assert!(empty.command.is_none() && empty.scans.is_empty());
        let oriented = Arguments::try_parse_from(["normend", "orient", "a.ply", "-o", "b.ply"]).unwrap();
        assert!(matches!(oriented.command, Some(Command::Orient(_))));
    }

    #[test]
    fn every_name_of_the_lists_is_understood() {
        for estimator in Estimator::ALL {
            for rule in EdgeRule::ALL {
                for start in Start::ALL {
                    let typed = [
                        "normend",
                        "orient",
                        "a.ply",
                        "-o",
                        "b.ply",
                        "--estimator",
                        estimator.name(),
                    ];
                    let typed = typed
                        .into_iter()
                        .chain(["--edge-rule", rule.name(), "--start", start.name()]);
                    let Some(Command::Orient(orient)) = Arguments::try_parse_from(typed).unwrap().command else {
                        panic!("not parsed as orient");
                    };
                    let parameters = Parameters::from(orient.propagation);
                    assert_eq!(
                        (parameters.estimator, parameters.edge_rule, parameters.start),
                        (estimator, rule, start)
                    );
                }
            }
        }
    }

    #[test]
    fn nothing_typed_is_the_default_of_the_core() {
        let typed = ["normend", "orient", "a.ply", "-o", "b.ply"];
        let Some(Command::Orient(orient)) = Arguments::try_parse_from(typed).unwrap().command else {
            panic!("not parsed as orient");
        };
        assert_eq!(Parameters::from(orient.propagation), Parameters::default());
    }

    #[test]
    fn a_preset_gives_what_is_not_typed() {
        for preset in Preset::ALL {
            let typed = [
                "normend",
                "orient",
                "a.ply",
                "-o",
                "b.ply",
                "--eta",
                "0.5",
                "--preset",
                preset.name(),
            ];
            let Some(Command::Orient(orient)) = Arguments::try_parse_from(typed).unwrap().command else {
                panic!("not parsed as orient");
            };
            let expect = Parameters {
                eta: 0.5,
                method: Method::SpanningTree,
                ..preset.parameters()
            };
            assert_eq!(Parameters::from(orient.propagation), expect);
        }
    }

    #[test]
    fn places_of_the_scanner() {
        let stand = |typed: &str| {
            let typed = ["normend", "orient", "a.ply", "-o", "b.ply", "--scanner", typed];
            match Arguments::try_parse_from(typed).ok()?.command {
                Some(Command::Orient(orient)) => orient.scanner.scanner,
                _ => None,
            }
        };
        assert_eq!(stand("-1.5,0, 2e3"), Some(DVec3::new(-1.5, 0.0, 2000.0)));
        for wrong in ["", "1,2", "1,2,3,4", "1,2,x", "1,2,nan", "1 2 3"] {
            assert_eq!(stand(wrong), None, "{wrong}");
        }
    }

    #[test]
    fn wrong_values_are_refused() {
        for wrong in [
            ["--k-normals", "2"],
            ["--k-graph", "0"],
            ["--k-graph", "1001"],
            ["--threads", "0"],
            ["--estimator", "ransac"],
            ["--start", ""],
            ["--preset", "magic"],
            ["--sources", "all"],
            ["--views", "27"],
            ["--eta", "-0.1"],
            ["--eta", "nan"],
        ] {
            let typed = ["normend", "orient", "a.ply", "-o", "b.ply"].into_iter().chain(wrong);
            assert!(Arguments::try_parse_from(typed).is_err(), "{wrong:?} was accepted");
        }
    }
}
