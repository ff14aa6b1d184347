//! `normend orient`: scans in, the same scans with oriented normals out.

use std::collections::BTreeSet;
use std::fs::{self, File};
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::time::Instant;

use anyhow::Context;
use normend_core::confidence::{confidence, n_undecided};
use normend_core::evidence::Known;
use normend_core::progress::Part;
use normend_core::{Document, EditError, Method, Parameters, Progress, Propagation, SideRule, SourceRule, Start};
use normend_io::WriteOptions;
use normend_io::recipe::NamedParameters;
use serde::{Serialize, Serializer};

use super::{
    Outcome, check_is_file_name, check_may_write, check_scan_name, is_same_file, prepare, title_of, wrong_use,
};
use crate::arguments::OrientArguments;
use crate::console::{self, Bar, counted};
use crate::memory::peak_rss_bytes;

/// What was typed, understood and found possible.
#[derive(Debug, PartialEq, Eq)]
struct Plan {
    /// The folder that the outputs go to, unless one file was named.
    folder: Option<PathBuf>,
    jobs: Vec<Job>,
}

/// One file to orient.
#[derive(Debug, PartialEq, Eq)]
struct Job {
    input: PathBuf,
    output: PathBuf,
}

/// What is reported of one input.
#[derive(Debug, Serialize)]
#[serde(untagged)]
enum Report<'a> {
    Done(Box<Oriented>),
    Failed { input: &'a Path, error: String },
}

/// What is reported of an input that was oriented.
#[derive(Debug, Serialize)]
struct Oriented {
    input: PathBuf,
    output: PathBuf,
    points: usize,
    left_out: usize,
    components: usize,
    sources: usize,
    voted_sources: usize,
    without_evidence: usize,
    /// Null where the method does not know.
    undecided: Option<usize>,
    /// What decided the sides, in words.
    rule: &'static str,
    /// Where all was scanned from, if that was found.
    found_station: Option<[f64; 3]>,
    #[serde(serialize_with = "serialize_parameters")]
    parameters: Parameters,
    seconds: Seconds,
    peak_rss_bytes: Option<u64>,
}

