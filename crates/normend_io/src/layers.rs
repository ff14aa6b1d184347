//! Scans of several files: one cloud, of which each file is a layer that is written again by itself.
//!
//! A scan of one file has one layer with all its points, and what is said here of all layers costs it nothing.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use glam::{DVec3, Vec3};
use normend_core::evidence::Station;
use normend_core::progress::Part;
use normend_core::{PointCloud, Progress};

use crate::error::{Broken, ReadError, WriteError};
use crate::format::FileFormat;
use crate::new_file::Loss;
use crate::recipe::ScanIdentity;
use crate::save::is_same_file;
use crate::scan::{Layer, Scan, hash};
use crate::write::WriteOptions;
use crate::xyz::TextColumns;

/// The color of points whose file has none where another has: a gray that is neither shade nor light.
const NO_COLOR: [u8; 3] = [160; 3];

/// Where one file of a scan goes.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LayerTarget {
    /// The file to write.
    pub path: PathBuf,
    /// What it replaces, and the rule.
    pub options: WriteOptions,
}

/// Why not all files of a scan were written. Those that were are whole, the others as they were.
#[derive(Debug, thiserror::Error)]
#[error("{reason}{}", written_words(written))]
pub struct NotAllWritten {
    /// What went wrong.
    #[source]
    pub reason: WriteError,
    /// The files that were written before that, in order.
    pub written: Vec<PathBuf>,
}

fn written_words(written: &[PathBuf]) -> String {
    if written.is_empty() {
        return String::new();
    }
    let names: Vec<String> = written.iter().map(|path| path.display().to_string()).collect();
    format!("; written before that: {}", names.join(", "))
}

impl Scan {
    /// One scan of several: a cloud of all points around a common origin, file after file, each file kept to be written again by
    /// itself. Their coordinates are taken as they are. The clouds that came in are dropped one by one, the files are not copied. O(n).
    ///
    /// # Errors
    /// [`ReadError`] when there is none, when there are too many points for one scan, or the files are too far apart.
    pub fn together(scans: Vec<Scan>, progress: &dyn Progress) -> Result<Scan, ReadError> {
        progress.stage("Putting the files together");
        let broken = |reason: String| ReadError::Broken {
            name: "the files together".to_owned(),
            broken: Broken::whole(reason),
        };
        if scans.len() < 2 {
            let one = scans.into_iter().next();
            return one.ok_or_else(|| broken("there is none: name a file".to_owned()));
        }
        let n_points: usize = scans.iter().map(|scan| scan.cloud.n_points()).sum();
        let has_normals = scans.iter().any(|scan| scan.given_normals.is_some());
        let n_left_out = scans.iter().map(|scan| scan.n_left_out).sum();
        let mut clouds = Vec::with_capacity(scans.len());
        let mut normals = Vec::with_capacity(if has_normals { n_points } else { 0 });
        let mut layers = Vec::new();
        let mut n_before = 0_usize;
        for scan in scans {
            progress.report(n_before as f32 / n_points.max(1) as f32)?;
            // Too many points are refused below, before anybody asks for these.
            let moved = |point: u32| (n_before as u64 + u64::from(point)).min(u32::MAX.into()) as u32;
            layers.extend(scan.layers.into_iter().map(|layer| Layer {
                points: moved(layer.points.start)..moved(layer.points.end),
                ..layer
            }));
            n_before += scan.cloud.n_points();
            if has_normals {
                match &scan.given_normals {
                    Some(given) => normals.extend_from_slice(given),
                    None => normals.resize(n_before, Vec3::ZERO),
                }
            }
            clouds.push(scan.cloud);
        }
        let cloud = PointCloud::together(clouds).map_err(|error| broken(error.to_string()))?;
        Ok(Scan {
            cloud: Arc::new(cloud),
            given_normals: has_normals.then(|| Arc::new(normals)),
            n_left_out,
            layers,
        })
    }

    /// The files, in the order of their points; at least one.
    pub fn layers(&self) -> &[Layer] {
        &self.layers
    }

    /// The index of the file that `point` is of. O(log number of files).
    pub fn layer_of(&self, point: u32) -> Option<usize> {
        let index = self.layers.partition_point(|layer| layer.points.end <= point);
        (index < self.layers.len()).then_some(index)
    }

    /// Where the first file was read from; `None` for [`crate::read_bytes`].
    pub fn path(&self) -> Option<&PathBuf> {
        self.layers.first()?.path()
    }

    /// What the first file was read as.
    pub fn format(&self) -> FileFormat {
        self.layers.first().map_or(FileFormat::Ply, |layer| layer.format)
    }

