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
use normend_io::recipe::{self, End, Event, Recipe, ScanIdentity};
use normend_io::{Layer, LayerTarget, ReadOptions, Scan, ScannerFiles, ScannerPlaces, WriteOptions, is_same_file};
use serde::Serialize;

use super::batch::{Job, Plan, Typed, open_report, title_of_all};
use super::orient::serialize_parameters;
use super::{Outcome, check_may_write, prepare, say_other_names, scanner, wrong_use};
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
#[derive(Clone, Debug, Serialize)]
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
#[derive(Clone, Copy, Debug, Serialize)]
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
    let plan = plan(arguments)?;
    prepare(&arguments.common)?;
    let json = arguments.json.as_deref();
    let mut report = json.map(|path| open_report(path, arguments.overwrite)).transpose()?;
    plan.make_folder()?;
    let jobs = &plan.jobs[..];
    let bar = Bar::new(&title_of_all(jobs), arguments.common.quiet);
    let (outcome, lines) = match replay(arguments, jobs, &bar) {
        Ok(replayed) => {
            for replayed in &replayed {
                bar.say(&format!(
                    "{}: {} of {} on {}, {:.1} s → {}",
                    replayed.input.display(),
                    counted(replayed.edits, "edit"),
                    arguments.recipe.display(),
                    counted(replayed.points, "point"),
                    replayed.seconds.total,
                    replayed.output.display()
                ));
            }
            let lines = replayed.into_iter().map(|replayed| Report::Done(Box::new(replayed)));
            (Outcome::Done, lines.collect::<Vec<Report<'_>>>())
        }
        Err(error) if console::is_stopped() => return Err(error),
        Err(error) => {
            let error = console::in_words(&error);
            bar.say_error(&format!("error: {error}"));
            let lines = jobs.iter().map(|job| Report::Failed {
                recipe: &arguments.recipe,
                input: &job.input,
                error: error.clone(),
            });
            (Outcome::Failed, lines.collect())
        }
    };
    if let Some(report) = &mut report {
        for line in &lines {
            let mut line = serde_json::to_vec(line).context("cannot put the report into JSON")?;
            line.push(b'\n');
            report.write_all(&line).context("cannot write the report")?;
        }
        report.flush().context("cannot write the report")?;
    }
    Ok(outcome)
}

/// Where each file goes, with everything refused before the work that would lose a file.
fn plan(arguments: &ReplayArguments) -> anyhow::Result<Plan> {
    scanner::check(&arguments.scanner, arguments.propagation.rule)?;
    let recipe = &arguments.recipe;
    let json = arguments.json.as_deref();
    let plan = Plan::new(Typed {
        inputs: &arguments.inputs,
        output: &arguments.output,
        extension: None,
        overwrite: arguments.overwrite,
        json,
    })?;
    let is_recipe = |job: &Job| is_same_file(recipe, &job.output) || *recipe == job.output;
    if plan.jobs.iter().any(is_recipe) {
        return Err(wrong_use("the output would take the place of the recipe: name another"));
    }
    let is_taken =
        |report: &Path| is_same_file(report, recipe) || plan.jobs.iter().any(|job| is_same_file(report, &job.output));
    if json.is_some_and(is_taken) {
        return Err(wrong_use(
            "the report of --json would take the place of another file: give it another name",
        ));
    }
    Ok(plan)
}

/// Reads the files of a scan as its recipe has read them.
fn read_scan(inputs: &[PathBuf], of: &ScanIdentity, progress: &dyn Progress) -> anyhow::Result<Scan> {
    let mut scans = Vec::with_capacity(inputs.len());
    for (index, input) in inputs.iter().enumerate() {
        let share = |index: usize| index as f32 / inputs.len() as f32;
        let part = Part::new(progress, share(index)..share(index + 1));
        let file = of.files.get(index).unwrap_or(of);
        let reading = ReadOptions {
            columns: file.columns.clone(),
        };
        scans.push(normend_io::read_with(input, &reading, &part)?);
    }
    Ok(Scan::together(scans, progress)?)
}

/// Reads, decides and orients as the recipe says, and writes.
fn replay(arguments: &ReplayArguments, jobs: &[Job], bar: &Bar) -> anyhow::Result<Vec<Replayed>> {
    for job in jobs {
        check_may_write(&job.output, arguments.overwrite)?;
    }
    let started = Instant::now();
    let recipe = read_recipe(&arguments.recipe, bar)?;
    let scan = read_scan(&arguments.inputs, &recipe.head.scan, &Part::new(bar, 0.0..0.1))?;
    let read = started.elapsed().as_secs_f64();
    let same_content = check_scan(&recipe, &scan, arguments)?;

    let orient_started = Instant::now();
    let input = PathBuf::from(inputs_in_words(&arguments.inputs));
    let places = scanner::places(&arguments.scanner, None, &scan, &input, bar, &Part::new(bar, 0.1..0.12))?;
    let name = scan.name();
    let mut session = Session::new(scan, name);
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
    let target = |job: &Job| LayerTarget {
        path: job.output.clone(),
        options: WriteOptions {
            rule: rule.clone(),
            overwrite_input: arguments.overwrite,
            ..WriteOptions::default()
        },
    };
    let targets: Vec<LayerTarget> = jobs.iter().map(target).collect();
    let writing = Part::new(bar, 0.9..1.0);
    writing.report(0.0)?;
    jobs.iter().for_each(|job| say_other_names(&job.output, bar));
    session
        .scan
        .write_layers(&normals, sureness.as_deref(), &targets, &writing)?;

    let document = &session.document;
    let seconds = Seconds {
        read,
        orient,
        write: write_started.elapsed().as_secs_f64(),
        total: started.elapsed().as_secs_f64(),
    };
    let replayed = |(job, layer): (&Job, &Layer)| Replayed {
        recipe: arguments.recipe.clone(),
        input: job.input.clone(),
        output: job.output.clone(),
        points: layer.n_points(),
        left_out: layer.n_left_out,
        edits: recipe.history().1,
        sources: document.sources().len(),
        marks: document.marks().len(),
        pinned: document.marks().n_pinned(),
        same_content,
        rule: rule.clone(),
        parameters,
        seconds,
        peak_rss_bytes: peak_rss_bytes(),
    };
    Ok(jobs.iter().zip(session.scan.layers()).map(replayed).collect())
}

/// The files of a scan, for messages.
fn inputs_in_words(inputs: &[PathBuf]) -> String {
    let names: Vec<String> = inputs.iter().map(|input| input.display().to_string()).collect();
    names.join(", ")
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
    let (of, here) = (&recipe.head.scan, scan.identity(&scan.name()));
    let input = inputs_in_words(&arguments.inputs);
    if of.is_same_content(&here) {
        return Ok(true);
    }
    if of.n_points != here.n_points {
        return Err(anyhow!(
            "{} is of {} with {} points, and {input} has {}: give the scan that it was made for",
            arguments.recipe.display(),
            of.name,
            of.n_points,
            here.n_points
        ));
    }
    if !arguments.same_points {
        return Err(anyhow!(
            "{input} is not the content that {} was made for ({}): give that, or say --same-points if it holds the same points in the same order",
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
    let scan = read_scan(&arguments.inputs, &recipe.head.scan, &Silent)?;
    let folder = normend_app::folders::state_folder().context("the system names no folder for journals")?;
    let folder = folder.join("journals");
    let places = ScannerPlaces::read(&scan, ScannerFiles::default(), &Silent)?;
    let name = scan.name();
    let mut session = Session::new(scan, name);
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
