//! `normend convert`: scans in, the same points in another format out.

use std::path::PathBuf;

use normend_core::progress::Part;
use normend_io::{Loss, Scan, WriteOptions};
use serde::Serialize;

use super::batch::{Job, Plan, Typed};
use super::{Outcome, check_may_write, prepare, say_other_names};
use crate::arguments::convert::ConvertArguments;
use crate::console::{Bar, counted};

/// What is reported of an input that was converted.
#[derive(Debug, Serialize)]
struct Converted {
    input: PathBuf,
    output: PathBuf,
    points: usize,
    left_out: usize,
    has_normals: bool,
    lost: Vec<String>,
}

/// Converts every input; one that fails does not stop the rest.
///
/// # Errors
/// Wrong use, a report that cannot be written, Ctrl-C. What is wrong with one input is said and reported instead.
pub fn run(arguments: &ConvertArguments) -> anyhow::Result<Outcome> {
    let typed = Typed {
        inputs: &arguments.inputs,
        output: &arguments.output,
        extension: arguments.to.as_deref(),
        overwrite: arguments.overwrite,
        json: arguments.json.as_deref(),
    };
    let plan = Plan::new(typed)?;
    prepare(&arguments.common)?;
    plan.run(typed, arguments.common.quiet, |job, bar| convert(job, arguments, bar))
}

fn convert(job: &Job, arguments: &ConvertArguments, bar: &Bar) -> anyhow::Result<Converted> {
    check_may_write(&job.output, arguments.overwrite)?;
    let scan = super::read(&job.input, &arguments.reading, bar, &Part::new(bar, 0.0..0.5))?;
    let losses = refuse_or_say_losses(&scan, job, arguments.strict, bar)?;
    say_other_names(&job.output, bar);
    let options = WriteOptions {
        overwrite_input: arguments.overwrite,
        ..WriteOptions::default()
    };
    scan.convert(&job.output, &options, &Part::new(bar, 0.5..1.0))?;
    let points = scan.cloud.n_points();
    bar.say(&format!(
        "{}: {}{} → {}",
        job.input.display(),
        counted(points, "point"),
        if scan.given_normals.is_some() {
            " with normals"
        } else {
            ""
        },
        job.output.display()
    ));
    Ok(Converted {
        input: job.input.clone(),
        output: job.output.clone(),
        points,
        left_out: scan.n_left_out,
        has_normals: scan.given_normals.is_some(),
        lost: losses.iter().map(Loss::to_string).collect(),
    })
}

/// Says what the output's format cannot hold, before the work; refuses it when that is asked for.
///
/// # Errors
/// A format that is not written; with `strict` anything that would be lost.
pub(super) fn refuse_or_say_losses(scan: &Scan, job: &Job, strict: bool, bar: &Bar) -> anyhow::Result<Vec<Loss>> {
    say_losses(scan.losses(&job.output)?, job, strict, bar)
}

/// As [`refuse_or_say_losses`], of what is known already.
///
/// # Errors
/// With `strict` anything that would be lost.
pub(super) fn say_losses(losses: Vec<Loss>, job: &Job, strict: bool, bar: &Bar) -> anyhow::Result<Vec<Loss>> {
    if losses.is_empty() {
        return Ok(losses);
    }
    let list: Vec<String> = losses.iter().map(|loss| format!("  {loss}")).collect();
    let sentence = format!(
        "{} cannot hold all of {}:\n{}",
        job.output.display(),
        job.input.display(),
        list.join("\n")
    );
    if strict {
        anyhow::bail!("{sentence}\nwrite another format, or leave out --strict");
    }
    bar.say(&sentence);
    Ok(losses)
}
