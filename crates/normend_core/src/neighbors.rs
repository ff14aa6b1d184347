//! The k nearest points of each point, in one flat array.

use crate::{Cancelled, PointCloud, Progress};

/// The k-neighborhood of every point: `n × k` ids, each row ascending by distance, ties by id, never the point itself.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Neighbors {
    k: usize,
    ids: Vec<u32>,
}

impl Neighbors {
    /// Finds the `k` nearest of each point exactly (fewer, `n - 1`, in a smaller cloud).
    ///
    /// # Errors
    /// [`Cancelled`] when `progress` asks to stop; nothing else.
    pub fn find(cloud: &PointCloud, k: usize, progress: &dyn Progress) -> Result<Self, Cancelled> {
        let _ = (cloud, k, progress);
        unimplemented!()
    }

    /// Length of each row.
    pub fn k(&self) -> usize {
        self.k
    }

    /// The neighbors of `point`, nearest first.
    pub fn of(&self, point: usize) -> &[u32] {
        &self.ids[point * self.k..(point + 1) * self.k]
    }

    /// All rows, one after the other.
    pub fn ids(&self) -> &[u32] {
        &self.ids
    }
}
