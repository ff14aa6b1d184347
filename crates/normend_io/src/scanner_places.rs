//! What is known of where the scanner was: from the scan's own file, from tables beside it, or from files that the user names.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use normend_core::Progress;
use normend_core::evidence::{Station, Track};

use crate::stations::read_stations;
use crate::trajectory::read_track;
use crate::{ReadError, Scan};

/// Ends of the names of trajectories that lie beside a scan, after its name without extension.
const TRAJECTORY_ENDS: [&str; 3] = ["trajectory.txt", "trajectory.csv", "trajectory.tsv"];

/// The end of the name of a table of stations.
const SENSORS_END: &str = "sensors.tsv";

/// Files that the user names in place of what is found.
#[derive(Clone, Copy, Debug, Default)]
pub struct ScannerFiles<'a> {
    /// A table of first point, count, x, y, z.
    pub sensors: Option<&'a Path>,
    /// A text of time, x, y, z.
    pub trajectory: Option<&'a Path>,
}

/// Where the scanner of a scan was.
#[derive(Clone, Debug, Default)]
pub struct ScannerPlaces {
    /// Where it stood.
    pub stations: Vec<Station>,
    /// The name of each station in the file, empty where it has none.
    pub names: Vec<String>,
    /// Where it was while it moved.
    pub track: Option<Arc<Track>>,
    /// The file that says so, without folders; `None` where nothing is known.
    pub from: Option<String>,
    /// What the user should know of these files, a sentence each.
    pub notes: Vec<String>,
}

impl ScannerPlaces {
    /// Reads what is known of where the scanner of `scan` was.
    ///
    /// Files that are named count instead of what the scan's file says. Else `<name>.sensors.tsv` beside the scan does, then the scan's
    /// file, then `<name>.trajectory.txt`, `.csv` or `.tsv` beside it. One beside it that cannot be read is no failure but a note.
    ///
    /// # Errors
    /// [`ReadError`] of a file that is named; [`ReadError::Cancelled`].
    pub fn read(scan: &Scan, files: ScannerFiles<'_>, progress: &dyn Progress) -> Result<Self, ReadError> {
        let mut places = Self::default();
        if files.sensors.is_some() || files.trajectory.is_some() {
            if let Some(path) = files.sensors {
                places.take_stations(path, read_stations(path, scan)?);
            }
            if let Some(path) = files.trajectory {
                places.take_track(path, scan, progress)?;
            }
            return Ok(places);
        }
        if let Some(path) = beside(scan, &[SENSORS_END]) {
            match read_stations(&path, scan) {
                Ok(stations) => {
                    places.take_stations(&path, stations);
                    return Ok(places);
                }
                Err(error) => places
                    .notes
                    .push(format!("a table of scanner positions is not used: {error}")),
            }
        }
        (places.stations, places.names) = scan.named_stations().into_iter().unzip();
        if !places.stations.is_empty() {
            places.from = scan.path().map(|path| name_of(path));
            return Ok(places);
        }
        if let Some(path) = beside(scan, &TRAJECTORY_ENDS) {
            match places.take_track(&path, scan, progress) {
                Ok(()) => {}
                Err(ReadError::Cancelled(stop)) => return Err(stop.into()),
                Err(error) => places.notes.push(format!("a trajectory is not used: {error}")),
            }
        }
        Ok(places)
    }

    /// Whether nothing is known.
    pub fn is_empty(&self) -> bool {
        self.stations.is_empty() && self.track.is_none()
    }

    /// What is known, in words: "3 scanner positions from scan.e57"; `None` where nothing is.
    pub fn words(&self) -> Option<String> {
        let what = match (self.stations.len(), &self.track) {
            (0, None) => return None,
            (0, Some(_)) => "a trajectory".to_owned(),
            (1, track) => format!("1 scanner position{}", and_track(track)),
            (n, track) => format!("{n} scanner positions{}", and_track(track)),
        };
        Some(match &self.from {
            Some(from) => format!("{what} from {from}"),
            None => what,
        })
    }

    fn take_stations(&mut self, path: &Path, stations: Vec<Station>) {
        self.names = vec![String::new(); stations.len()];
        self.stations = stations;
        self.from = Some(name_of(path));
    }

    fn take_track(&mut self, path: &Path, scan: &Scan, progress: &dyn Progress) -> Result<(), ReadError> {
        let tracked = read_track(path, scan, progress)?;
        let name = name_of(path);
        self.notes
            .extend(tracked.notes.iter().map(|note| format!("{name}: {note}")));
        self.track = Some(Arc::new(tracked.track));
        self.from = Some(match self.from.take() {
            Some(from) => format!("{from} and {name}"),
            None => name,
        });
        Ok(())
    }
}

fn and_track(track: &Option<Arc<Track>>) -> &'static str {
    if track.is_some() { " and a trajectory" } else { "" }
}

