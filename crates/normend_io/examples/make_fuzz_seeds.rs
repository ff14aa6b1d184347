//! Writes the inputs that fuzzing begins with: `cargo run -p normend_io --example make_fuzz_seeds [FOLDER]`, by default
//! `fuzz/seeds`, a folder a target.
//!
//! Small files of every kind that can be read: mutation finds the way from them to the wrong ones.

use std::error::Error;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use glam::Vec3;
use normend_core::document::FlipReason;
use normend_core::{Document, Edit, Parameters, PointSet, Preset, Propagation, Silent, shapes};
use normend_io::recipe::{Event, Head, Recipe};
use normend_io::{Positions, Scan, WriteOptions, read_bytes, write_points};

/// Points of the generated scans.
const N_POINTS: usize = 24;

fn main() -> Result<(), Box<dyn Error>> {
    let bundled = concat!(env!("CARGO_MANIFEST_DIR"), "/../../fuzz/seeds");
    let root = std::env::args_os()
        .nth(1)
        .map_or_else(|| PathBuf::from(bundled), PathBuf::from);
    ply(&root.join("ply"))?;
    text(&root.join("text"))?;
    packed(&root)?;
    sensors(&root.join("sensors"))?;
    recipes(&root.join("recipe"), &root.join("journal"))?;
    settings(&root.join("settings"), &root.join("keymap"))?;
    Ok(())
}

/// Writes a file in a folder that is made where it is missing.
fn put(folder: &Path, name: &str, content: impl AsRef<[u8]>) -> Result<(), Box<dyn Error>> {
    fs::create_dir_all(folder)?;
    fs::write(folder.join(name), content)?;
    Ok(())
}

/// A small torus as every format that Normend writes without one to take it from.
fn written(folder: &Path, name: &str, has_normals: bool) -> Result<(), Box<dyn Error>> {
    fs::create_dir_all(folder)?;
    let torus = shapes::torus(N_POINTS);
    let normals = has_normals.then_some(&torus.normals[..]);
    write_points(&folder.join(name), Positions::Float(&torus.positions), normals, &Silent)?;
    Ok(())
}

fn ply(folder: &Path) -> Result<(), Box<dyn Error>> {
    const XYZ: &str = "property float x\nproperty float y\nproperty float z\n";
    written(folder, "plain.ply", false)?;
    written(folder, "normals.ply", true)?;
    let ascii = |lines: &str, rows: &str| format!("ply\nformat ascii 1.0\ncomment made\n{lines}end_header\n{rows}");
    put(
        folder,
        "ascii.ply",
        ascii(&format!("element vertex 2\n{XYZ}"), "0 0 0\n1 2.5 -3e2\n"),
    )?;
    put(
        folder,
        "ascii_all.ply",
        ascii(
            "obj_info scanner\nelement camera 1\nproperty list uchar float m\nelement vertex 3\nproperty double x\nproperty double y\n\
             property double z\nproperty uchar red\nproperty uchar green\nproperty uchar blue\nproperty float nx\nproperty float ny\n\
             property float nz\nproperty float confidence\nproperty uchar oriented\nelement face 1\n\
             property list uchar int vertex_indices\n",
            "2 1 0\n500000.123 4500000.456 7.5 1 2 3 0 0 1 0.5 1\nnan 0 0 1 2 3 nan 0 0 0 0\n500001 4500000 8 9 9 9 0 1 0 1 1\n\
             3 0 1 2\n",
        ),
    )?;
    let mut lists = b"ply\r\nformat binary_big_endian 1.0\r\nelement vertex 2\r\nproperty float x\r\nproperty list ushort uchar tags\r\n\
        property float y\r\nproperty float z\r\nend_header\r\n"
        .to_vec();
    for row in 0..2_u8 {
        lists.extend_from_slice(&f32::from(row).to_be_bytes());
        lists.extend_from_slice(&u16::from(row).to_be_bytes());
        lists.extend_from_slice(&vec![7; usize::from(row)]);
        lists.extend_from_slice(&[2.0_f32.to_be_bytes(), 3.0_f32.to_be_bytes()].concat());
    }
    put(folder, "lists.ply", lists)?;
    let splat = ["x", "y", "z", "nx", "ny", "nz", "f_dc_0", "opacity", "scale_0", "rot_0"];
    let properties: String = splat.iter().map(|name| format!("property float {name}\n")).collect();
    let mut splats =
        format!("ply\nformat binary_little_endian 1.0\nelement vertex 2\n{properties}end_header\n").into_bytes();
    for value in 0..2 * splat.len() {
        splats.extend_from_slice(&(value as f32).to_le_bytes());
    }
    put(folder, "splats.ply", splats)
}