/// Wall seconds by stage, in the order of work.
#[derive(Debug, Default)]
struct Seconds(Vec<(&'static str, f64)>);

impl Serialize for Seconds {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_map(self.0.iter().copied())
    }
}

/// Parameters in a report, under the names of their flags.
pub(super) fn serialize_parameters<S: Serializer>(parameters: &Parameters, serializer: S) -> Result<S::Ok, S::Error> {
    NamedParameters::from(*parameters).serialize(serializer)
}

/// Orients every input; one that fails does not stop the rest.
///
/// # Errors
/// Wrong use, a report that cannot be written, Ctrl-C. What is wrong with one input is said and reported instead.
pub fn run(arguments: OrientArguments) -> anyhow::Result<Outcome> {
    let Plan { folder, jobs } = plan(&arguments)?;
    prepare(&arguments.common)?;
    let mut report = match &arguments.json {
        Some(path) => Some(open_report(path, arguments.overwrite)?),
        None => None,
    };
    if let Some(folder) = &folder {
        fs::create_dir_all(folder).with_context(|| format!("cannot make the folder {}", folder.display()))?;
    }
    let parameters = parameters(&arguments);
    let mut outcome = Outcome::Done;
    for job in &jobs {
        let bar = Bar::new(&title_of(&job.input), arguments.common.quiet);
        let line = match orient(job, parameters, &arguments, &bar) {
            Ok(oriented) => {
                bar.say(&sentence(&oriented));
                Report::Done(Box::new(oriented))
            }
            Err(error) if console::is_stopped() => return Err(error),
            Err(error) => {
                outcome = Outcome::Failed;
                let error = console::in_words(&error);
                bar.say_error(&format!("error: {error}"));
                Report::Failed {
                    input: &job.input,
                    error,
                }
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
    }
    Ok(outcome)
}

/// The parameters that were typed; who says where the scanner stood wants its side.
fn parameters(arguments: &OrientArguments) -> Parameters {
    let typed = Parameters::from(arguments.propagation);
    let rule = match arguments.propagation.rule {
        None if arguments.scanner.is_given() => SideRule::TowardScanner,
        _ => typed.rule,
    };
    Parameters { rule, ..typed }
}

/// Where each input goes, with everything refused that would lose a file.
///
/// # Errors
/// Wrong use, in words.
fn plan(arguments: &OrientArguments) -> anyhow::Result<Plan> {
    let output = &arguments.output;
    check_is_file_name(output)?;
    if arguments.propagation.rule == Some(SideRule::TowardScanner) && !arguments.scanner.is_given() {
        return Err(wrong_use(
            "the rule toward-scanner needs the scanner's place: give --scanner X,Y,Z or --sensors TSV",
        ));
    }
    let Parameters {
        method,
        start,
        sources,
        rule,
        ..
    } = arguments.propagation.into();
    let by_votes = method == Method::SpanningTree && sources != SourceRule::Highest;
    if by_votes && !matches!(rule, SideRule::Automatic | SideRule::Outward) {
        return Err(wrong_use(
            "voted sources show what is seen from outside: another --rule needs the preset auto or tree",
        ));
    }
    if arguments.confidence && (method != Method::Agglomeration || start == Start::Keep) {
        return Err(wrong_use(
            "--confidence is known for the automatic method only: leave out the flags of other methods and --start keep",
        ));
    }
    if arguments.scanner.sensors.is_some() && arguments.inputs.len() > 1 {
        return Err(wrong_use(
            "the table of --sensors belongs to one scan: orient the scans one by one",
        ));
    }
    let is_folder = arguments.inputs.len() > 1 || output.is_dir() || ends_with_separator(output);
    if is_folder && output.exists() && !output.is_dir() {
        return Err(wrong_use(format!(
            "{} is a file, but several inputs need a folder: give -o the name of a folder",
            output.display()
        )));
    }
    // A folder may have any name, but a new one that ends like a file is most likely a slip.
    if is_folder && !output.is_dir() && !ends_with_separator(output) && output.extension().is_some() {
        return Err(wrong_use(format!(
            "{0} is the name of a file, but several inputs need a folder: give -o the name of a folder, or {0}{1} if \
             this is one",
            output.display(),
            std::path::MAIN_SEPARATOR
        )));
    }
    let mut outputs = BTreeSet::new();
    let mut jobs = Vec::with_capacity(arguments.inputs.len());
    for input in &arguments.inputs {
        let output = if is_folder {
            let name = input
                .file_name()
                .ok_or_else(|| wrong_use(format!("{} is not a file", input.display())))?;
            output.join(name)
        } else {
            check_scan_name(output, Some(input))?;
            output.clone()
        };
        if !outputs.insert(output.clone()) {
            return Err(wrong_use(format!(
                "two inputs would both be written to {}: rename one, or orient them one by one",
                output.display()
            )));
        }
        jobs.push(Job {
            input: input.clone(),
            output,
        });
    }
    for job in &jobs {
        let is_input = |path: &Path| jobs.iter().any(|other| is_same_file(&other.input, path));
        if !arguments.overwrite && is_input(&job.output) {
            return Err(wrong_use(format!(
                "{} is an input: name another output, or allow it with --overwrite",
                job.output.display()
            )));
        }
        if arguments
            .json
            .as_deref()
            .is_some_and(|report| is_input(report) || report == job.output)
        {
            return Err(wrong_use(
                "the report of --json would take the place of a scan: give it another name",
            ));
        }
    }
    Ok(Plan {
        folder: is_folder.then(|| output.clone()),
        jobs,
    })
}

fn ends_with_separator(path: &Path) -> bool {
    path.as_os_str()
        .as_encoded_bytes()
        .last()
        .is_some_and(|&last| std::path::is_separator(char::from(last)))
}

/// Standard output for `-`, else a new file; opened before the work, so that a wrong path costs no time.
pub(super) fn open_report(path: &Path, overwrite: bool) -> anyhow::Result<Box<dyn Write>> {
    if path == Path::new("-") {
        return Ok(Box::new(io::stdout()));
    }
    check_may_write(path, overwrite)?;
    let file = File::create(path).with_context(|| format!("cannot write the report {}", path.display()))?;
    Ok(Box::new(file))
}

/// Reads, orients and writes one scan.
fn orient(job: &Job, parameters: Parameters, arguments: &OrientArguments, bar: &Bar) -> anyhow::Result<Oriented> {
    check_may_write(&job.output, arguments.overwrite)?;
    let started = Instant::now();
    let mut seconds = Seconds::default();

    let scan = normend_io::read(&job.input, &Part::new(bar, 0.0..0.1))?;
    seconds.0.push(("read", started.elapsed().as_secs_f64()));
    let points = scan.cloud.n_points();
    if parameters.start == Start::Keep && scan.given_normals.is_none() {
        bar.say(&format!(
            "{} has no normals to keep: they are estimated",
            job.input.display()
        ));
    }

    if parameters.rule == SideRule::Given && scan.given_normals.is_none() {
        bar.say(&format!(
            "{} has no normals to follow: the side that is seen from outside counts",
            job.input.display()
        ));
    }

    let known = Known {
        given: scan.given_normals.as_ref().map(|normals| normals.as_slice()),
        stations: &arguments.scanner.stations(&scan)?,
        ..Known::default()
    };
    let propagation = Propagation::new(&scan.cloud, known, parameters, &Part::new(bar, 0.1..0.9))?;
    seconds
        .0
        .extend(propagation.seconds.iter().map(|&(stage, secs)| (stage.name(), secs)));
    let components = propagation.tree.roots().len();
    let sources = propagation.base_regions.n_regions();
    let voted_sources = propagation.voted_sources.len();
    let without_evidence = propagation.sides.iter().filter(|side| side.rule.is_none()).count();

    let signs_started = Instant::now();
    let sureness = confidence(&propagation);
    let rule = propagation.rule();
    let found_station = propagation.found_station.map(|found| found.position.to_array());
    let mut document = Document::new(scan.cloud.clone(), scan.given_normals.clone());
    document.install(propagation);
    let normals = document.oriented_normals().ok_or(EditError::NotReady)?;
    drop(document);
    seconds.0.push(("signs", signs_started.elapsed().as_secs_f64()));

    let write_started = Instant::now();
    let options = WriteOptions {
        rule: rule.to_owned(),
        overwrite_input: arguments.overwrite,
    };
    let writing = Part::new(bar, 0.9..1.0);
    writing.report(0.0)?;
    let written = sureness.as_deref().filter(|_| arguments.confidence);
    scan.write_with_confidence(&normals, written, &job.output, &options, &writing)?;
    seconds.0.push(("write", write_started.elapsed().as_secs_f64()));
    seconds.0.push(("total", started.elapsed().as_secs_f64()));

    Ok(Oriented {
        input: job.input.clone(),
        output: job.output.clone(),
        points,
        left_out: scan.n_left_out,
        components,
        sources,
        voted_sources,
        without_evidence,
        undecided: sureness.as_deref().map(n_undecided),
        rule,
        found_station,
        parameters,
        seconds,
        peak_rss_bytes: peak_rss_bytes(),
    })
}

/// One line for a person: what came out, and where it is.
fn sentence(oriented: &Oriented) -> String {
    let total = oriented.seconds.0.last().map_or(0.0, |&(_, secs)| secs);
    let left_out = match oriented.left_out {
        0 => String::new(),
        n => format!(" ({} without finite coordinates left out)", counted(n, "row")),
    };
    let without_evidence = match oriented.without_evidence {
        0 => String::new(),
        n => format!(" ({n} without evidence of its side)"),
    };
    format!(
        "{}: {}{left_out}, {}{without_evidence}, {total:.1} s → {}",
        oriented.input.display(),
        counted(oriented.points, "point"),
        counted(oriented.components, "component"),
        oriented.output.display()
    )
}
