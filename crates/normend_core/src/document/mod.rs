//! The document: cloud, parameters, sources, and their history. [`Document::apply`] is the only way to change it.

use std::sync::Arc;

use glam::Vec3;

use crate::{Change, Orientation, Parameters, PointCloud, Propagation, Source, Sources};

/// A change of the sources. Small, replayable, its own inverse known when applied.
#[derive(Clone, Debug, PartialEq)]
pub enum Edit {
    /// The click: what the user sees at this point is wrong. The point becomes a source of the opposite sign.
    Mend(u32),
    /// Sources are added, or take the place of those at the same points.
    AddSources(Vec<Source>),
    /// The sources at these points go.
    RemoveSources(Vec<u32>),
    /// The sources at these points change to the opposite direction.
    FlipSources(Vec<u32>),
}

impl Edit {
    /// In words for menus and the history: "Mend", "Remove source".
    pub fn label(&self) -> &'static str {
        unimplemented!()
    }
}

/// Why an edit cannot be applied; the document is as it was.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum EditError {
    /// Nothing is propagated yet.
    #[error("the orientation is not computed yet")]
    NotReady,
    /// A point id past the end of the cloud.
    #[error("point {point} does not exist: the cloud has {n_points} points")]
    NoSuchPoint {
        /// The id.
        point: u32,
        /// Number of points.
        n_points: usize,
    },
    /// No source at this point.
    #[error("point {point} is not a source")]
    NotASource {
        /// The id.
        point: u32,
    },
}

/// A cloud with its sources, and everything derived from them.
pub struct Document {
    cloud: Arc<PointCloud>,
}

impl Document {
    /// Bytes that the history may take by default: 256 MiB.
    pub const HISTORY_BYTES: usize = 256 << 20;

    /// A document without orientation yet. `given` are the file's normals by point.
    pub fn new(cloud: Arc<PointCloud>, given: Option<Arc<Vec<Vec3>>>) -> Self {
        let _ = given;
        Self { cloud }
    }

    /// The points.
    pub fn cloud(&self) -> &Arc<PointCloud> {
        &self.cloud
    }

    /// The file's normals by point, if it has any.
    pub fn given_normals(&self) -> Option<&Arc<Vec<Vec3>>> {
        unimplemented!()
    }

    /// Takes a finished propagation in place of the present one; the sources stay and are applied to it.
    pub fn install(&mut self, propagation: Propagation) {
        let _ = propagation;
        unimplemented!()
    }

    /// The propagation in force.
    pub fn propagation(&self) -> Option<&Propagation> {
        unimplemented!()
    }

    /// The parameters in force (the default ones before the first [`Self::install`]).
    pub fn parameters(&self) -> Parameters {
        unimplemented!()
    }

    /// The sources, by point.
    pub fn sources(&self) -> &Sources {
        unimplemented!()
    }

    /// Applies an edit, remembers its inverse, forgets what was undone.
    ///
    /// # Errors
    /// [`EditError`]; the document is unchanged then.
    pub fn apply(&mut self, edit: Edit) -> Result<Change, EditError> {
        let _ = edit;
        unimplemented!()
    }

    /// What `Edit::Mend(point)` would turn, without changing anything.
    ///
    /// # Errors
    /// [`EditError`] as [`Self::apply`].
    pub fn preview_mend(&self, point: u32) -> Result<Change, EditError> {
        let _ = point;
        unimplemented!()
    }

    /// Takes the last edit back; `None` when there is none.
    pub fn undo(&mut self) -> Option<Change> {
        unimplemented!()
    }

    /// Applies the last undone edit again; `None` when there is none.
    pub fn redo(&mut self) -> Option<Change> {
        unimplemented!()
    }

    /// The edit that [`Self::undo`] would take back.
    pub fn next_undo(&self) -> Option<&Edit> {
        unimplemented!()
    }

    /// The edit that [`Self::redo`] would apply.
    pub fn next_redo(&self) -> Option<&Edit> {
        unimplemented!()
    }

    /// A number that names the state of the sources: equal numbers, equal sources. Undo returns to the number of
    /// before; so "unsaved" is `revision() != revision_at_last_export`.
    pub fn revision(&self) -> u64 {
        unimplemented!()
    }

    /// The signs, by preorder position; `None` before the first [`Self::install`].
    pub fn orientation(&self) -> Option<&Orientation> {
        unimplemented!()
    }

    /// The oriented normal of one point.
    pub fn oriented_normal(&self, point: u32) -> Option<Vec3> {
        let _ = point;
        unimplemented!()
    }

    /// `n` oriented unit normals by point: O(n), in parallel; for export.
    pub fn oriented_normals(&self) -> Option<Vec<Vec3>> {
        unimplemented!()
    }
}
