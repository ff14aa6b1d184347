//! Which points a viewpoint sees, and the sources that many viewpoints agree on (Liu et al. §3.4).
//!
//! No surface is built: the spherical flip of Katz et al. turns visibility into a convex hull.

mod hidden_points;
mod hull;
mod sorted_votes;
mod voting;

pub use hidden_points::{HiddenPoints, visible_points};
pub use sorted_votes::SortedVotes;
pub use voting::{Vote, sources, viewpoints, votes};
