//! The regions of the spanning tree that each source orients: MMST as cuts of one tree.

/// See the module.
#[derive(Clone, Debug)]
pub struct Regions {}
