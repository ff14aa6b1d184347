//! Writes the bundled sample: `cargo run -p normend_io --example make_sample [FILE]`, by default `assets/sample.ply`.
//!
//! Its normals are those of the spanning tree, which leaves a patch wrong, as a scan that another program has oriented.

use std::error::Error;
use std::path::PathBuf;

use normend_core::{Preset, Propagation, Silent, shapes};
use normend_io::{Positions, read, write_points};

fn main() -> Result<(), Box<dyn Error>> {
    let bundled = concat!(env!("CARGO_MANIFEST_DIR"), "/../../assets/sample.ply");
    let path = std::env::args_os()
        .nth(1)
        .map_or_else(|| PathBuf::from(bundled), PathBuf::from);
    let part = shapes::sample_part();
    let positions = Positions::Float(&part.positions);
    write_points(&path, positions, None, &Silent)?;
    let cloud = read(&path, &Silent)?.cloud;
    let propagation = Propagation::new(&cloud, None, Preset::Tree.parameters(), &Silent)?;
    write_points(&path, positions, Some(&propagation.initial_normals()), &Silent)?;
    println!("{} points in {}", part.positions.len(), path.display());
    Ok(())
}
