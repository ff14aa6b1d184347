//! `normend replay`: a recipe done again without a window. And `normend rehearse`, the same as slowly as a user, with a journal.

use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use anyhow::{Context, anyhow};
use normend_app::journal::found;
use normend_app::session::Session;
use normend_core::confidence::confidence;
use normend_core::evidence::{Known, Station};
use normend_core::progress::Part;
use normend_core::{EditError, Parameters, Progress, Propagation, SideRule, Silent};
use normend_io::recipe::{self, End, Event, Recipe};
use normend_io::{ReadOptions, Scan, ScannerFiles, ScannerPlaces, WriteOptions, is_same_file};
use serde::Serialize;

use super::batch::open_report;
use super::orient::serialize_parameters;
use super::{Outcome, check_may_write, check_scan_name, prepare, say_other_names, scanner, title_of, wrong_use};
use crate::arguments::replay::{RehearseArguments, ReplayArguments};
use crate::console::{self, Bar, counted};
use crate::memory::peak_rss_bytes;

/// What `--json` writes.
#[derive(Debug, Serialize)]
#[serde(untagged)]
enum Report<'a> {
    Done(Box<Replayed>),
    Failed {
        recipe: &'a Path,
        input: &'a Path,
        error: String,
    },
}

/// What is reported of a recipe that was replayed.
#[derive(Debug, Serialize)]
struct Replayed {
    recipe: PathBuf,
    input: PathBuf,
    output: PathBuf,
    points: usize,
    left_out: usize,
    edits: usize,
    sources: usize,
    marks: usize,
    pinned: usize,
    same_content: bool,
    /// What decided the sides, in words.
    rule: String,
    #[serde(serialize_with = "serialize_parameters")]
    parameters: Parameters,
    seconds: Seconds,
    peak_rss_bytes: Option<u64>,
}

/// Wall seconds.
#[derive(Debug, Serialize)]
struct Seconds {
    read: f64,
    orient: f64,
    write: f64,
    total: f64,
}

/// Replays a recipe.
///
/// # Errors
/// Wrong use, a report that cannot be written, Ctrl-C. What is wrong with the recipe or the scan is said and reported instead.
pub fn run(arguments: &ReplayArguments) -> anyhow::Result<Outcome> {
    check(arguments)?;
    prepare(&arguments.common)?;
    let json = arguments.json.as_deref();
    let mut report = json.map(|path| open_report(path, arguments.overwrite)).transpose()?;
    let bar = Bar::new(&title_of(&arguments.input), arguments.common.quiet);
    let (outcome, line) = match replay(arguments, &bar) {
        Ok(replayed) => {
            bar.say(&format!(
                "{}: {} of {} on {}, {:.1} s → {}",
                arguments.input.display(),
                counted(replayed.edits, "edit"),
                arguments.recipe.display(),
                counted(replayed.points, "point"),
                replayed.seconds.total,
                arguments.output.display()
            ));
            (Outcome::Done, Report::Done(Box::new(replayed)))
        }
        Err(error) if console::is_stopped() => return Err(error),
        Err(error) => {
            let error = console::in_words(&error);
            bar.say_error(&format!("error: {error}"));
            let (recipe, input) = (&*arguments.recipe, &*arguments.input);
            (Outcome::Failed, Report::Failed { recipe, input, error })
        }
    };
    if let Some(report) = &mut report {
        let mut line = serde_json::to_vec(&line).context("cannot put the report into JSON")?;
        line.push(b'\n');
        report
            .write_all(&line)
            .and_then(|()| report.flush())
            .context("cannot write the report")?;
    }
    Ok(outcome)
}

/// Refuses, before the work, what would lose a file.
fn check(arguments: &ReplayArguments) -> anyhow::Result<()> {
    let (recipe, input, output) = (&arguments.recipe, &arguments.input, &arguments.output);
    check_scan_name(output, Some(input))?;
    scanner::check(&arguments.scanner, arguments.propagation.rule)?;
    if is_same_file(recipe, output) || recipe == output {
        return Err(wrong_use("the output would take the place of the recipe: name another"));
    }
    if !arguments.overwrite && is_same_file(input, output) {
        return Err(wrong_use(format!(
            "{} is the input: name another output, or allow it with --overwrite",
            output.display()
        )));
    }
    let is_taken = |report: &Path| {
        report == output || is_same_file(report, input) || is_same_file(report, recipe) || is_same_file(report, output)
    };
    if arguments.json.as_deref().is_some_and(is_taken) {
        return Err(wrong_use(
            "the report of --json would take the place of another file: give it another name",
        ));
    }
    Ok(())
}