/// The formats whose files are made from others: a plain one, one with all that a point may have, one with several scans.
fn packed(root: &Path) -> Result<(), Box<dyn Error>> {
    let rich = "x,y,z,intensity,red,green,blue,classification,gps_time,word\n\
        500000.123,4500000.456,7.5,0.25,1,2,3,2,1000.5,a\n500001,4500000.5,8,0.5,255,255,0,6,1000.75,b\n\
        500001.5,4500001.25,8.125,1,0,0,9,6,1001,c\n";
    let rich = read_bytes(rich.into(), "rich.csv", &Silent)?;
    let cell = |x: f32, y: f32| format!("{x} {y} 1 0.5 255 0 10\n");
    let grid = |place: f32| {
        format!(
            "2\n2\n{place} 0 1\n1 0 0\n0 1 0\n0 0 1\n1 0 0 0\n0 1 0 0\n0 0 1 0\n{place} 0 1 1\n{}{}0 0 0 0.5 0 0 0\n{}",
            cell(1.0, 1.0),
            cell(-1.0, 2.0),
            cell(0.5, -2.0)
        )
    };
    let grids = grid(0.0) + &grid(10.5);
    put(&root.join("ptx"), "grids.ptx", &grids)?;
    let grids = read_bytes(grids.into(), "grids.ptx", &Silent)?;
    for extension in ["las", "laz", "pcd", "ptx", "e57", "obj"] {
        let folder = root.join(extension);
        written(&folder, &format!("plain.{extension}"), false)?;
        for (name, scan) in [("rich", &rich), ("grids", &grids)] {
            let path = folder.join(format!("{name}_normals.{extension}"));
            let normals = vec![Vec3::Z; scan.cloud.n_points()];
            scan.write(&normals, &path, &WriteOptions::default(), &Silent)?;
        }
    }
    put(
        &root.join("obj"),
        "faces.obj",
        "# a mesh\nmtllib a.mtl\no part\nv 0 0 0\nv 1 0 0 0.5 0.25 1\nv 0 1 0\nvn 0 0 1\nvn 0 1 0\nvt 0 0\nusemtl a\ns off\n\
         f 1/1/1 2/1/2 3/1/1\nf -3//-2 -2 -1\np 1\nl 1 \\\n2\n",
    )?;
    let pcd = |data: &str, points: &[u8]| {
        let head = format!(
            "# .PCD v0.7\nVERSION 0.7\nFIELDS x y z rgb\nSIZE 4 4 4 4\nTYPE F F F U\nCOUNT 1 1 1 1\nWIDTH 2\nHEIGHT 1\n\
             VIEWPOINT 1 2 3 1 0 0 0\nPOINTS 2\nDATA {data}\n"
        );
        [head.as_bytes(), points].concat()
    };
    put(
        &root.join("pcd"),
        "ascii.pcd",
        pcd("ascii", b"1 2 3 255\nnan 2.5 -3 65280\n"),
    )?;
    // One literal run of all 32 bytes, columns after columns.
    let mut points = [33_u32.to_le_bytes(), 32_u32.to_le_bytes()].concat();
    points.push(31);
    points.extend((0..8).flat_map(|value| (value as f32).to_le_bytes()));
    put(&root.join("pcd"), "packed.pcd", pcd("binary_compressed", &points))?;
    Ok(())
}

fn text(folder: &Path) -> Result<(), Box<dyn Error>> {
    // The target takes the extension from the last byte, so these end in every way.
    for (name, content) in [
        ("plain", "0 0 0\n1 0.5 -2e1\n1 1 1\n"),
        ("normals", "1 2 3 0 0 1\n4 5 6 0 1 0"),
        (
            "names.csv",
            "x,y,z,nx,ny,nz,red\r\n1,2,3,0,0,1,255\r\n4,5,6,1,0,0,0\r\n",
        ),
        ("semicolons.csv", "\"x\";\"y\";\"z\";\"i\"\n1.5;2;3;4\n;;;\n4;5;6;7 "),
        (
            "counted.pts",
            "3\n1 2 3 -100 255 0 0\n4 5 6 100 0 255 0\n7 8 9 1 0 0 255\n",
        ),
        (
            "comments.asc",
            "# a comment\n//X Y Z R\n\n500000.123 4500000.456 3 1\nnan inf 3 1\n500001 4500001 4 2\n\0",
        ),
        ("order.txt", "intensity z x y\n1 2 3 4\n5 6 7 8\n\x02"),
        ("tabs.txt", "1\t2\t3\n4\t5\t6\n\x03"),
    ] {
        put(folder, name, content)?;
    }
    Ok(())
}

fn sensors(folder: &Path) -> Result<(), Box<dyn Error>> {
    put(
        folder,
        "names.tsv",
        "first\tcount\tx\ty\tz\n0\t4\t1\t-2.5\t3e2\n4\t6\t0\t0\t0\n",
    )?;
    put(
        folder,
        "spaces.txt",
        "# two places\r\n\r\n0 4 1 -2.5 3e2 # left\r\n4,6,0,0,0",
    )
}

