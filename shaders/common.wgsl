// What all shaders share. Structs have twins of the same name in gpu_types.rs.

const ID_NONE: u32 = 0u;
const ID_SPHERE: u32 = 0x80000000u;
const OCT_MAX: f32 = 2046.0;
const NO_NORMAL: u32 = 2047u;
const NORMAL_BITS: u32 = 0x3fffffu;
const RADIUS_CODE_MAX: f32 = 1023.0;
const RADIUS_CODES_PER_OCTAVE: f32 = 64.0;
// Outer radius of the ring of a selected sphere, in radii of the sphere.
const SELECTED_RADIUS: f32 = 1.7;

struct Frame {
    clip_from_eye: mat4x4<f32>,
    eye: vec3<f32>,
    perspective: f32,
    right: vec3<f32>,
    pixel_len: f32,
    back: vec3<f32>,
    max_radius: f32,
    depth_from_clip: vec4<f32>,
    scene_depth: vec2<f32>,
    size: vec2<f32>,
    pivot_depth: f32,
    sphere_radius: f32,
    line_width: f32,
    stride: u32,
}

struct Point {
    position: vec3<f32>,
    packed: u32,
}

struct SphereMark {
    center: vec3<f32>,
    selected: u32,
    color: vec3<f32>,
    pad_0: u32,
}

// What the geometry passes leave at each pixel: who is there, how deep, and how it is turned.
struct Seen {
    // Id, and the bits of the clip-space depth.
    @location(0) id_and_depth: vec2<u32>,
    // Splats: packed normal with its cosine to the eye, and where their center is. Spheres: the place on their disc.
    @location(1) surface: vec2<u32>,
}

@group(0) @binding(0) var<uniform> frame: Frame;

fn has_normal(packed: u32) -> bool {
    return (packed & NO_NORMAL) != NO_NORMAL;
}

// Unit normal from the octahedral map (Cigolle et al. 2014).
fn unpack_normal(packed: u32) -> vec3<f32> {
    let code = vec2<f32>(f32(packed & 0x7ffu), f32((packed >> 11u) & 0x7ffu));
    let square = code / OCT_MAX * 2.0 - 1.0;
    let z = 1.0 - abs(square.x) - abs(square.y);
    let fold = max(-z, 0.0);
    let xy = square - select(vec2<f32>(-fold), vec2<f32>(fold), square >= vec2<f32>(0.0));
    return normalize(vec3<f32>(xy, z));
}

// World radius before the frame's scale.
fn unpack_radius(packed: u32) -> f32 {
    let code = f32(packed >> 22u);
    return exp2((code - RADIUS_CODE_MAX) / RADIUS_CODES_PER_OCTAVE);
}

// Corner of a triangle around the unit circle.
fn triangle_corner(index: u32) -> vec2<f32> {
    let root = 1.7320508;
    if index == 0u {
        return vec2<f32>(0.0, 2.0);
    }
    return vec2<f32>(select(root, -root, index == 1u), -1.0);
}

// A vertex that the clipper drops.
fn nowhere() -> vec4<f32> {
    return vec4<f32>(0.0, 0.0, -1.0, 1.0);
}
