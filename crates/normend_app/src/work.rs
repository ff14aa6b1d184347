//! The work that runs beside the window: opening, propagating, exporting; one at a time.

use std::path::PathBuf;
use std::sync::Arc;

use normend_core::evidence::{Known, Station};
use normend_core::progress::Part;
use normend_core::{Parameters, PointCloud, Progress, Propagation, confidence};
use normend_io::{ReadError, ReadOptions, Scan, ScannerFiles, ScannerPlaces, WriteError};
use normend_render::{CloudUploader, UploadedCloud};

use crate::job::{Job, JobError, JobStatus};
use crate::journal::{self, found::Findings};
use crate::panels::export::{ExportOrder, NO_CONFIDENCE};
use crate::picture_job::{Made, PictureTarget};
use crate::recipes::JournalFolder;
use crate::scene_sync::{upload_oriented, upload_points};
use crate::session::Session;
use crate::theme;

/// Where a scan comes from.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum ScanOrigin {
    /// A file.
    File(PathBuf),
    /// Several files, as layers of one scan.
    Files(Vec<PathBuf>),
    /// The scan that comes with the program.
    Sample,
}

/// Characters of a file's name that fit on the card.
const MAX_NAME: usize = 36;
const SAMPLE: &[u8] = include_bytes!("../../../assets/sample.ply");
const SAMPLE_NAME: &str = "sample.ply";

impl ScanOrigin {
    /// A scan of these files; `None` when there are none.
    pub fn of_paths(mut paths: Vec<PathBuf>) -> Option<Self> {
        match paths.len() {
            0 | 1 => paths.pop().map(Self::File),
            _ => Some(Self::Files(paths)),
        }
    }

    /// The files.
    pub fn paths(&self) -> &[PathBuf] {
        match self {
            Self::File(path) => std::slice::from_ref(path),
            Self::Files(paths) => paths,
            Self::Sample => &[],
        }
    }

    /// The file's name without folders, and how many more there are.
    pub fn name(&self) -> String {
        match self {
            Self::Files(paths) => {
                let first = paths
                    .first()
                    .map(|path| Self::File(path.clone()).name())
                    .unwrap_or_default();
                format!("{first} + {} more", paths.len().saturating_sub(1))
            }
            Self::File(path) => path
                .file_name()
                .unwrap_or(path.as_os_str())
                .to_string_lossy()
                .into_owned(),
            Self::Sample => SAMPLE_NAME.to_owned(),
        }
    }

    /// How errors of reading it begin.
    fn display(&self) -> String {
        match self {
            Self::File(path) => path.display().to_string(),
            // Which of them it is, the error says.
            Self::Files(_) => String::new(),
            Self::Sample => SAMPLE_NAME.to_owned(),
        }
    }
}

/// Reads files as layers of one scan, each with its options.
fn read_files(paths: &[PathBuf], options: &[ReadOptions], progress: &dyn Progress) -> Result<Scan, ReadError> {
    let mut scans = Vec::with_capacity(paths.len());
    for (index, path) in paths.iter().enumerate() {
        let share = |index: usize| index as f32 / paths.len() as f32;
        let part = Part::new(progress, share(index)..share(index + 1));
        let options = options.get(index).cloned().unwrap_or_default();
        scans.push(match normend_io::read_with(path, &options, &part) {
            // The text has other columns than when the user named them.
            Err(ReadError::Broken { .. }) if options != ReadOptions::default() => normend_io::read(path, &part)?,
            result => result?,
        });
    }
    Scan::together(scans, &Part::new(progress, 1.0..1.0))
}

/// `reason` without the file that it begins with, which the message around it names shortly.
fn without_file(reason: &str, file: &str) -> String {
    let rest = reason.strip_prefix(file).unwrap_or(reason);
    rest.trim_start_matches([':', ',', ' ']).to_owned()
}

/// `reason` with the file that it begins with as "the target", because the message around it names it shortly.
fn about_target(reason: &str, file: &str) -> String {
    match reason.strip_prefix(file) {
        Some(rest) => format!("The target{rest}"),
        None => reason.to_owned(),
    }
}

/// A result with its picture's points, already on the GPU. `None` when there is no GPU or it had no room beside the
/// present cloud.
pub struct Uploaded<T> {
    /// The result.
    pub result: T,
    /// Its points.
    pub cloud: Option<UploadedCloud>,
}

/// A scan that was read, with the journals of it.
pub struct Opened {
    /// The scan.
    pub scan: Scan,
    /// Where its scanner was, as far as files tell.
    pub places: ScannerPlaces,
    /// The journals.
    pub findings: Findings,
}

/// The running job with what is needed when it ends.
pub enum Work {
    /// A scan is read.
    Open {
        /// The reading.
        job: Job<Uploaded<Opened>>,
        /// Where from.
        origin: ScanOrigin,
    },
    /// The open scan is oriented.
    Propagate {
        /// The orienting.
        job: Job<Uploaded<Propagation>>,
        /// With these parameters.
        parameters: Parameters,
        /// The user asked for it; else the document does, after parameters were taken back.
        is_asked: bool,
    },
    /// Pictures of the view are drawn.
    Pictures {
        /// The drawing.
        job: Job<Made>,
        /// Where they go.
        target: PictureTarget,
    },
    /// The open scan is written.
    Export {
        /// The writing.
        job: Job<()>,
        /// What is written, and where.
        order: ExportOrder,
        /// The revision of the document's signs that is written.
        revision: u64,
    },
}

