//! `normend bench quality`: how many normals of clouds with a known truth come out wrong, class by class.

use std::fmt::Write as _;
use std::io::{self, Write as _};
use std::path::Path;
use std::time::Instant;

use anyhow::Context;
use normend_core::metrics::{self, compare, wrong_regions};
use normend_core::{Document, EditError, Neighbors, Parameters, Progress, Propagation};
use serde::Serialize;

use super::super::batch::open_report;
use super::super::check::{check_same_points, normals_of};
use super::super::orient::serialize_parameters;
use super::super::{Outcome, prepare, title_of};
use super::folder::{Case, Found, find, for_each_case, n_threads};
use crate::arguments::bench::QualityArguments;
use crate::console::{self, Bar, counted};

/// Fewer connected wrong points than this are no patch that a user would see and mend.
pub(super) const REGION: usize = 10;

/// The class of surfaces that have an outside by convention only, so that the better flip of the whole cloud counts.
pub(super) const OPEN: &str = "open";

/// The class of scans. Those of rooms are a row by themselves: their normals face the inside, which no rule for things gets
/// right.
pub(super) const SCAN: &str = "scan";
pub(super) const ROOM: &str = "room";

/// What is measured of one cloud.
#[derive(Clone, Debug, PartialEq, Serialize)]
struct Measured {
    class: String,
    name: String,
    points: usize,
    judged: usize,
    wrong: usize,
    wrong_share: f64,
    wrong_regions: usize,
    largest_wrong_region: usize,
    /// Null when no judged point has a normal.
    mean_unsigned_angle_degrees: Option<f64>,
    seconds: f64,
}

/// Several clouds together.
#[derive(Debug, PartialEq, Serialize)]
struct Summary {
    class: String,
    clouds: usize,
    mean_wrong_share: f64,
    median_wrong_share: f64,
    worst_wrong_share: f64,
    worst: String,
    clouds_without_wrong_point: usize,
    clouds_without_wrong_region: usize,
    mean_unsigned_angle_degrees: Option<f64>,
    seconds: f64,
}

/// What `--json` writes.
#[derive(Debug, Serialize)]
struct Report<'a> {
    folder: &'a Path,
    #[serde(serialize_with = "serialize_parameters")]
    parameters: Parameters,
    without_truth: usize,
    failed: Vec<String>,
    classes: Vec<Summary>,
    all: Option<Summary>,
    clouds: Vec<Measured>,
}

