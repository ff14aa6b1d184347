//! What is known of the side that each normal should point to, and how sure that is.
//!
//! An [`Evidence`] has a vote for each point: its normal points to the side that was seen, or away from it. Votes come from
//! views from outside ([`outside_views`]), from counting the sheets that lines cross ([`crossings`]), from the places of the
//! scanner ([`scanner`]) or from normals that came with the file ([`given`]). All are of one kind, so that they add up and
//! whoever weighs them need not know where they are from.
//!
//! Invariant: votes are whole numbers of 1/[`UNIT`], so no sum of them depends on the order of points or threads.

mod crossings;
mod depth_buffer;
mod frame;
mod given;
mod inside_places;
mod inside_views;
mod outside_views;
mod scanner;
mod scene;
mod station_search;
mod tallies;
mod track;

use fixedbitset::FixedBitSet;
use glam::{DVec3, Vec3};
use rayon::prelude::*;

pub use crossings::{crossing_axes, crossings};
pub use given::given;
pub use inside_places::inside_places;
pub use inside_views::inside_views;
pub use outside_views::{N_VIEWS, outside_views};
pub use scanner::{Station, scanner};
pub use station_search::{FoundStation, find_station};
pub use tallies::{Tally, tallies};
pub use track::Track;

use crate::copies::Members;

/// A vote of one: what a single look at a point from straight above weighs. 1/4096 is finer than any weight is known, and
/// the sum over the points of the largest cloud stays within `i64`.
pub const UNIT: i32 = 4096;

/// What is known of a cloud besides its positions.
#[derive(Clone, Copy, Debug, Default)]
pub struct Known<'a> {
    /// The file's normals by point, of any length, zero or NaN where a point has none.
    pub given: Option<&'a [Vec3]>,
    /// Where the scanner stood.
    pub stations: &'a [Station],
    /// Where the scanner was while it moved.
    pub track: Option<&'a Track>,
    /// Viewpoints that vote for sources instead of the usual ones, in the cloud's own space; empty for the usual ones.
    pub viewpoints: &'a [Vec3],
}

impl Known<'_> {
    /// Whether a place of the scanner is known.
    pub fn has_scanner(&self) -> bool {
        !self.stations.is_empty() || self.track.is_some()
    }

    /// Places to look at the cloud from, in the file's coordinates: all of a scanner that stood, and 64 along the way of one
    /// that moved.
    pub fn places(&self) -> Vec<DVec3> {
        let corners = self.track.map_or(&[][..], Track::corners);
        let step = corners.len().div_ceil(TRACK_PLACES).max(1);
        let stood = self.stations.iter().map(|station| station.position);
        stood.chain(corners.iter().copied().step_by(step)).collect()
    }
}

/// Most places along a way that a cloud is looked at from: as many as [`inside_places`] finds in a building of many rooms.
const TRACK_PLACES: usize = 64;

impl<'a> From<Option<&'a [Vec3]>> for Known<'a> {
    fn from(given: Option<&'a [Vec3]>) -> Self {
        Self {
            given,
            ..Self::default()
        }
    }
}

/// Why a point's side is known.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Origin {
    /// Seen from outside of the cloud, where nothing of the cloud is in front of it.
    OutsideViews,
    /// Seen from places within the cloud, as rooms are.
    InsideViews,
    /// Measured by a scanner whose place is known.
    Scanner,
    /// Between an odd and an even number of sheets along lines through the cloud.
    Crossings,
    /// A normal that came with the file.
    Given,
}

impl Origin {
    /// All origins, in the order of lists.
    pub const ALL: [Self; 5] = [
        Self::OutsideViews,
        Self::InsideViews,
        Self::Scanner,
        Self::Crossings,
        Self::Given,
    ];

    /// The name in reports.
    pub fn name(self) -> &'static str {
        match self {
            Self::OutsideViews => "outside-views",
            Self::InsideViews => "inside-views",
            Self::Scanner => "scanner",
            Self::Crossings => "crossings",
            Self::Given => "given",
        }
    }
}

/// What is known of the side of one point's normal, in units of 1/[`UNIT`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Vote {
    /// Weight of the looks at the side that the stored normal points to, minus that of the looks at the other side.
    pub signed: i32,
    /// Weight of all looks, at least `|signed|`. Much weight and a small difference mean a sheet that is seen from both sides.
    pub weight: i32,
}

impl Vote {
    /// Adds one look, or several that agree: positive for the side that the stored normal points to.
    fn cast(&mut self, signed: i32) {
        self.signed += signed;
        self.weight += signed.abs();
    }

    /// How much of a full look the point got: `min(weight, 1)`, in 0..=1.
    pub fn visible(self) -> f32 {
        self.weight.min(UNIT) as f32 / UNIT as f32
    }

    /// How far the looks agree that the stored normal points to the seen side: `signed / max(weight, 1)`, in −1..=1.
    pub fn pull(self) -> f32 {
        self.signed as f32 / self.weight.max(UNIT) as f32
    }

    /// [`Self::pull`] as a whole number of 1/[`UNIT`], for sums.
    pub fn pull_in_units(self) -> i32 {
        // At most UNIT, as the weight is at least as large as the signed sum.
        (i64::from(self.signed) * i64::from(UNIT) / i64::from(self.weight.max(UNIT))) as i32
    }
}

/// A vote for each point, and where the votes come from.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Evidence {
    votes: Vec<Vote>,
    origins: Vec<Origin>,
}

impl Evidence {
    /// No evidence for any of `n_points`.
    pub fn none(n_points: usize) -> Self {
        Self {
            votes: vec![Vote::default(); n_points],
            origins: Vec::new(),
        }
    }

    /// Takes `n` votes by point that come from `origin`.
    pub fn new(origin: Origin, votes: Vec<Vote>) -> Self {
        Self {
            votes,
            origins: vec![origin],
        }
    }

    /// `n` votes by point.
    pub fn votes(&self) -> &[Vote] {
        &self.votes
    }

    /// The share of points that have as much as a third of a look, in 0..=1.
    pub fn share_known(&self) -> f64 {
        let n_known = self.votes.par_iter().filter(|vote| vote.weight >= UNIT / 3).count();
        n_known as f64 / self.votes.len().max(1) as f64
    }

    /// The share of points that have any vote, in 0..=1.
    pub fn share_cast(&self) -> f64 {
        let n_cast = self.votes.par_iter().filter(|vote| vote.weight > 0).count();
        n_cast as f64 / self.votes.len().max(1) as f64
    }

    /// Where the votes come from, ascending.
    pub fn origins(&self) -> &[Origin] {
        &self.origins
    }

    /// Makes the votes those for normals of which some are turned, by point.
    pub(crate) fn turn(&mut self, turned: &FixedBitSet) {
        for point in turned.ones() {
            self.votes[point].signed = -self.votes[point].signed;
        }
    }

    /// The votes by point of those by place.
    pub(crate) fn with_copies(&self, places: &Members) -> Self {
        Self {
            votes: places.by_point(&self.votes),
            origins: self.origins.clone(),
        }
    }

    /// Adds the votes of `other`, about the same `n` normals.
    pub fn add(&mut self, other: &Self) {
        for (vote, other) in self.votes.iter_mut().zip(&other.votes) {
            vote.signed = vote.signed.saturating_add(other.signed);
            vote.weight = vote.weight.saturating_add(other.weight);
        }
        self.origins.extend(&other.origins);
        self.origins.sort_unstable();
        self.origins.dedup();
    }
}
