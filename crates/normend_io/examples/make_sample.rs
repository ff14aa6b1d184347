//! Writes the bundled sample: `cargo run -p normend_io --example make_sample [FILE]`, by default `assets/sample.ply`.

use std::error::Error;
use std::path::PathBuf;

use normend_core::{Silent, shapes};
use normend_io::{Positions, write_points};

fn main() -> Result<(), Box<dyn Error>> {
    let bundled = concat!(env!("CARGO_MANIFEST_DIR"), "/../../assets/sample.ply");
    let path = std::env::args_os()
        .nth(1)
        .map_or_else(|| PathBuf::from(bundled), PathBuf::from);
    let part = shapes::sample_part();
    write_points(&path, Positions::Float(&part.positions), None, &Silent)?;
    println!("{} points in {}", part.positions.len(), path.display());
    Ok(())
}
