//! `normend suspects`: the patches of a scan that probably point to the wrong side.

use std::fmt::Write as _;
use std::io::{self, Write as _};
use std::path::Path;

use anyhow::Context;
use normend_core::confidence::{confidence, n_undecided};
use normend_core::evidence::Known;
use normend_core::progress::Part;
use normend_core::suspects::{Kind, Settings, Suspect, suspects};
use normend_core::{Parameters, Propagation, SideRule};
use normend_io::Scan;
use serde::Serialize;

use super::batch::open_report;
use super::{Outcome, prepare, scanner, title_of, wrong_use};
use crate::arguments::suspects::SuspectsArguments;
use crate::console::{Bar, counted};

/// What `--json` writes.
#[derive(Debug, Serialize)]
struct Report<'a> {
    input: &'a Path,
    points: usize,
    normals: &'static str,
    undecided: usize,
    threshold: f32,
    suspects: Vec<Row>,
}

/// One suspect, in the file's terms.
#[derive(Debug, Serialize)]
struct Row {
    score: f32,
    points: usize,
    row: u32,
    center: [f64; 3],
    kind: &'static str,
    seam: f32,
    votes_for: f32,
    votes_against: f32,
    #[serde(skip)]
    reasons: String,
}

/// Looks for suspects and prints them.
///
/// # Errors
/// Wrong use, a file that cannot be read, a report that cannot be written, Ctrl-C.
pub fn run(arguments: &SuspectsArguments) -> anyhow::Result<Outcome> {
    scanner::check(&arguments.scanner, arguments.rule)?;
    if arguments.rule == Some(SideRule::Given) {
        return Err(wrong_use(
            "the rule given would judge the file's normals by themselves: choose another rule",
        ));
    }
    let json = arguments.json.as_deref();
    if json.is_some_and(|report| normend_io::is_same_file(report, &arguments.input)) {
        return Err(wrong_use(
            "the report of --json would take the place of the scan: give it another name",
        ));
    }
    prepare(&arguments.common)?;
    let mut file = json.map(|path| open_report(path, arguments.overwrite)).transpose()?;
    let bar = Bar::new(&title_of(&arguments.input), arguments.common.quiet);
    let scan = super::read(&arguments.input, &arguments.reading, &bar, &Part::new(&bar, 0.0..0.1))?;
    let part = Part::new(&bar, 0.1..0.12);
    let places = scanner::places(&arguments.scanner, arguments.rule, &scan, &arguments.input, &bar, &part)?;
    let known = Known {
        given: scan.given_normals.as_ref().map(|normals| normals.as_slice()),
        stations: &places.stations,
        track: places.track.as_deref(),
        ..Known::default()
    };
    let usual = Parameters::default();
    let rule = match arguments.rule {
        None if arguments.scanner.is_given() => SideRule::TowardScanner,
        rule => rule.unwrap_or(usual.rule),
    };
    let parameters = Parameters { rule, ..usual };
    let automatic = Propagation::new(&scan.cloud, known, parameters, &Part::new(&bar, 0.12..0.9))?;
    let initial;
    let normals = match known.given {
        Some(given) => given,
        None => {
            initial = automatic.initial_normals();
            &initial
        }
    };
    let settings = Settings {
        threshold: arguments.threshold,
        most: arguments.top,
    };
    let found = suspects(&scan.cloud, &automatic, normals, settings, &Part::new(&bar, 0.9..1.0))?;
    let found = found.context("the automatic method left nothing to judge by")?;
    drop(bar);
    let report = Report {
        input: &arguments.input,
        points: scan.cloud.n_points(),
        normals: match known.given {
            Some(_) => "given",
            None => "automatic",
        },
        undecided: confidence(&automatic).as_deref().map_or(0, n_undecided),
        threshold: arguments.threshold,
        suspects: found.iter().map(|suspect| row(suspect, &scan)).collect(),
    };
    if json != Some(Path::new("-")) {
        let mut out = io::stdout().lock();
        out.write_all(in_words(&report).as_bytes())
            .and_then(|()| out.flush())
            .context("cannot write to standard output")?;
    }
    if let Some(file) = &mut file {
        let mut text = serde_json::to_vec(&report).context("cannot put the report into JSON")?;
        text.push(b'\n');
        file.write_all(&text)
            .and_then(|()| file.flush())
            .context("cannot write the report")?;
    }
    Ok(Outcome::Done)
}

/// A suspect in the file's coordinates and rows.
fn row(suspect: &Suspect, scan: &Scan) -> Row {
    let position = scan.cloud.relative(suspect.point as usize);
    let row = match scan.rows() {
        Some(rows) => rows[suspect.point as usize],
        None => suspect.point,
    };
    Row {
        score: suspect.score,
        points: suspect.points.len(),
        row,
        center: (scan.cloud.origin() + position).to_array(),
        kind: suspect.kind.name(),
        seam: suspect.seam,
        votes_for: suspect.votes_for,
        votes_against: suspect.votes_against,
        reasons: reasons(suspect),
    }
}

/// Why, for a person.
fn reasons(suspect: &Suspect) -> String {
    let kind = match suspect.kind {
        Kind::Differs => "the automatic method has it the other way round",
        Kind::Doubtful => "the automatic method is not sure of it",
        Kind::Whole => "a whole component is the other way round than the automatic method has it",
    };
    let seam = match suspect.kind {
        Kind::Whole => String::new(),
        Kind::Differs | Kind::Doubtful => format!("; seam {:.2}", suspect.seam),
    };
    let votes = if suspect.votes_for + suspect.votes_against > 0.0 {
        format!(
            "; votes {:.1} for, {:.1} against",
            suspect.votes_for, suspect.votes_against
        )
    } else {
        "; not seen".to_owned()
    };
    format!("{kind}{seam}{votes}")
}

/// The suspects as aligned rows, or a sentence why there are none.
fn in_words(report: &Report<'_>) -> String {
    if report.suspects.is_empty() {
        return format!(
            "no suspects: no patch of {} that is expected to be wrong by a share of {:.2} or more\n",
            counted(normend_core::suspects::LEAST_POINTS, "point"),
            report.threshold
        );
    }
    let mut text = format!(
        "{:>4} {:>6} {:>9} {:>14} {:>14} {:>14}  reasons\n",
        "rank", "score", "points", "x", "y", "z"
    );
    for (rank, row) in (1..).zip(&report.suspects) {
        let [x, y, z] = row.center;
        // Writing to a string does not fail.
        let _ = writeln!(
            text,
            "{rank:>4} {:>6.2} {:>9} {x:>14.6} {y:>14.6} {z:>14.6}  {}",
            row.score, row.points, row.reasons
        );
    }
    text
}