fn name_of(path: &Path) -> String {
    path.file_name()
        .unwrap_or(path.as_os_str())
        .to_string_lossy()
        .into_owned()
}

/// The first file beside a scan that has its name, a dot and one of these ends.
fn beside(scan: &Scan, ends: &[&str]) -> Option<PathBuf> {
    let path = scan.path()?;
    let stem = path.file_stem()?.to_owned();
    let candidates = ends.iter().map(|end| {
        let mut name = stem.clone();
        name.push(".");
        name.push(end);
        path.with_file_name(name)
    });
    // A text that is opened itself is no table beside itself.
    candidates
        .into_iter()
        .find(|candidate| candidate != path && candidate.is_file())
}

#[cfg(test)]
mod tests {
    use std::fs;

    use glam::DVec3;
    use normend_core::Silent;

    use super::*;

    const SCAN: &str = "x,y,z,gps_time\n0,0,0,1\n1,0,0,2\n0,1,0,3\n1,1,0,40\n";

    fn places(folder: &tempfile::TempDir, files: ScannerFiles<'_>) -> Result<ScannerPlaces, ReadError> {
        let path = folder.path().join("a.csv");
        fs::write(&path, SCAN).unwrap();
        ScannerPlaces::read(&crate::read(&path, &Silent).unwrap(), files, &Silent)
    }

    #[test]
    fn tables_beside_the_scan_are_found() {
        let folder = tempfile::tempdir().unwrap();
        let nothing = places(&folder, ScannerFiles::default()).unwrap();
        assert!(nothing.is_empty() && nothing.words().is_none() && nothing.notes.is_empty());

        fs::write(folder.path().join("a.trajectory.csv"), "t,x,y,z\n1,0,0,5\n3,2,0,5\n").unwrap();
        let moved = places(&folder, ScannerFiles::default()).unwrap();
        assert_eq!(moved.words().unwrap(), "a trajectory from a.trajectory.csv");
        let track = moved.track.unwrap();
        assert_eq!(
            [track.place(0), track.place(3)],
            [Some(DVec3::new(0.0, 0.0, 5.0)), None]
        );
        assert!(
            moved.notes[0].starts_with("a.trajectory.csv: 25.0 %"),
            "{:?}",
            moved.notes
        );

        fs::write(folder.path().join("a.sensors.tsv"), "0 2 0 0 9\n2 2 0 0 -9\n").unwrap();
        let stood = places(&folder, ScannerFiles::default()).unwrap();
        assert_eq!(stood.words().unwrap(), "2 scanner positions from a.sensors.tsv");
        assert!(stood.track.is_none());

        // One that is wrong is said, and the next counts.
        fs::write(folder.path().join("a.sensors.tsv"), "0 20 0 0 9\n").unwrap();
        let other = places(&folder, ScannerFiles::default()).unwrap();
        assert!(other.track.is_some());
        assert!(
            other.notes[0].contains("a.sensors.tsv, line 1: 20 points"),
            "{:?}",
            other.notes
        );
    }

    #[test]
    fn files_that_are_named_count_alone_and_must_be_right() {
        let folder = tempfile::tempdir().unwrap();
        fs::write(folder.path().join("a.sensors.tsv"), "0 4 0 0 9\n").unwrap();
        let trajectory = folder.path().join("drive.txt");
        fs::write(&trajectory, "1 0 0 5\n3 2 0 5\n").unwrap();
        let files = ScannerFiles {
            trajectory: Some(&trajectory),
            ..ScannerFiles::default()
        };
        let named = places(&folder, files).unwrap();
        assert!(named.stations.is_empty());
        assert_eq!(named.words().unwrap(), "a trajectory from drive.txt");
        fs::write(&trajectory, "5000 0 0 5\n6000 2 0 5\n").unwrap();
        let error = places(&folder, files).unwrap_err().to_string();
        assert!(
            error.contains("drive.txt: its times, 5000 to 6000 s, do not overlap"),
            "{error}"
        );
    }

    #[test]
    fn places_of_the_file_itself() {
        let pcd = "# .PCD v0.7\nVERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH 2\nHEIGHT 1\n\
                   VIEWPOINT 1 2 3 1 0 0 0\nPOINTS 2\nDATA ascii\n0 0 0\n1 1 1\n";
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.pcd");
        fs::write(&path, pcd).unwrap();
        let scan = crate::read(&path, &Silent).unwrap();
        let places = ScannerPlaces::read(&scan, ScannerFiles::default(), &Silent).unwrap();
        assert_eq!(places.words().unwrap(), "1 scanner position from a.pcd");
        assert_eq!(places.stations[0].position, DVec3::new(1.0, 2.0, 3.0));
        assert_eq!((places.stations[0].points.clone(), places.names.len()), (0..2, 1));
    }
}
