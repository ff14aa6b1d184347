//! Consistent orientation of point clouds that can be mended: cloud → neighbors → normals → tree → regions → signs.
//!
//! The method is Liu et al., *Mendable Consistent Orientation of Point Clouds*. Weights of the Riemannian graph do not
//! depend on signs, so the multi-source forest of any sources is a subset of one minimum spanning tree: [`SpanningTree`]
//! is computed once, [`Regions`] are cuts of it, and [`Document`] is the list of sources with its undo history.
//!
//! Point ids are the file's order everywhere; only the tree's own arrays are in preorder.
//!
//! Not here: files ([`normend_io`](../normend_io)), graphics, windows. This crate opens no file and starts no thread of
//! its own besides rayon's.

pub mod progress;

pub mod point_cloud;

mod copies;

pub mod neighbors;

pub mod normals;

pub mod riemannian_graph;

pub mod spanning_tree;

pub mod patches;

pub mod sources;

pub mod visibility;

pub mod orientation;

pub mod regions;

pub mod evidence;

pub mod side_rule;

mod automatic;

pub mod propagation;

pub mod confidence;

pub mod suspects;

pub mod surroundings;

pub mod document;

pub mod metrics;

pub mod live_comparison;

pub mod shapes;

pub use document::{Document, Edit, EditError, EditKind, Mark, StateChange};
pub use live_comparison::LiveComparison;
pub use neighbors::Neighbors;
pub use normals::Estimator;
pub use orientation::{Change, Orientation};
pub use patches::Patches;
pub use point_cloud::{PointCloud, PointCloudError};
pub use progress::{Cancelled, Progress, Silent};
pub use propagation::{Method, Parameters, Preset, Propagation, SourceRule, Stage, Start};
pub use regions::Regions;
pub use riemannian_graph::{EdgeRule, RiemannianGraph};
/// A set of points, by id: compressed, fast to combine.
pub use roaring::RoaringBitmap as PointSet;
pub use side_rule::SideRule;
pub use sources::{Source, Sources};
pub use spanning_tree::SpanningTree;
pub use surroundings::Surroundings;
