//! Every shader passes naga's validation, and its structs lie in memory as their Rust twins do.

use std::mem::{offset_of, size_of};

use egui_wgpu::wgpu::naga;

use crate::DisplayMode;
use crate::gpu_types::{Chunk, Frame, Look, Point, SphereMark};
use crate::shader::{HAIR, SHADE, SPHERE, SPLAT, Shader};

/// All shaders: the tests below go through them.
const SHADERS: [Shader; 4] = [SPLAT, SPHERE, SHADE, HAIR];

/// A struct: its name, its size, its fields with their offsets.
type Layout = (String, usize, Vec<(String, usize)>);

macro_rules! twin {
    ($name:ident: $($field:ident),+) => {
        (
            stringify!($name).to_owned(),
            size_of::<$name>(),
            vec![$((stringify!($field).to_owned(), offset_of!($name, $field))),+],
        )
    };
}

fn twins() -> Vec<Layout> {
    vec![
        twin!(Frame: clip_from_eye, eye, perspective, right, pixel_len, back, max_radius, depth_from_clip,
              scene_depth, size, pivot_depth, sphere_radius, line_width, stride, clip_min, near_depth, clip_max,
              plane_words, section, section_offset, origin, whole, section_half, ball_radius, pad_0, pad_1),
        twin!(Look: front, mode, back, n_highlights, background, transparent, highlight, eye_dome, selected,
              dim_unselected, surface, split, wrong, has_colors, hair, hair_len, hair_every, hair_in_pixels,
              hair_by_side, pad_0),
        twin!(Chunk: first, pad_0, pad_1, pad_2),
        twin!(Point: position, packed),
        twin!(SphereMark: center, selected, color, pad_0),
    ]
}

fn validate(name: &str, source: &str) -> Result<naga::Module, String> {
    let module = naga::front::wgsl::parse_str(source).map_err(|e| e.emit_to_string_with_path(source, name))?;
    let capabilities = naga::valid::Capabilities::empty();
    naga::valid::Validator::new(naga::valid::ValidationFlags::all(), capabilities)
        .validate(&module)
        .map_err(|e| e.emit_to_string_with_path(source, name))?;
    Ok(module)
}

/// The structs of a module that have a twin, in the twins' form.
fn layouts(module: &naga::Module) -> Vec<Layout> {
    let known: Vec<String> = twins().into_iter().map(|twin| twin.0).collect();
    let structs = module.types.iter().filter_map(|(_, ty)| match (&ty.name, &ty.inner) {
        (Some(name), naga::TypeInner::Struct { members, span }) if known.contains(name) => {
            let fields = members
                .iter()
                .map(|m| (m.name.clone().unwrap(), m.offset as usize))
                .collect();
            Some((name.clone(), *span as usize, fields))
        }
        _ => None,
    });
    structs.collect()
}

#[test]
fn shaders_are_valid_and_their_structs_match() {
    let mut seen = Vec::new();
    for Shader { name, source } in SHADERS {
        let module = validate(name, source).unwrap_or_else(|message| panic!("{name}: {message}"));
        for layout in layouts(&module) {
            let expect = twins().into_iter().find(|twin| twin.0 == layout.0).unwrap();
            assert_eq!(layout, expect, "in {name}");
            seen.push(layout.0);
        }
    }
    for (name, ..) in twins() {
        assert!(seen.contains(&name), "{name} is in no shader");
    }
}

/// A new shader must not slip past the tests.
#[test]
fn every_file_of_the_folder_is_tested() {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../../shaders");
    let mut names: Vec<String> = std::fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    names.sort();
    let mut expect: Vec<String> = SHADERS.iter().map(|shader| format!("{}.wgsl", shader.name)).collect();
    expect.extend(["common.wgsl", "points.wgsl"].map(str::to_owned));
    expect.sort();
    assert_eq!(names, expect);
}

#[test]
fn constants_match() {
    use crate::gpu_types as rust;
    let (splat, shade) = (
        validate("splat", SPLAT.source).unwrap(),
        validate("shade", SHADE.source).unwrap(),
    );
    let literal = |module: &naga::Module, name: &str| {
        let (_, constant) = module
            .constants
            .iter()
            .find(|(_, c)| c.name.as_deref() == Some(name))
            .unwrap();
        match module.global_expressions[constant.init] {
            naga::Expression::Literal(naga::Literal::U32(v)) => f64::from(v),
            naga::Expression::Literal(naga::Literal::F32(v)) => f64::from(v),
            ref other => panic!("{name} is {other:?}"),
        }
    };
    let check = |name: &str, expect: f64| assert_eq!(literal(&splat, name), expect, "{name}");
    check("ID_NONE", f64::from(rust::ID_NONE));
    check("ID_SPHERE", f64::from(rust::ID_SPHERE));
    check("OCT_MAX", f64::from(rust::OCT_MAX));
    check("NO_NORMAL", f64::from(rust::NO_NORMAL));
    check("RADIUS_CODE_MAX", f64::from(rust::RADIUS_CODE_MAX));
    check("RADIUS_CODES_PER_OCTAVE", f64::from(rust::RADIUS_CODES_PER_OCTAVE));
    check("FLAG_TURNED", f64::from(rust::Flag::Turned as u32));
    check("FLAG_SELECTED", f64::from(rust::Flag::Selected as u32));
    check("FLAG_HIDDEN", f64::from(rust::Flag::Hidden as u32));
    check("FLAG_COMPARED", f64::from(rust::Flag::Compared as u32));
    check("FLAG_WRONG", f64::from(rust::Flag::Wrong as u32));
    for (name, mode) in [
        ("MODE_LIT", DisplayMode::Lit),
        ("MODE_NORMALS", DisplayMode::Normals),
        ("MODE_COLORS", DisplayMode::Colors),
    ] {
        assert_eq!(literal(&shade, name), f64::from(mode.code()));
    }
}

#[test]
fn validation_can_fail() {
    let broken = SHADE.source.replace("background(position.y)", "background(position)");
    assert_ne!(broken, SHADE.source);
    assert!(validate("broken", &broken).unwrap_err().contains("background"));
}
