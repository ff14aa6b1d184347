//! Point cloud files in and out, with every attribute kept. The only crate that touches files.
//!
//! A [`Scan`] keeps the file's bytes and where its rows are. Writing copies these bytes and changes nothing but the
//! normals and one comment line, so whatever else a file holds comes out as it went in.
//!
//! Invariants: nothing is allocated that the size of the file does not justify; a file is replaced whole or not at all;
//! results do not depend on the number of threads. Not here: what a normal should be, that is `normend_core`.

mod error;

mod format;

mod value;

mod table;

mod columns;

mod splats;

mod records;

mod ply;

mod las;

mod pcd;

mod obj;

mod xyz;

mod e57;

mod ptx;

mod scan;

mod layers;

mod rewrite;

mod new_file;

mod new_text;

mod output;

mod save;

mod on_disk;

mod write;

mod stations;

mod trajectory;

mod scanner_places;

pub mod recipe;

#[cfg(test)]
mod confidence_tests;

pub use error::{Broken, Place, ReadError, WriteError, io_words};
pub use format::FileFormat;
pub use layers::{LayerTarget, NotAllWritten};
pub use new_file::Loss;
pub use save::{is_same_file, n_other_names};
pub use scan::{Layer, ReadOptions, Scan, read, read_bytes, read_bytes_with, read_with};
pub use scanner_places::{ScannerFiles, ScannerPlaces};
pub use stations::{read_stations, stations_of_bytes};
pub use write::{Positions, WriteOptions, write_bytes, write_points};
pub use xyz::{ColumnsBy, TextColumns};