    /// What was read, in words ("PLY", "PLY of Gaussian splats", "PLY, E57").
    pub fn label(&self) -> String {
        let mut labels: Vec<String> = self.layers.iter().map(Layer::label).collect();
        labels.sort();
        labels.dedup();
        labels.join(", ")
    }

    /// The row of each point, ascending, where the rows of one file follow those of the file before; `None` when every row is a point.
    /// O(1) for one file, else O(n).
    pub fn rows(&self) -> Option<Arc<Vec<u32>>> {
        if let [layer] = &self.layers[..] {
            return layer.rows.clone();
        }
        if self.n_left_out == 0 {
            return None;
        }
        let mut rows = Vec::with_capacity(self.cloud.n_points());
        let mut first = 0_u32;
        for layer in &self.layers {
            match &layer.rows {
                Some(of_points) => rows.extend(of_points.iter().map(|row| first.saturating_add(*row))),
                None => rows.extend((0..layer.n_points() as u32).map(|row| first.saturating_add(row))),
            }
            let n_rows = (layer.n_points() + layer.n_left_out) as u64;
            first = (u64::from(first) + n_rows).min(u32::MAX.into()) as u32;
        }
        Some(Arc::new(rows))
    }

    /// Where `point` is, with all digits that its file has; `None` past the last point. Reads up to some thousand rows.
    pub fn coordinates(&self, point: u32) -> Option<DVec3> {
        self.layers.get(self.layer_of(point)?)?.coordinates(point)
    }

    /// Whether another program has changed one of the files since it was read, or since it was written over. Looks at the disk, not
    /// into the files.
    pub fn is_changed_on_disk(&self) -> bool {
        self.layers.iter().any(Layer::is_changed_on_disk)
    }

    /// What tells this scan from others in recipes; `name` is what it is called. See [`Layer::identity`]. Of several files the sizes
    /// and points are added up, the hash is that of the files' hashes, and each file is listed.
    pub fn identity(&self, name: &str) -> ScanIdentity {
        if let [layer] = &self.layers[..] {
            return layer.identity(name);
        }
        let files: Vec<ScanIdentity> = self.layers.iter().map(|layer| layer.identity(&layer.name)).collect();
        let paths: Option<Vec<String>> = files.iter().map(|file| file.path.clone()).collect();
        let hashes: Vec<u8> = files.iter().flat_map(|file| file.hash).collect();
        ScanIdentity {
            name: name.to_owned(),
            path: paths.map(|paths| paths.join("; ")),
            n_bytes: files.iter().fold(0, |sum, file| sum.saturating_add(file.n_bytes)),
            hash: hash(&hashes),
            n_points: self.cloud.n_points() as u64,
            columns: None,
            files,
        }
    }

    /// What the columns of a text are and how they were told; `None` for other formats and for several files. Looks at the first
    /// thousand rows.
    pub fn text_columns(&self) -> Option<TextColumns> {
        self.only().ok()?.text_columns()
    }

    /// The names that the columns were given by [`crate::ReadOptions`], if the scan is one text and they were.
    pub fn columns_given(&self) -> Option<&[String]> {
        self.only().ok()?.columns_given()
    }

    /// Places that the files say their points were measured from, with the points of each, ascending. O(number of places).
    pub fn stations(&self) -> Vec<Station> {
        self.layers.iter().flat_map(Layer::stations).collect()
    }

    /// [`Self::stations`] with the names of their scans, empty where a file gives none. O(number of places).
    pub(crate) fn named_stations(&self) -> Vec<(Station, String)> {
        self.layers.iter().flat_map(Layer::named_stations).collect()
    }

    /// Names of all columns of numbers of all files, coordinates and normals among them, each once, in the order of the files: the
    /// scalar properties of a PLY's vertices, or the columns of a text, which without names are called "Column 4". Nothing but the
    /// headers, or the first rows, is looked at.
    pub fn scalar_columns(&self) -> Vec<String> {
        let mut names: Vec<String> = Vec::new();
        for name in self.layers.iter().flat_map(Layer::scalar_columns) {
            if !names.contains(&name) {
                names.push(name);
            }
        }
        names
    }

    /// The values of the column called `name` by point, not finite where the file's are not, nothing stands there or a file has no such
    /// column; `None` when none has. O(n), parallel; 8 bytes a point.
    ///
    /// # Errors
    /// [`ReadError::Broken`] when a value is no number, [`ReadError::Cancelled`].
    pub fn scalar(&self, name: &str, progress: &dyn Progress) -> Result<Option<Vec<f64>>, ReadError> {
        self.by_layer(f64::NAN, |layer| layer.scalar(name, progress))
    }