/// Reads, decides and orients as the recipe says, and writes.
fn replay(arguments: &ReplayArguments, bar: &Bar) -> anyhow::Result<Replayed> {
    check_may_write(&arguments.output, arguments.overwrite)?;
    let started = Instant::now();
    let recipe = read_recipe(&arguments.recipe, bar)?;
    let reading = ReadOptions {
        columns: recipe.head.scan.columns.clone(),
    };
    let scan = normend_io::read_with(&arguments.input, &reading, &Part::new(bar, 0.0..0.1))?;
    let read = started.elapsed().as_secs_f64();
    let same_content = check_scan(&recipe, &scan, arguments)?;

    let orient_started = Instant::now();
    let left_out = scan.n_left_out;
    let places = scanner::places(&arguments.scanner, None, &scan, &arguments.input, bar, &Part::new(bar, 0.1..0.12))?;
    let mut session = Session::new(scan, title_of(&arguments.input));
    session.scanner.places = places;
    session.begin_with(recipe.head.parameters);
    session.take_recipe(&recipe)?;
    if arguments.propagation.rule == Some(SideRule::TowardScanner) && !session.has_scanner() {
        return Err(anyhow!(
            "the rule toward-scanner needs the scanner's place, which neither the recipe nor the scan says: give --scanner X,Y,Z, \
             --sensors TSV or --trajectory FILE"
        ));
    }
    let parameters = arguments.propagation.over(session.document.parameters());
    let propagation = propagation(&session, parameters, &Part::new(bar, 0.12..0.9))?;
    session.install(propagation);
    let sureness = if arguments.confidence {
        let found = session.document.propagation().and_then(confidence);
        Some(found.context("--confidence is known for the automatic method only, and the recipe has another: say --start estimate --preset auto, or \
             leave it out")?)
    } else {
        None
    };
    let normals = session.document.oriented_normals().ok_or(EditError::NotReady)?;
    let rule = session.rule().ok_or(EditError::NotReady)?;
    let orient = orient_started.elapsed().as_secs_f64();

    let write_started = Instant::now();
    let options = WriteOptions {
        rule: rule.clone(),
        overwrite_input: arguments.overwrite,
        ..WriteOptions::default()
    };
    let writing = Part::new(bar, 0.9..1.0);
    writing.report(0.0)?;
    say_other_names(&arguments.output, bar);
    session
        .scan
        .write_with_confidence(&normals, sureness.as_deref(), &arguments.output, &options, &writing)?;

    let document = &session.document;
    Ok(Replayed {
        recipe: arguments.recipe.clone(),
        input: arguments.input.clone(),
        output: arguments.output.clone(),
        points: document.cloud().n_points(),
        left_out,
        edits: recipe.history().1,
        sources: document.sources().len(),
        marks: document.marks().len(),
        pinned: document.marks().n_pinned(),
        same_content,
        rule,
        parameters,
        seconds: Seconds {
            read,
            orient,
            write: write_started.elapsed().as_secs_f64(),
            total: started.elapsed().as_secs_f64(),
        },
        peak_rss_bytes: peak_rss_bytes(),
    })
}

fn read_recipe(path: &Path, bar: &Bar) -> anyhow::Result<Recipe> {
    let reading = recipe::read(path)?;
    match reading.end {
        End::Whole => {}
        End::CutOff => bar.say(&format!(
            "{} ends in the middle of a line, as a journal does after a crash: all before that line is replayed",
            path.display()
        )),
        End::Damaged(broken) => return Err(anyhow!("{}, {broken}", path.display())),
    }
    Ok(reading.recipe)
}

/// Whether the scan is the recipe's very file; refuses other ones, unless they are said to have the same points.
fn check_scan(recipe: &Recipe, scan: &Scan, arguments: &ReplayArguments) -> anyhow::Result<bool> {
    let (of, here) = (&recipe.head.scan, scan.identity(&title_of(&arguments.input)));
    if of.is_same_content(&here) {
        return Ok(true);
    }
    if of.n_points != here.n_points {
        return Err(anyhow!(
            "{} is of {} with {} points, and {} has {}: give the scan that it was made for",
            arguments.recipe.display(),
            of.name,
            of.n_points,
            arguments.input.display(),
            here.n_points
        ));
    }
    if !arguments.same_points {
        return Err(anyhow!(
            "{} is not the content that {} was made for ({}): give that, or say --same-points if it holds the same points in the same order",
            arguments.input.display(),
            arguments.recipe.display(),
            of.name
        ));
    }
    Ok(false)
}

/// What the editor would find with these parameters.
fn propagation(session: &Session, parameters: Parameters, progress: &dyn Progress) -> anyhow::Result<Propagation> {
    let document = &session.document;
    let stations: Vec<Station> = session.stations().cloned().collect();
    let known = Known {
        given: document.given_normals().map(|normals| normals.as_slice()),
        stations: &stations,
        track: session.track().map(|track| &**track),
        viewpoints: &document.state().viewpoints,
    };
    Ok(Propagation::new(document.cloud(), known, parameters, progress)?)
}

/// Does a recipe's events one after another as the editor does them, each into the journal, and prints the number of those that
/// are done. What a journal has from an earlier run is restored first. For tests that end it at any moment.
///
/// # Errors
/// A file that cannot be read, no folder for journals, a journal of other events.
pub fn rehearse(arguments: &RehearseArguments) -> anyhow::Result<Outcome> {
    let recipe = recipe::read(&arguments.recipe)?.recipe;
    let scan = normend_io::read(&arguments.input, &Silent)?;
    let folder = normend_app::folders::state_folder().context("the system names no folder for journals")?;
    let folder = folder.join("journals");
    let places = ScannerPlaces::read(&scan, ScannerFiles::default(), &Silent)?;
    let mut session = Session::new(scan, title_of(&arguments.input));
    session.scanner.places = places;
    session.begin_with(recipe.head.parameters);
    let offer = found::find(&folder, &session.identity(), Duration::ZERO)
        .offers
        .into_iter()
        .next();
    session.keep_journal(&folder);
    let mut n_done = 0;
    if let Some(offer) = offer {
        let events = &offer.reading.recipe.events;
        n_done = events.len();
        if recipe.events.get(..n_done) != Some(events) {
            return Err(anyhow!("the journal is of other events"));
        }
        session.restore(offer)?;
    }
    let propagation = propagation(&session, session.document.parameters(), &Silent)?;
    session.install(propagation);
    let mut out = io::stdout().lock();
    writeln!(out, "{n_done}").and_then(|()| out.flush())?;
    for event in &recipe.events[n_done..] {
        match event {
            Event::Step(step) => drop(session.repeat(step)?),
            Event::Undo => drop(session.undo()),
            Event::Redo => drop(session.redo()),
            Event::Exported => {}
        }
        n_done += 1;
        writeln!(out, "{n_done}").and_then(|()| out.flush())?;
    }
    Ok(Outcome::Done)
}
