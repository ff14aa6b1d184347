//! `normend generate`: scans whose normals are known.

use normend_core::progress::Part;
use normend_core::{Progress, shapes::Shape};
use normend_io::{Positions, write_points};

use super::{Outcome, check_may_write, check_scan_name, prepare, title_of, wrong_use};
use crate::arguments::GenerateArguments;
use crate::console::{Bar, counted};

/// Writes one shape: its positions, and with `--truth` its positions and normals.
///
/// # Errors
/// Wrong use, a file that cannot be written, Ctrl-C.
pub fn run(arguments: &GenerateArguments) -> anyhow::Result<Outcome> {
    if arguments.truth.as_ref() == Some(&arguments.output) {
        return Err(wrong_use(
            "--truth and --output name the same file: give one of them another name",
        ));
    }
    for output in [Some(&arguments.output), arguments.truth.as_ref()]
        .into_iter()
        .flatten()
    {
        check_scan_name(output, None)?;
        check_may_write(output, arguments.overwrite)?;
    }
    prepare(&arguments.common)?;
    let bar = Bar::new(&title_of(&arguments.output), arguments.common.quiet);
    bar.stage("Generating");
    bar.report(0.0)?;
    let Shape { positions, normals } = arguments
        .shape
        .generate(arguments.points)
        .with_noise(arguments.noise, arguments.seed);
    let positions = Positions::Float(&positions);
    write_points(&arguments.output, positions, None, &Part::new(&bar, 0.3..0.6))?;
    bar.say(&format!(
        "{}: {}",
        arguments.output.display(),
        counted(arguments.points, "point")
    ));
    if let Some(truth) = &arguments.truth {
        write_points(truth, positions, Some(&normals), &Part::new(&bar, 0.6..1.0))?;
        bar.say(&format!("{}: the same with their normals", truth.display()));
    }
    Ok(Outcome::Done)
}