    /// Whether a file has a color for each point.
    pub fn has_colors(&self) -> bool {
        self.layers.iter().any(Layer::has_colors)
    }

    /// Whether the points of a file are Gaussian splats. Looks at the names of columns.
    pub fn is_splats(&self) -> bool {
        self.layers.iter().any(Layer::is_splats)
    }

    /// The files' colors by point as red, green, blue, gamma-encoded, gray where a file has none; `None` when none has. Columns of
    /// bytes, of 16 bits, and of shares of 1 are told apart by their type and their largest value; Gaussian splats have their mean
    /// color. O(n), parallel; 24 bytes a point for a while.
    ///
    /// # Errors
    /// As [`Self::scalar`].
    pub fn colors(&self, progress: &dyn Progress) -> Result<Option<Vec<[u8; 3]>>, ReadError> {
        self.by_layer(NO_COLOR, |layer| layer.colors(progress))
    }

    /// What `read` gives for each file, one after another, with `none` for the points of those that it gives nothing for.
    fn by_layer<T: Clone>(
        &self,
        none: T,
        read: impl Fn(&Layer) -> Result<Option<Vec<T>>, ReadError>,
    ) -> Result<Option<Vec<T>>, ReadError> {
        let mut all: Option<Vec<T>> = None;
        for layer in &self.layers {
            let values = read(layer)?;
            all = match (all, values) {
                (None, Some(values)) if layer.points.start == 0 => Some(values),
                (None, None) => None,
                (all, values) => {
                    let mut all = all.unwrap_or_default();
                    all.resize(layer.points.start as usize, none.clone());
                    match values {
                        Some(values) => all.extend(values),
                        None => all.resize(layer.points.end as usize, none.clone()),
                    }
                    Some(all)
                }
            };
        }
        Ok(all)
    }

    /// The file of a scan of one.
    fn only(&self) -> Result<&Layer, WriteError> {
        match &self.layers[..] {
            [layer] => Ok(layer),
            layers => Err(WriteError::SeveralFiles { n_files: layers.len() }),
        }
    }

    /// What it is called: the first file's name, and how many more there are.
    pub fn name(&self) -> String {
        let first = self.layers.first().map_or("", |layer| layer.name.as_str());
        match self.layers.len() {
            ..=1 => first.to_owned(),
            n => format!("{first} + {} more", n - 1),
        }
    }

    /// Writes each file with its part of `normals` and `confidence` (by point of the scan) to its own target, in order, each as
    /// [`Layer::write_with_confidence`] does. Nothing is written when a target cannot be right: one of another file of this scan, one
    /// that two would go to, an extension of another format.
    ///
    /// # Errors
    /// [`NotAllWritten`], which says what was written before.
    pub fn write_layers(
        &self,
        normals: &[Vec3],
        confidence: Option<&[u8]>,
        targets: &[LayerTarget],
        progress: &dyn Progress,
    ) -> Result<(), NotAllWritten> {
        let mut written = Vec::new();
        let outcome = self.check_targets(normals.len(), targets).and_then(|()| {
            for (layer, target) in self.layers.iter().zip(targets) {
                let points = layer.points.start as usize..layer.points.end as usize;
                let share = |point: usize| point as f32 / self.cloud.n_points().max(1) as f32;
                let part = Part::new(progress, share(points.start)..share(points.end));
                let confidence = confidence.and_then(|confidence| confidence.get(points.clone()));
                layer.write_with_confidence(&normals[points], confidence, &target.path, &target.options, &part)?;
                written.push(target.path.clone());
            }
            Ok(())
        });
        outcome.map_err(|reason| NotAllWritten { reason, written })
    }

    /// Refuses, before anything is written, what cannot be right.
    fn check_targets(&self, n_normals: usize, targets: &[LayerTarget]) -> Result<(), WriteError> {
        if targets.len() != self.layers.len() {
            return Err(WriteError::SeveralFiles {
                n_files: self.layers.len(),
            });
        }
        if n_normals != self.cloud.n_points() {
            return Err(WriteError::Count {
                n_normals,
                n_points: self.cloud.n_points(),
            });
        }
        for (index, (layer, target)) in self.layers.iter().zip(targets).enumerate() {
            let path = &target.path;
            FileFormat::of_target(path, layer.path().map(PathBuf::as_path))?;
            let refuse = |reason| {
                let path = path.clone();
                Err(WriteError::Target { path, reason })
            };
            let others = self.layers.iter().enumerate().filter(|(other, _)| *other != index);
            let mut others = others.filter_map(|(_, layer)| layer.path());
            if others.any(|other| is_same_file(other, path)) {
                return refuse("is another file of this scan: name another target");
            }
            let mut before = targets[..index].iter();
            if before.any(|before| before.path == *path || is_same_file(&before.path, path)) {
                return refuse("would be written twice: give each file a target of its own");
            }
        }
        Ok(())
    }

