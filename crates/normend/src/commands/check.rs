//! `normend check`: wrong normals of a result against a reference.

use std::io::{self, Write};
use std::path::Path;
use std::sync::Arc;

use anyhow::{Context, bail};
use glam::Vec3;
use normend_core::Progress;
use normend_core::metrics::{Comparison, compare};
use normend_core::progress::Part;
use normend_io::Scan;
use serde::Serialize;

use super::{Outcome, prepare, title_of};
use crate::arguments::CheckArguments;
use crate::console::{Bar, counted, thousands};

/// Positions that differ by more than this share of the diagonal are not the same points.
const MAX_SHIFT: f64 = 1e-4;

/// What `--json` prints.
#[derive(Debug, Serialize)]
struct Report<'a> {
    result: &'a Path,
    reference: &'a Path,
    points: usize,
    judged: usize,
    wrong: usize,
    wrong_global_flip: usize,
    wrong_component_flip: usize,
    components: usize,
    undefined: usize,
    /// Null when no judged point has a normal.
    mean_unsigned_angle_degrees: Option<f64>,
}

/// Compares both files and prints the counts.
///
/// # Errors
/// Files that cannot be read, are not of the same points, or have no normals; Ctrl-C.
pub fn run(arguments: &CheckArguments) -> anyhow::Result<Outcome> {
    prepare(&arguments.common)?;
    let bar = Bar::new(&title_of(&arguments.result), arguments.common.quiet);
    let reference = super::read(
        &arguments.reference,
        &arguments.reading,
        &bar,
        &Part::new(&bar, 0.0..0.2),
    )?;
    let reference_normals = normals_of(&reference, &arguments.reference)?;
    let result = super::read(&arguments.result, &arguments.reading, &bar, &Part::new(&bar, 0.2..0.4))?;
    let result_normals = normals_of(&result, &arguments.result)?;
    check_same_points(&reference, &arguments.reference, &result, &arguments.result)?;
    bar.stage("Comparing normals");
    let comparison = compare(
        &reference.cloud,
        &reference_normals,
        &result_normals,
        &Part::new(&bar, 0.4..1.0),
    )?;
    drop(bar);
    let text = if arguments.json {
        in_json(&comparison, result_normals.len(), arguments)?
    } else {
        in_words(&comparison, result_normals.len())
    };
    let mut out = io::stdout().lock();
    out.write_all(text.as_bytes())
        .and_then(|()| out.flush())
        .context("cannot write to standard output")?;
    Ok(Outcome::Done)
}

/// The normals of a file.
///
/// # Errors
/// A file without.
pub(super) fn normals_of(scan: &Scan, path: &Path) -> anyhow::Result<Arc<Vec<Vec3>>> {
    scan.given_normals.clone().with_context(|| {
        format!(
            "{} has no normals (no nx ny nz): orient it first, or name another file",
            path.display()
        )
    })
}

/// Refuses files of other points, or of the same points in another order: counts would mean nothing.
///
/// # Errors
/// In words, with the names of both files.
pub(super) fn check_same_points(
    reference: &Scan,
    reference_path: &Path,
    result: &Scan,
    result_path: &Path,
) -> anyhow::Result<()> {
    let (truth, cloud) = (&reference.cloud, &result.cloud);
    if truth.n_points() != cloud.n_points() {
        bail!(
            "{} has {} and {} has {}: both must hold the same points in the same order",
            result_path.display(),
            counted(cloud.n_points(), "point"),
            reference_path.display(),
            counted(truth.n_points(), "point")
        );
    }
    let origin_shift = cloud.origin() - truth.origin();
    let max_shift = MAX_SHIFT * f64::from(truth.diagonal());
    let pairs = truth.positions().iter().zip(cloud.positions());
    for (point, (a, b)) in pairs.enumerate() {
        let shift = (b.as_dvec3() - a.as_dvec3() + origin_shift).length();
        // Not `shift > max_shift`: a shift that is not a number must not pass.
        if shift.is_nan() || shift > max_shift {
            bail!(
                "point {point} of {} is {shift:.3e} away from point {point} of {}: both must hold the same points in the same order",
                result_path.display(),
                reference_path.display()
            );
        }
    }
    Ok(())
}

/// The counts as one line of JSON.
fn in_json(comparison: &Comparison, n_points: usize, arguments: &CheckArguments) -> anyhow::Result<String> {
    let angle = comparison.mean_unsigned_angle;
    let report = Report {
        result: &arguments.result,
        reference: &arguments.reference,
        points: n_points,
        judged: comparison.n_judged,
        wrong: comparison.n_wrong,
        wrong_global_flip: comparison.n_wrong_global_flip,
        wrong_component_flip: comparison.n_wrong_component_flip,
        components: comparison.n_components,
        undefined: comparison.n_undefined,
        mean_unsigned_angle_degrees: (!angle.is_nan()).then(|| angle.to_degrees()),
    };
    let mut line = serde_json::to_string(&report).context("cannot put the report into JSON")?;
    line.push('\n');
    Ok(line)
}

/// The counts as aligned rows.
fn in_words(comparison: &Comparison, n_points: usize) -> String {
    let n_judged = comparison.n_judged;
    let row = |label: &str, count: usize| format!("{label:<34}{:>12}", thousands(count as u64));
    let wrong_row = |label: &str, n_wrong: usize| {
        let share = if n_judged == 0 {
            0.0
        } else {
            n_wrong as f64 / n_judged as f64
        };
        format!("{}  {:.3} %", row(label, n_wrong), 100.0 * share)
    };
    let mut rows = vec![
        row("points", n_points),
        row("judged", n_judged),
        wrong_row("wrong", comparison.n_wrong),
        wrong_row("wrong after the best global flip", comparison.n_wrong_global_flip),
        wrong_row("wrong after component flips", comparison.n_wrong_component_flip),
        row("components", comparison.n_components),
        row("without a normal", comparison.n_undefined),
    ];
    if !comparison.mean_unsigned_angle.is_nan() {
        let degrees = comparison.mean_unsigned_angle.to_degrees();
        rows.push(format!("{:<34}{degrees:>12.2}  degrees, sides aside", "mean angle"));
    }
    rows.join("\n") + "\n"
}