/// A document that everything was done to, in small.
fn edited(scan: &Scan) -> Result<Document, Box<dyn Error>> {
    let parameters = Preset::Tree.parameters();
    let mut document = Document::new(Arc::clone(&scan.cloud), None).with_parameters(parameters);
    let propagation = Propagation::new(&scan.cloud, None, parameters, &Silent)?;
    document.install(propagation);
    document.apply(Edit::Mend(5))?;
    document.apply(Edit::TurnWhole(9))?;
    document.apply(Edit::FlipPoints {
        points: PointSet::from_iter([1, 2, 3, 20]),
        reason: FlipReason::Asked,
    })?;
    document.apply(Edit::Pin(PointSet::from_iter(0..8)))?;
    document.apply(Edit::Select(PointSet::from_iter([4, 6])))?;
    document.apply(Edit::Hide(PointSet::from_iter(8..20)))?;
    document.apply(Edit::Accept(PointSet::from_iter([0])))?;
    document.apply(Edit::SetParameters(Parameters::default()))?;
    document.apply(Edit::SetViewpoints(Arc::new([Vec3::new(0.5, 9.0, -3.0)])))?;
    Ok(document)
}

fn recipes(recipes: &Path, journals: &Path) -> Result<(), Box<dyn Error>> {
    let mut bytes = Vec::new();
    for position in shapes::torus(N_POINTS).positions {
        bytes.extend_from_slice(format!("{} {} {}\n", position.x, position.y, position.z).as_bytes());
    }
    let scan = read_bytes(bytes, "torus.xyz", &Silent)?;
    let all = Recipe::of_document(scan.identity("torus.xyz"), &edited(&scan)?);
    put(recipes, "all.normend", all.encode()?.1)?;
    for (index, event) in all.events.iter().enumerate() {
        let one = Recipe {
            head: all.head.clone(),
            events: vec![event.clone()],
        };
        put(recipes, &format!("step_{index}.normend"), one.encode()?.1)?;
    }
    let without_steps = Recipe {
        head: Head::new(scan.identity("torus.xyz"), Parameters::default()),
        events: Vec::new(),
    };
    put(recipes, "head.normend", without_steps.encode()?.1)?;
    let mut events = all.events[..2].to_vec();
    events.extend([Event::Undo, Event::Redo, Event::Exported]);
    let journal = Recipe {
        events,
        ..without_steps
    };
    let lines = journal.encode()?.1;
    put(recipes, "journal.normend", &lines)?;
    // The target takes the damage from the first five bytes: a place, a byte, an end.
    for (name, damage) in [
        ("whole", *b"\0\0{\xff\xff"),
        ("cut", *b"\x10\x01x\x80\x03"),
        ("middle", *b"\x60\x02\n\xff\xff"),
    ] {
        put(journals, name, [&damage[..], &lines].concat())?;
    }
    Ok(())
}

fn settings(settings: &Path, keymaps: &Path) -> Result<(), Box<dyn Error>> {
    put(settings, "empty.toml", "version = 2\n")?;
    put(
        settings,
        "first.toml",
        "version = 1\npalette = \"paper\"\nwindow_size = [700.0, 500.0]\nopen_folder = \"/in\"\nexport_folder = \"/out\"\n",
    )?;
    put(
        settings,
        "all.toml",
        "version = 2\ntheme = \"dark\"\npalette = \"green_purple\"\nsplat_scale = 1.5\nui_scale = 1.25\nreduce_motion = true\n\
         side_tab = \"orient\"\nside_width = 300.0\nrecent = [\"/scans/a.ply\"]\nrecent_commands = [\"Undo\"]\nshows_hints = false\n\
         dismissed_hints = [\"point\"]\ntold_crash = \"crash.txt\"\n[display]\nhair_length = 1.0\n[navigation]\nup = \"z\"\n[window]\n\
         size = [1280.0, 800.0]\nposition = [10.0, 20.0]\nmaximized = true\n[folders]\nopen = \"/scans\"\n[keys]\n\
         Undo = [\"Ctrl+Shift+U\"]\nQuit = []\n",
    )?;
    put(
        settings,
        "wrong.toml",
        "version = 2\ntheme = 3\nsplat_scale = inf\n[keys]\nUndo = [\"Ctrl+Nothing\"]\n[window]\nsize = \"large\"\n",
    )?;
    put(
        keymaps,
        "keys",
        "Undo Ctrl+Shift+U\nQuit\nFlip Alt+ArrowUp F5\nRedo Ctrl+R\nNothing A\n",
    )?;
    put(
        keymaps,
        "shared",
        "Undo Ctrl+Z\nRedo Ctrl+Z\nExport Ctrl+Z Ctrl+Z\nOpen +\nSave Plus\n",
    )
}