    /// [`Layer::write`] of a scan of one file.
    ///
    /// # Errors
    /// [`WriteError`]; the target is as it was then.
    pub fn write(
        &self,
        normals: &[Vec3],
        path: &Path,
        options: &WriteOptions,
        progress: &dyn Progress,
    ) -> Result<(), WriteError> {
        self.only()?.write(normals, path, options, progress)
    }

    /// [`Layer::write_with_confidence`] of a scan of one file.
    ///
    /// # Errors
    /// [`WriteError`]; the target is as it was then.
    pub fn write_with_confidence(
        &self,
        normals: &[Vec3],
        confidence: Option<&[u8]>,
        path: &Path,
        options: &WriteOptions,
        progress: &dyn Progress,
    ) -> Result<(), WriteError> {
        let layer = self.only()?;
        layer.write_with_confidence(normals, confidence, path, options, progress)
    }

    /// [`Layer::losses`] of a scan of one file.
    ///
    /// # Errors
    /// [`WriteError::Extension`], [`WriteError::SeveralFiles`].
    pub fn losses(&self, path: &Path) -> Result<Vec<Loss>, WriteError> {
        self.only()?.losses(path)
    }

    /// Writes a scan of one file to `path` as it is, in the format of `path`'s extension: the normals that the file has, if any, and all
    /// else that the format can hold ([`Self::losses`] names the rest).
    ///
    /// # Errors
    /// [`WriteError`]; the target is as it was then. [`WriteError::Target`] where the format is the input's already.
    pub fn convert(&self, path: &Path, options: &WriteOptions, progress: &dyn Progress) -> Result<(), WriteError> {
        let given = self.given_normals.as_ref().map(|normals| normals.as_slice());
        self.only()?.convert(given, path, options, progress)
    }
}

#[cfg(test)]
mod tests {
    use normend_core::Silent;

    use super::*;
    use crate::{read, read_bytes};

    /// A text of a row of points along x, one of them without a place.
    fn text(corner: DVec3, names: &str, values: &str) -> String {
        let mut text = format!("x y z{names}\n");
        for row in 0..5 {
            let x = if row == 1 {
                "nan".to_owned()
            } else {
                format!("{:.3}", corner.x + f64::from(row))
            };
            text += &format!("{x} {:.3} {:.3}{values}\n", corner.y, corner.z);
        }
        text
    }

    fn two() -> Scan {
        let a = text(DVec3::new(500_000.125, 4_500_000.25, 80.0), " nx ny nz", " 0 0 1");
        let b = text(
            DVec3::new(500_100.125, 4_500_000.25, 90.0),
            " intensity red green blue",
            " 7 1 2 255",
        );
        let read = |text: String, name: &str| read_bytes(text.into_bytes(), name, &Silent).unwrap();
        Scan::together(vec![read(a, "a.xyz"), read(b, "folder/b.xyz")], &Silent).unwrap()
    }

    #[test]
    fn files_together_are_one_cloud() {
        let scan = two();
        assert_eq!((scan.cloud.n_points(), scan.n_left_out), (8, 2));
        let [a, b] = scan.layers() else { panic!("two files") };
        assert_eq!((a.name.as_str(), b.name.as_str()), ("a.xyz", "b.xyz"));
        assert_eq!((a.points.clone(), b.points.clone()), (0..4, 4..8));
        assert_eq!(scan.rows().unwrap()[..], [0, 2, 3, 4, 5, 7, 8, 9]);
        assert_eq!(
            [0, 3, 4, 7, 8].map(|point| scan.layer_of(point)),
            [Some(0), Some(0), Some(1), Some(1), None]
        );
        assert_eq!(scan.coordinates(5), Some(DVec3::new(500_102.125, 4_500_000.25, 90.0)));
        assert_eq!(scan.coordinates(8), None);
        for point in 0..8 {
            let place = scan.cloud.origin() + scan.cloud.relative(point);
            assert_eq!(Some(place), scan.coordinates(point as u32));
        }
        let given = scan.given_normals.as_ref().unwrap();
        assert_eq!(given[..], [[Vec3::Z; 4], [Vec3::ZERO; 4]].concat());
    }

