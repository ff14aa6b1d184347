//! `normend bench clouds`: the generated clouds as files.

use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};

use anyhow::Context;
use normend_core::Progress;
use normend_core::evidence::Station;
use normend_core::progress::Part;
use normend_core::shapes::{BenchmarkCloud, BenchmarkPoints, benchmark_clouds};
use normend_io::{Positions, write_points};

use super::super::{Outcome, check_may_write, prepare, title_of, wrong_use};
use crate::arguments::bench::CloudsArguments;
use crate::console::{Bar, counted};

/// The files of one cloud.
struct Files {
    truth: PathBuf,
    raw: PathBuf,
    sensors: PathBuf,
}

/// Makes every cloud that was asked for and writes its files.
///
/// # Errors
/// A name that no cloud has, files that exist or cannot be written, Ctrl-C.
pub fn run(arguments: &CloudsArguments) -> anyhow::Result<Outcome> {
    let clouds = chosen(&arguments.only)?;
    for cloud in &clouds {
        let Files { truth, raw, sensors } = files_of(&arguments.folder, cloud);
        for file in [truth, raw, sensors] {
            check_may_write(&file, arguments.overwrite)?;
        }
    }
    prepare(&arguments.common)?;
    let bar = Bar::new(&title_of(&arguments.folder), arguments.common.quiet);
    let share = 1.0 / clouds.len() as f32;
    let mut n_points = 0;
    for (index, cloud) in clouds.iter().enumerate() {
        let begin = index as f32 * share;
        bar.stage(cloud.name);
        let points = cloud.generate(&Part::new(&bar, begin..begin + 0.8 * share))?;
        let folder = arguments.folder.join(cloud.class);
        fs::create_dir_all(&folder).with_context(|| format!("cannot make the folder {}", folder.display()))?;
        write(
            &points,
            &files_of(&arguments.folder, cloud),
            &Part::new(&bar, begin + 0.8 * share..begin + share),
        )?;
        n_points += points.shape.positions.len();
    }
    bar.say(&format!(
        "{}: {} of {}",
        arguments.folder.display(),
        counted(clouds.len(), "cloud"),
        counted(n_points, "point")
    ));
    Ok(Outcome::Done)
}

/// The clouds whose name or class is one of `only`; all when it is empty.
fn chosen(only: &[String]) -> anyhow::Result<Vec<BenchmarkCloud>> {
    let mut clouds = benchmark_clouds();
    let is = |cloud: &BenchmarkCloud, name: &String| cloud.name == name || cloud.class == name;
    if let Some(unknown) = only.iter().find(|name| !clouds.iter().any(|cloud| is(cloud, name))) {
        let names: Vec<&str> = clouds.iter().map(|cloud| cloud.name).collect();
        return Err(wrong_use(format!(
            "no generated cloud or class is called {unknown}; the clouds are {}",
            names.join(", ")
        )));
    }
    clouds.retain(|cloud| only.is_empty() || only.iter().any(|name| is(cloud, name)));
    Ok(clouds)
}

fn files_of(folder: &Path, cloud: &BenchmarkCloud) -> Files {
    let file = |extension: &str| folder.join(cloud.class).join(format!("{}.{extension}", cloud.name));
    Files {
        truth: file("ply"),
        raw: file("raw.ply"),
        sensors: file("sensors.tsv"),
    }
}

fn write(points: &BenchmarkPoints, files: &Files, progress: &dyn Progress) -> anyhow::Result<()> {
    let positions = Positions::Float(&points.shape.positions);
    write_points(&files.raw, positions, None, &Part::new(progress, 0.0..0.4))?;
    let normals = Some(points.shape.normals.as_slice());
    write_points(&files.truth, positions, normals, &Part::new(progress, 0.4..1.0))?;
    if !points.stations.is_empty() {
        normend_io::write_bytes(&files.sensors, sensors(&points.stations).as_bytes())?;
    }
    Ok(())
}

/// The table of stations.
fn sensors(stations: &[Station]) -> String {
    let mut table = "first\tcount\tx\ty\tz\n".to_owned();
    for Station { points, position } in stations {
        let (first, count) = (points.start, points.len());
        // Writing to a string does not fail.
        let _ = writeln!(
            table,
            "{first}\t{count}\t{:.6}\t{:.6}\t{:.6}",
            position.x, position.y, position.z
        );
    }
    table
}
