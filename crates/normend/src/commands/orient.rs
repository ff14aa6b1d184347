//! `normend orient`: scans in, the same scans with oriented normals out.

use std::path::{Path, PathBuf};
use std::time::Instant;

use normend_core::confidence::{confidence, n_undecided};
use normend_core::evidence::Known;
use normend_core::progress::Part;
use normend_core::{Document, EditError, Method, Parameters, Progress, Propagation, SideRule, SourceRule, Start};
use normend_io::recipe::NamedParameters;
use normend_io::{Layer, LayerTarget, Loss, Scan, WriteOptions};
use serde::{Serialize, Serializer};

use super::batch::{Job, Plan, Typed};
use super::convert::say_losses;
use super::{Outcome, check_may_write, prepare, say_other_names, scanner, wrong_use};
use crate::arguments::OrientArguments;
use crate::console::{self, Bar, counted};
use crate::memory::peak_rss_bytes;

/// What is reported of an input that was oriented.
#[derive(Clone, Debug, Serialize)]
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
    /// What the output's format cannot hold, in words.
    lost: Vec<String>,
    /// Where all was scanned from, if that was found.
    found_station: Option<[f64; 3]>,
    /// The places of the scanner that were known, in words.
    scanner: Option<String>,
    #[serde(serialize_with = "serialize_parameters")]
    parameters: Parameters,
    seconds: Seconds,
    peak_rss_bytes: Option<u64>,
}

/// Wall seconds by stage, in the order of work.
#[derive(Clone, Debug, Default)]
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
    check(&arguments)?;
    let typed = Typed {
        inputs: &arguments.inputs,
        output: &arguments.output,
        extension: None,
        overwrite: arguments.overwrite,
        json: arguments.json.as_deref(),
    };
    let plan = Plan::new(typed)?;
    prepare(&arguments.common)?;
    let parameters = parameters(&arguments);
    if let Some(flag) = arguments.propagation.turns_to_tree()
        && !arguments.common.quiet
    {
        console::say(&format!("the preset is tree, as {flag} is not for auto"));
    }
    let work = |jobs: &[Job], bar: &Bar| {
        let oriented = orient(jobs, parameters, &arguments, bar)?;
        oriented.iter().for_each(|oriented| bar.say(&sentence(oriented)));
        Ok(oriented)
    };
    let groups = if arguments.together {
        vec![&plan.jobs[..]]
    } else {
        plan.jobs.chunks(1).collect()
    };
    plan.run_groups(typed, &groups, arguments.common.quiet, work)
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

/// Refuses flags that do not go together.
///
/// # Errors
/// Wrong use, in words.
fn check(arguments: &OrientArguments) -> anyhow::Result<()> {
    scanner::check(&arguments.scanner, arguments.propagation.rule)?;
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
    if arguments.scanner.sensors.is_some() && arguments.inputs.len() > 1 && !arguments.together {
        return Err(wrong_use(
            "the table of --sensors belongs to one scan: orient the scans one by one, or --together",
        ));
    }
    // One drive is often cut into several files, so a trajectory may be that of all inputs.
    Ok(())
}

/// Reads, orients and writes one file, or several as one cloud.
fn orient(
    jobs: &[Job],
    parameters: Parameters,
    arguments: &OrientArguments,
    bar: &Bar,
) -> anyhow::Result<Vec<Oriented>> {
    for job in jobs {
        check_may_write(&job.output, arguments.overwrite)?;
    }
    let started = Instant::now();
    let mut seconds = Seconds::default();

    let mut scans = Vec::with_capacity(jobs.len());
    for (index, job) in jobs.iter().enumerate() {
        let share = |index: usize| 0.1 * index as f32 / jobs.len() as f32;
        let part = Part::new(bar, share(index)..share(index + 1));
        scans.push(super::read(&job.input, &arguments.reading, bar, &part)?);
    }
    let scan = Scan::together(scans, &Part::new(bar, 0.1..0.1))?;
    seconds.0.push(("read", started.elapsed().as_secs_f64()));
    let mut losses = Vec::with_capacity(jobs.len());
    for (layer, job) in scan.layers().iter().zip(jobs) {
        losses.push(say_losses(layer.losses(&job.output)?, job, arguments.strict, bar)?);
    }
    let name = jobs
        .iter()
        .map(|job| job.input.display().to_string())
        .collect::<Vec<_>>()
        .join(", ");
    if parameters.start == Start::Keep && scan.given_normals.is_none() {
        bar.say(&format!("{name} has no normals to keep: they are estimated"));
    }

    if parameters.rule == SideRule::Given && scan.given_normals.is_none() {
        bar.say(&format!(
            "{name} has no normals to follow: the side that is seen from outside counts"
        ));
    }

    let rule = arguments.propagation.rule;
    let part = Part::new(bar, 0.1..0.12);
    let places = scanner::places(&arguments.scanner, rule, &scan, Path::new(&name), bar, &part)?;
    let known = Known {
        given: scan.given_normals.as_ref().map(|normals| normals.as_slice()),
        stations: &places.stations,
        track: places.track.as_deref(),
        ..Known::default()
    };
    let propagation = Propagation::new(&scan.cloud, known, parameters, &Part::new(bar, 0.12..0.9))?;
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
    let target = |job: &Job| LayerTarget {
        path: job.output.clone(),
        options: WriteOptions {
            rule: rule.to_owned(),
            overwrite_input: arguments.overwrite,
            ..WriteOptions::default()
        },
    };
    let targets: Vec<LayerTarget> = jobs.iter().map(target).collect();
    let writing = Part::new(bar, 0.9..1.0);
    writing.report(0.0)?;
    jobs.iter().for_each(|job| say_other_names(&job.output, bar));
    let written = sureness.as_deref().filter(|_| arguments.confidence);
    scan.write_layers(&normals, written, &targets, &writing)?;
    seconds.0.push(("write", write_started.elapsed().as_secs_f64()));
    seconds.0.push(("total", started.elapsed().as_secs_f64()));

    let oriented = |((job, layer), losses): ((&Job, &Layer), &Vec<Loss>)| Oriented {
        input: job.input.clone(),
        output: job.output.clone(),
        points: layer.n_points(),
        left_out: layer.n_left_out,
        components,
        sources,
        voted_sources,
        without_evidence,
        undecided: (sureness.as_deref())
            .map(|sureness| n_undecided(&sureness[layer.points.start as usize..layer.points.end as usize])),
        rule,
        lost: losses.iter().map(Loss::to_string).collect(),
        found_station,
        scanner: places.words(),
        parameters,
        seconds: seconds.clone(),
        peak_rss_bytes: peak_rss_bytes(),
    };
    Ok(jobs.iter().zip(scan.layers()).zip(&losses).map(oriented).collect())
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
