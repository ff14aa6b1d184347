//! `normend bench suspects`: whether confidence is what it says, and whether suspects are wrong.

use std::fmt::Write as _;
use std::io::{self, Write as _};

use anyhow::{Context, ensure};
use fixedbitset::FixedBitSet;
use glam::Vec3;
use normend_core::confidence::{confidence, of_points};
use normend_core::metrics::{self, compare, wrong_regions};
use normend_core::suspects::{Kind, Settings, suspects};
use normend_core::{Method, Neighbors, Parameters, Progress, Propagation, Start};

use super::super::check::{check_same_points, normals_of};
use super::super::{Outcome, prepare, title_of};
use super::clicks::has_convention_only;
use super::folder::{Case, Found, find, for_each_case, n_threads};
use super::quality::REGION;
use crate::arguments::bench::SuspectsArguments;
use crate::console::{self, Bar, counted, thousands};

/// The class of measured scans. Their truth is the side of a scanner whose place nobody said, so confidence, which is about the
/// side that is asked for, is not compared with it.
const REAL: &str = "real";

/// Where the bins of confidence begin, in units of 1/255: coarse where few points are, fine where most are.
const BINS: [u8; 10] = [0, 128, 153, 179, 204, 230, 242, 250, 253, 255];

/// What is measured of one cloud.
#[derive(Debug)]
struct Measured {
    class: String,
    name: String,
    has_wrong_region: bool,
    /// Of each suspect, best first: whether most of its points are wrong.
    hits: Vec<bool>,
    reliability: [Bin; BINS.len()],
}

/// Points of about the same confidence.
#[derive(Clone, Copy, Debug, Default)]
struct Bin {
    n_points: u64,
    n_right: u64,
    /// Sum of confidence, in units of 1/255.
    confidence: u64,
}