/// Orients every cloud of the folder and prints a row for each class.
///
/// # Errors
/// A folder without clouds, a report that cannot be written, Ctrl-C. What is wrong with one cloud is said instead, and the
/// outcome is a failure.
pub fn run(arguments: &QualityArguments) -> anyhow::Result<Outcome> {
    let Found { cases, n_without_truth } = find(&arguments.folder, &arguments.only)?;
    prepare(&arguments.common)?;
    let json = arguments.json.as_deref();
    let mut file = json.map(|path| open_report(path, arguments.overwrite)).transpose()?;
    let parameters = Parameters::from(arguments.propagation);
    let bar = Bar::new(&title_of(&arguments.folder), arguments.common.quiet);
    bar.stage("Orienting");
    let results = for_each_case(&cases, n_threads(arguments.common.threads), &bar, |case, progress| {
        measure(case, parameters, progress)
    })?;
    let (mut clouds, mut failed) = (Vec::new(), Vec::new());
    for result in results {
        match result {
            Ok(measured) => clouds.push(measured),
            Err(error) if console::is_stopped() => return Err(error),
            Err(error) => {
                let error = console::in_words(&error);
                bar.say_error(&format!("error: {error}"));
                failed.push(error);
            }
        }
    }
    if n_without_truth > 0 {
        bar.say(&format!(
            "{} without a truth left out",
            counted(n_without_truth, "cloud")
        ));
    }
    drop(bar);
    let report = Report {
        folder: &arguments.folder,
        parameters,
        without_truth: n_without_truth,
        failed,
        classes: by_class(&clouds),
        all: summary("all", &clouds.iter().collect::<Vec<_>>()),
        clouds,
    };
    if json != Some(Path::new("-")) {
        let mut out = io::stdout().lock();
        out.write_all(table(&report, arguments.clouds).as_bytes())
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
    let outcome = if report.failed.is_empty() {
        Outcome::Done
    } else {
        Outcome::Failed
    };
    Ok(outcome)
}

/// Orients one cloud and compares it with its truth.
fn measure(case: &Case, parameters: Parameters, progress: &dyn Progress) -> anyhow::Result<Measured> {
    let truth = normend_io::read(&case.truth, progress)?;
    let right = normals_of(&truth, &case.truth)?;
    let scan = normend_io::read(&case.raw, progress)?;
    check_same_points(&truth, &case.truth, &scan, &case.raw)?;

    let started = Instant::now();
    let given = scan.given_normals.as_ref().map(|normals| normals.as_slice());
    let propagation = Propagation::new(&scan.cloud, given, parameters, progress)?;
    let mut document = Document::new(scan.cloud.clone(), scan.given_normals.clone());
    document.install(propagation);
    let mut normals = document.oriented_normals().ok_or(EditError::NotReady)?;
    let seconds = started.elapsed().as_secs_f64();

    let mut comparison = compare(&scan.cloud, &right, &normals, progress)?;
    if case.class == OPEN && comparison.n_wrong_global_flip < comparison.n_wrong {
        normals.iter_mut().for_each(|normal| *normal = -*normal);
        comparison = compare(&scan.cloud, &right, &normals, progress)?;
    }
    let neighbors = Neighbors::find(&scan.cloud, metrics::K, progress)?;
    let regions = wrong_regions(&neighbors, &comparison.wrong);
    let angle = comparison.mean_unsigned_angle;
    Ok(Measured {
        class: group_of(case),
        name: case.name.clone(),
        points: scan.cloud.n_points(),
        judged: comparison.n_judged,
        wrong: comparison.n_wrong,
        wrong_share: comparison.n_wrong as f64 / comparison.n_judged.max(1) as f64,
        wrong_regions: regions.iter().filter(|region| region.len() >= REGION).count(),
        largest_wrong_region: regions.first().map_or(0, Vec::len),
        mean_unsigned_angle_degrees: (!angle.is_nan()).then(|| angle.to_degrees()),
        seconds,
    })
}

/// The row that a cloud counts in.
fn group_of(case: &Case) -> String {
    if case.class == SCAN && case.name.starts_with(ROOM) {
        format!("{SCAN} {ROOM}s")
    } else {
        case.class.clone()
    }
}

/// A summary for each class, sorted by name.
fn by_class(clouds: &[Measured]) -> Vec<Summary> {
    let mut classes: Vec<&str> = clouds.iter().map(|cloud| cloud.class.as_str()).collect();
    classes.sort_unstable();
    classes.dedup();
    classes
        .into_iter()
        .filter_map(|class| {
            let of_class: Vec<&Measured> = clouds.iter().filter(|cloud| cloud.class == class).collect();
            summary(class, &of_class)
        })
        .collect()
}

/// Nothing for no clouds.
fn summary(class: &str, clouds: &[&Measured]) -> Option<Summary> {
    let mut by_share = clouds.to_vec();
    by_share.sort_by(|a, b| a.wrong_share.total_cmp(&b.wrong_share));
    let worst = by_share.last()?;
    // Of an even number of clouds, the mean of the two in the middle.
    let middle = (by_share.len() - 1) / 2..=by_share.len() / 2;
    let mean = |values: &mut dyn Iterator<Item = f64>| {
        let (sum, count) = values.fold((0.0, 0_usize), |(sum, count), value| (sum + value, count + 1));
        (count > 0).then(|| sum / count as f64)
    };
    Some(Summary {
        class: class.to_owned(),
        clouds: clouds.len(),
        mean_wrong_share: mean(&mut clouds.iter().map(|cloud| cloud.wrong_share))?,
        median_wrong_share: mean(&mut by_share[middle].iter().map(|cloud| cloud.wrong_share))?,
        worst_wrong_share: worst.wrong_share,
        worst: worst.name.clone(),
        clouds_without_wrong_point: clouds.iter().filter(|cloud| cloud.wrong == 0).count(),
        clouds_without_wrong_region: clouds.iter().filter(|cloud| cloud.wrong_regions == 0).count(),
        mean_unsigned_angle_degrees: mean(&mut clouds.iter().filter_map(|cloud| cloud.mean_unsigned_angle_degrees)),
        seconds: clouds.iter().map(|cloud| cloud.seconds).sum(),
    })
}

/// The rows for a person; those of single clouds above those of classes.
fn table(report: &Report<'_>, with_clouds: bool) -> String {
    let mut text = String::new();
    let degrees = |angle: Option<f64>| angle.map_or_else(|| "-".to_owned(), |angle| format!("{angle:.2}"));
    // Writing to a string does not fail.
    if with_clouds {
        let _ = writeln!(
            text,
            "{:<14} {:<28} {:>8} {:>7} {:>9} {:>8} {:>8} {:>7} {:>8}",
            "class", "cloud", "points", "wrong", "share", "regions", "largest", "angle", "seconds"
        );
        for cloud in &report.clouds {
            let _ = writeln!(
                text,
                "{:<14} {:<28} {:>8} {:>7} {:>9.5} {:>8} {:>8} {:>7} {:>8.2}",
                cloud.class,
                cloud.name,
                cloud.points,
                cloud.wrong,
                cloud.wrong_share,
                cloud.wrong_regions,
                cloud.largest_wrong_region,
                degrees(cloud.mean_unsigned_angle_degrees),
                cloud.seconds
            );
        }
        text.push('\n');
    }
    let _ = writeln!(
        text,
        "{:<14} {:>6} {:>9} {:>9} {:>9} {:>5} {:>10} {:>7} {:>8}  worst cloud",
        "class", "clouds", "mean", "median", "worst", "at 0", "no region", "angle", "seconds"
    );
    for class in report.classes.iter().chain(&report.all) {
        let _ = writeln!(
            text,
            "{:<14} {:>6} {:>9.5} {:>9.5} {:>9.5} {:>5} {:>10} {:>7} {:>8.2}  {}",
            class.class,
            class.clouds,
            class.mean_wrong_share,
            class.median_wrong_share,
            class.worst_wrong_share,
            class.clouds_without_wrong_point,
            class.clouds_without_wrong_region,
            degrees(class.mean_unsigned_angle_degrees),
            class.seconds,
            class.worst
        );
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cloud(name: &str, wrong: usize, wrong_regions: usize, angle: Option<f64>) -> Measured {
        Measured {
            class: "sharp".to_owned(),
            name: name.to_owned(),
            points: 100,
            judged: 100,
            wrong,
            wrong_share: wrong as f64 / 100.0,
            wrong_regions,
            largest_wrong_region: wrong,
            mean_unsigned_angle_degrees: angle,
            seconds: 0.5,
        }
    }

    #[test]
    fn a_class_is_summed_up() {
        let clouds = [
            cloud("a", 0, 0, Some(1.0)),
            cloud("b", 30, 1, Some(3.0)),
            cloud("c", 4, 0, None),
            cloud("d", 2, 0, Some(5.0)),
        ];
        let summary = summary("sharp", &clouds.each_ref()).unwrap();
        assert_eq!((summary.clouds, summary.worst.as_str()), (4, "b"));
        assert!((summary.mean_wrong_share - 0.09).abs() < 1e-12);
        assert!((summary.median_wrong_share - 0.03).abs() < 1e-12);
        assert_eq!(
            (summary.clouds_without_wrong_point, summary.clouds_without_wrong_region),
            (1, 3)
        );
        assert_eq!(summary.mean_unsigned_angle_degrees, Some(3.0));
        assert!((summary.seconds - 2.0).abs() < 1e-12);
    }

    #[test]
    fn rooms_are_a_row_by_themselves() {
        let check = |class: &str, name: &str, expect: &str| {
            let case = Case {
                class: class.to_owned(),
                name: name.to_owned(),
                raw: "raw".into(),
                truth: "truth".into(),
            };
            assert_eq!(group_of(&case), expect);
        };
        check("scan", "room_office", "scan rooms");
        check("scan", "mug", "scan");
        check("sharp", "room_office", "sharp");
    }

    #[test]
    fn no_clouds_have_no_summary() {
        assert_eq!(summary("all", &[]), None);
        assert!(by_class(&[]).is_empty());
    }
}
