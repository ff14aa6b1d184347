//! Where the scanner was: flags of the commands that orient.

use std::path::PathBuf;

use clap::Args;
use glam::DVec3;
use normend_core::Progress;
use normend_core::evidence::Station;
use normend_io::{ReadError, Scan, ScannerFiles, ScannerPlaces};

/// Where the scanner was.
#[derive(Clone, Debug, Default, Args)]
pub struct ScannerArguments {
    /// Where the scanner stood that measured all points, in the scan's coordinates
    #[arg(long, value_name = "X,Y,Z", value_parser = place, allow_hyphen_values = true, conflicts_with_all = ["sensors", "trajectory"])]
    pub scanner: Option<DVec3>,

    /// Table of the scanner's places: lines of first point (from 0), count, x, y, z
    /// [default: SCAN.sensors.tsv beside the scan, or what its file says]
    #[arg(long, value_name = "TSV")]
    pub sensors: Option<PathBuf>,

    /// Text of the way of a scanner that moved: lines of time, x, y, z, with the times of the scan's column gps_time or time
    /// [default: SCAN.trajectory.txt, .csv or .tsv beside the scan]
    #[arg(long, value_name = "FILE")]
    pub trajectory: Option<PathBuf>,

    /// Leave out what the scan's file, and tables beside it, say of the scanner's places
    #[arg(long, conflicts_with_all = ["scanner", "sensors", "trajectory"])]
    pub no_stations: bool,
}

impl ScannerArguments {
    /// Whether a place was given.
    pub fn is_given(&self) -> bool {
        self.scanner.is_some() || self.sensors.is_some() || self.trajectory.is_some()
    }

    /// The scanner's places for `scan`.
    ///
    /// # Errors
    /// A table or trajectory that is named and cannot be read or is not of this scan; Ctrl-C.
    pub fn places(&self, scan: &Scan, progress: &dyn Progress) -> Result<ScannerPlaces, ReadError> {
        if self.no_stations {
            return Ok(ScannerPlaces::default());
        }
        if let Some(position) = self.scanner {
            let station = Station {
                points: 0..scan.cloud.n_points() as u32,
                position,
            };
            return Ok(ScannerPlaces {
                stations: vec![station],
                names: vec![String::new()],
                ..ScannerPlaces::default()
            });
        }
        let files = ScannerFiles {
            sensors: self.sensors.as_deref(),
            trajectory: self.trajectory.as_deref(),
        };
        ScannerPlaces::read(scan, files, progress)
    }
}

/// Parses three finite coordinates.
fn place(typed: &str) -> Result<DVec3, String> {
    let parsed: Option<Vec<f64>> = typed.split(',').map(|number| number.trim().parse().ok()).collect();
    match parsed.as_deref() {
        Some(&[x, y, z]) if DVec3::new(x, y, z).is_finite() => Ok(DVec3::new(x, y, z)),
        _ => Err("type three numbers, as in 1.5,0,-2".to_owned()),
    }
}