/// Orients every cloud of the folder, looks for suspects and prints both tables.
///
/// # Errors
/// A folder without clouds, Ctrl-C. What is wrong with one cloud is said instead, and the outcome is a failure.
pub fn run(arguments: &SuspectsArguments) -> anyhow::Result<Outcome> {
    let Found { cases, n_without_truth } = find(&arguments.folder, &arguments.only)?;
    prepare(&arguments.common)?;
    let parameters = Parameters::from(arguments.propagation);
    let settings = Settings {
        threshold: arguments.threshold,
        ..Settings::default()
    };
    let bar = Bar::new(&title_of(&arguments.folder), arguments.common.quiet);
    bar.stage("Looking for suspects");
    let results = for_each_case(&cases, n_threads(arguments.common.threads), &bar, |case, progress| {
        measure(case, parameters, settings, progress)
    })?;
    let mut clouds = Vec::new();
    let mut outcome = Outcome::Done;
    for result in results {
        match result {
            Ok(measured) => clouds.push(measured),
            Err(error) if console::is_stopped() => return Err(error),
            Err(error) => {
                outcome = Outcome::Failed;
                bar.say_error(&format!("error: {}", console::in_words(&error)));
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
    let mut out = io::stdout().lock();
    out.write_all(tables(&clouds, arguments.clouds).as_bytes())
        .and_then(|()| out.flush())
        .context("cannot write to standard output")?;
    Ok(outcome)
}

/// Orients one cloud and compares suspects and confidence with its truth.
fn measure(
    case: &Case,
    parameters: Parameters,
    settings: Settings,
    progress: &dyn Progress,
) -> anyhow::Result<Measured> {
    let truth = normend_io::read(&case.truth, progress)?;
    let right = normals_of(&truth, &case.truth)?;
    let scan = normend_io::read(&case.raw, progress)?;
    check_same_points(&truth, &case.truth, &scan, &case.raw)?;
    let given = scan.given_normals.as_ref().map(|normals| normals.as_slice());
    let questioned = Propagation::new(&scan.cloud, given, parameters, progress)?;
    let mut normals = questioned.initial_normals();
    let automatic = if parameters.method == Method::Agglomeration && parameters.start == Start::Estimate {
        questioned
    } else {
        drop(questioned);
        Propagation::new(&scan.cloud, None, Parameters::default(), progress)?
    };

    let by_convention = has_convention_only(case);
    let compared = |normals: &mut Vec<Vec3>| -> anyhow::Result<FixedBitSet> {
        let mut comparison = compare(&scan.cloud, &right, normals, progress)?;
        if by_convention && comparison.n_wrong_global_flip < comparison.n_wrong {
            normals.iter_mut().for_each(|normal| *normal = -*normal);
            comparison = compare(&scan.cloud, &right, normals, progress)?;
        }
        Ok(comparison.wrong)
    };
    let wrong = compared(&mut normals)?;
    let neighbors = Neighbors::find(&scan.cloud, metrics::K, progress)?;
    let regions = wrong_regions(&neighbors, &wrong);
    let found = suspects(&scan.cloud, &automatic, &normals, settings, progress)?;
    let found = found.context("the automatic method left nothing to judge by")?;
    let hits = (found.iter())
        // Where the side of the whole is a convention, it is neither right nor wrong to suspect it.
        .filter(|suspect| !(by_convention && suspect.kind == Kind::Whole))
        .map(|suspect| {
            let n_wrong = suspect
                .points
                .iter()
                .filter(|&&point| wrong.contains(point as usize))
                .count();
            2 * n_wrong > suspect.points.len()
        })
        .collect();

    let sure = if by_convention {
        of_points(&automatic)
    } else {
        confidence(&automatic)
    };
    let sure = sure.context("the automatic method gives no confidence")?;
    ensure!(sure.len() == right.len(), "confidence of another number of points");
    let wrong = compared(&mut automatic.initial_normals())?;
    let mut reliability = [Bin::default(); BINS.len()];
    for (point, &sure) in sure.iter().enumerate() {
        if right[point] == Vec3::ZERO || case.class == REAL {
            continue;
        }
        let bin = &mut reliability[BINS.partition_point(|&first| first <= sure) - 1];
        bin.n_points += 1;
        bin.n_right += u64::from(!wrong.contains(point));
        bin.confidence += u64::from(sure);
    }
    Ok(Measured {
        class: case.class.clone(),
        name: case.name.clone(),
        has_wrong_region: regions.first().is_some_and(|region| region.len() >= REGION),
        hits,
        reliability,
    })
}

/// A row of the table of suspects.
fn row_of_suspects(class: &str, clouds: &[&Measured]) -> String {
    let (wrong, clean): (Vec<&Measured>, Vec<&Measured>) = clouds.iter().partition(|cloud| cloud.has_wrong_region);
    let count = |clouds: &[&Measured], is: &dyn Fn(&Measured) -> bool| clouds.iter().filter(|cloud| is(cloud)).count();
    let of_first = |n_first: usize| {
        let hits = || wrong.iter().flat_map(|cloud| cloud.hits.iter().take(n_first));
        format!("{}/{}", hits().filter(|&&hit| hit).count(), hits().count())
    };
    format!(
        "{class:<14} {:>6} {:>7} {:>6} {:>6} {:>9} {:>9} {:>9}\n",
        clean.len(),
        count(&clean, &|cloud| !cloud.hits.is_empty()),
        wrong.len(),
        count(&wrong, &|cloud| !cloud.hits.is_empty()),
        of_first(1),
        of_first(3),
        of_first(usize::MAX),
    )
}

/// Both tables for a person.
fn tables(clouds: &[Measured], with_clouds: bool) -> String {
    let mut text = String::new();
    // Writing to a string does not fail.
    if with_clouds {
        for cloud in clouds
            .iter()
            .filter(|cloud| cloud.has_wrong_region || !cloud.hits.is_empty())
        {
            let hits: String = cloud.hits.iter().map(|&hit| if hit { '+' } else { '-' }).collect();
            let state = if cloud.has_wrong_region { "wrong" } else { "right" };
            let _ = writeln!(text, "{:<14} {:<28} {state} {hits}", cloud.class, cloud.name);
        }
        text.push('\n');
    }
    let _ = writeln!(
        text,
        "{:<14} {:>6} {:>7} {:>6} {:>6} {:>9} {:>9} {:>9}",
        "class", "right", "alarms", "wrong", "found", "first", "three", "all"
    );
    let mut classes: Vec<&str> = clouds.iter().map(|cloud| cloud.class.as_str()).collect();
    classes.sort_unstable();
    classes.dedup();
    for class in classes {
        let of_class: Vec<&Measured> = clouds.iter().filter(|cloud| cloud.class == class).collect();
        text += &row_of_suspects(class, &of_class);
    }
    text += &row_of_suspects("all", &clouds.iter().collect::<Vec<_>>());
    let _ = writeln!(
        text,
        "\n{:>10} {:>12} {:>10} {:>10}",
        "confidence", "points", "mean", "right"
    );
    for (index, &first) in BINS.iter().enumerate() {
        let mut sum = Bin::default();
        for bin in clouds.iter().map(|cloud| cloud.reliability[index]) {
            sum.n_points += bin.n_points;
            sum.n_right += bin.n_right;
            sum.confidence += bin.confidence;
        }
        let n = sum.n_points.max(1) as f64;
        let _ = writeln!(
            text,
            "{:>10.3} {:>12} {:>10.4} {:>10.4}",
            f32::from(first) / 255.0,
            thousands(sum.n_points),
            sum.confidence as f64 / 255.0 / n,
            sum.n_right as f64 / n
        );
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_row_counts_alarms_on_right_clouds_and_hits_on_wrong_ones() {
        let cloud = |has_wrong_region: bool, hits: &[bool]| Measured {
            class: "sharp".to_owned(),
            name: "a".to_owned(),
            has_wrong_region,
            hits: hits.to_vec(),
            reliability: [Bin::default(); BINS.len()],
        };
        let clouds = [
            cloud(false, &[]),
            cloud(false, &[false]),
            cloud(true, &[true, false, true, true]),
            cloud(true, &[false]),
            cloud(true, &[]),
        ];
        let row = row_of_suspects("sharp", &clouds.iter().collect::<Vec<_>>());
        let words: Vec<&str> = row.split_whitespace().collect();
        assert_eq!(words, ["sharp", "2", "1", "3", "2", "1/2", "2/4", "3/5"]);
    }
}