impl Work {
    /// Starts to read a scan.
    pub fn open(
        ctx: &egui::Context,
        origin: ScanOrigin,
        options: Vec<ReadOptions>,
        journals: Option<JournalFolder>,
        uploader: Option<CloudUploader>,
    ) -> Self {
        let source = origin.clone();
        let job = Job::start(ctx, "open", "Reading", move |progress| {
            let scan = match &source {
                ScanOrigin::Sample => normend_io::read_bytes(SAMPLE.to_vec(), SAMPLE_NAME, progress),
                files => read_files(files.paths(), &options, progress),
            };
            let scan = scan.map_err(|error| match error {
                ReadError::Cancelled(_) => JobError::Cancelled,
                error => JobError::Failed(without_file(&error.to_string(), &source.display())),
            })?;
            let places =
                ScannerPlaces::read(&scan, ScannerFiles::default(), progress).map_err(|_| JobError::Cancelled)?;
            progress.stage("Preparing the picture");
            let cloud = uploader.and_then(|uploader| upload_points(&uploader, &scan.cloud).ok());
            // Hashes the file, and the editor needs that with its first edit.
            let identity = scan.identity(&source.name());
            let findings = journals.map_or_else(Findings::default, |folder| {
                journal::found::find(&folder.path, &identity, folder.patience)
            });
            let opened = Opened { scan, places, findings };
            Ok(Uploaded { result: opened, cloud })
        });
        Self::Open { job, origin }
    }

    /// Starts to orient the scan of a session with `parameters`.
    pub fn propagate(
        ctx: &egui::Context,
        session: &Session,
        parameters: Parameters,
        is_asked: bool,
        uploader: Option<CloudUploader>,
    ) -> Self {
        let document = &session.document;
        let (stations, track): (Vec<Station>, _) = (session.stations().cloned().collect(), session.track().cloned());
        let cloud: Arc<PointCloud> = Arc::clone(document.cloud());
        let given = document.given_normals().cloned();
        let viewpoints = Arc::clone(&document.state().viewpoints);
        let job = Job::start(ctx, "propagate", "Finding neighbors", move |progress| {
            let known = Known {
                given: given.as_ref().map(|normals| normals.as_slice()),
                stations: &stations,
                track: track.as_deref(),
                viewpoints: &viewpoints,
            };
            let propagation = Propagation::new(&cloud, known, parameters, progress)?;
            progress.stage("Preparing the picture");
            let uploaded = uploader.and_then(|uploader| upload_oriented(&uploader, &cloud, &propagation).ok());
            Ok(Uploaded {
                result: propagation,
                cloud: uploaded,
            })
        });
        Self::Propagate {
            job,
            parameters,
            is_asked,
        }
    }

    /// Starts to write the oriented scan; `None` when it is not oriented yet.
    pub fn export(ctx: &egui::Context, session: &Session, order: ExportOrder) -> Option<Self> {
        // A bit a point; what takes long is left to the job.
        let orientation = session.document.orientation()?.clone();
        let propagation = session.document.shared_propagation()?;
        let scan = Arc::clone(&session.scan);
        let targets = order.targets(&session.rule()?);
        let with_confidence = order.with_confidence;
        // The message around the reason names a file that is written alone.
        let named = if targets.len() == 1 {
            order.path.display().to_string()
        } else {
            String::new()
        };
        let job = Job::start(ctx, "export", "Writing", move |progress| {
            let normals = propagation.oriented_normals(&orientation);
            let confidence = if with_confidence {
                Some(confidence::confidence(&propagation).ok_or_else(|| JobError::Failed(NO_CONFIDENCE.to_owned()))?)
            } else {
                None
            };
            scan.write_layers(&normals, confidence.as_deref(), &targets, progress)
                .map_err(|error| match &error.reason {
                    WriteError::Cancelled(_) if error.written.is_empty() => JobError::Cancelled,
                    _ if named.is_empty() => JobError::Failed(error.to_string()),
                    _ => JobError::Failed(about_target(&error.to_string(), &named)),
                })
        });
        Some(Self::Export {
            job,
            order,
            revision: session.document.signs_revision(),
        })
    }

    /// What is done, for the card.
    pub fn title(&self) -> String {
        match self {
            Self::Open { origin, .. } => format!("Opening {}", theme::elided(&origin.name(), MAX_NAME)),
            Self::Propagate { .. } => "Orienting normals".to_owned(),
            Self::Pictures { .. } => "Drawing pictures".to_owned(),
            Self::Export { order, .. } => {
                format!("Exporting {}", theme::elided(&order.words(), MAX_NAME))
            }
        }
    }

    /// How far it is.
    pub fn status(&self) -> JobStatus {
        match self {
            Self::Open { job, .. } => job.status(),
            Self::Propagate { job, .. } => job.status(),
            Self::Export { job, .. } => job.status(),
            Self::Pictures { job, .. } => job.status(),
        }
    }

    /// Asks it to stop.
    pub fn cancel(&self) {
        match self {
            Self::Open { job, .. } => job.cancel(),
            Self::Propagate { job, .. } => job.cancel(),
            Self::Export { job, .. } => job.cancel(),
            Self::Pictures { job, .. } => job.cancel(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reasons_leave_the_naming_of_the_file_to_the_message() {
        let check = |reason, expect: &str| assert_eq!(without_file(reason, "/a/b.ply"), expect);
        check("/a/b.ply, line 3: no end_header", "line 3: no end_header");
        check("/a/b.ply: there is no such file", "there is no such file");
        check("something else", "something else");
        assert_eq!(about_target("/a/b.ply is full", "/a/b.ply"), "The target is full");
        assert_eq!(about_target("no normals", "/a/b.ply"), "no normals");
    }
}