    #[test]
    fn what_one_file_lacks_is_told_of_the_other() {
        let scan = two();
        let values = scan.scalar("intensity", &Silent).unwrap().unwrap();
        assert!(values[..4].iter().all(|value| value.is_nan()));
        assert_eq!(values[4..], [7.0; 4]);
        let normals = scan.scalar("nz", &Silent).unwrap().unwrap();
        assert_eq!(normals[..4], [1.0; 4]);
        assert!(normals.len() == 8 && normals[4..].iter().all(|value| value.is_nan()));
        assert_eq!(scan.scalar("time", &Silent).unwrap(), None);
        let colors = scan.colors(&Silent).unwrap().unwrap();
        assert_eq!(colors, [[NO_COLOR; 4], [[1, 2, 255]; 4]].concat());
        assert_eq!(
            scan.scalar_columns(),
            ["x", "y", "z", "nx", "ny", "nz", "intensity", "red", "green", "blue"]
        );
    }

    #[test]
    fn each_file_is_written_by_itself() {
        let folder = tempfile::tempdir().unwrap();
        let scan = two();
        let normals: Vec<Vec3> = (0..8).map(|point| if point < 4 { Vec3::X } else { Vec3::Y }).collect();
        for layer in scan.layers() {
            let path = folder.path().join(&layer.name);
            let points = layer.points.start as usize..layer.points.end as usize;
            layer
                .write(&normals[points], &path, &WriteOptions::default(), &Silent)
                .unwrap();
            let again = read(&path, &Silent).unwrap();
            assert_eq!((again.cloud.n_points(), again.n_left_out), (4, 1));
            let expect = if layer.name == "a.xyz" { Vec3::X } else { Vec3::Y };
            assert_eq!(again.given_normals.unwrap()[..], [expect; 4]);
        }
        let target = |name: &str| LayerTarget {
            path: folder.path().join(name),
            options: WriteOptions::default(),
        };
        let write = |targets: &[LayerTarget]| scan.write_layers(&normals, None, targets, &Silent);
        write(&[target("1.xyz"), target("2.ply")]).unwrap();
        assert_eq!(
            read(&target("2.ply").path, &Silent).unwrap().given_normals.unwrap()[..],
            [Vec3::Y; 4]
        );
        let error = write(&[target("3.xyz"), target("3.xyz")]).unwrap_err();
        assert!(
            error.written.is_empty() && error.to_string().contains("written twice"),
            "{error}"
        );
        let error = write(&[target("3.xyz"), target("none/4.xyz")]).unwrap_err();
        assert_eq!(error.written, [target("3.xyz").path]);
        assert!(error.to_string().contains("written before that: "), "{error}");
        assert!(write(&[target("5.xyz")]).is_err() && !target("5.xyz").path.exists());

        let path = folder.path().join("c.xyz");
        let error = scan
            .write(&normals, &path, &WriteOptions::default(), &Silent)
            .unwrap_err();
        assert!(error.to_string().contains("2 files"), "{error}");
        assert!(!path.exists());
    }

    #[test]
    fn identities_tell_files_and_their_order() {
        let read = |text: &str| read_bytes(text.as_bytes().to_vec(), "a.xyz", &Silent).unwrap();
        let (a, b) = (read("1 2 3\n"), read("4 5 6\n7 8 9\n"));
        let identity = |scans: &[&Scan]| {
            let scans = scans.iter().map(|&scan| scan.clone()).collect();
            Scan::together(scans, &Silent).unwrap().identity("a")
        };
        let (one, ab, ba) = (identity(&[&a]), identity(&[&a, &b]), identity(&[&b, &a]));
        assert!(ab.is_same_content(&identity(&[&a, &b])));
        assert!(!ab.is_same_content(&ba) && !ab.is_same_content(&one));
        assert_eq!((ab.n_points, ab.n_bytes, ab.files.len()), (3, 18, 2));
        assert_eq!(ab.files[1].hash, b.identity("b").hash);
        assert!(one.files.is_empty());
    }

    #[test]
    fn files_too_far_apart_are_refused() {
        let read = |text: &str| read_bytes(text.as_bytes().to_vec(), "a.xyz", &Silent).unwrap();
        let error = Scan::together(vec![read("0 0 0\n"), read("1e16 0 0\n")], &Silent).unwrap_err();
        assert!(
            error.to_string().starts_with("the files together: the points span"),
            "{error}"
        );
        assert!(Scan::together(Vec::new(), &Silent).is_err());
    }
}
