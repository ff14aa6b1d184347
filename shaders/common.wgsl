// What all shaders share. Structs have twins of the same name in gpu_types.rs.

const ID_NONE: u32 = 0u;
const ID_SPHERE: u32 = 0x80000000u;
// Planes of bits in flags.
const FLAG_TURNED: u32 = 0u;
const FLAG_SELECTED: u32 = 1u;
const FLAG_HIDDEN: u32 = 2u;
const FLAG_COMPARED: u32 = 3u;
const FLAG_WRONG: u32 = 4u;
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
    clip_min: vec3<f32>,
    near_depth: f32,
    clip_max: vec3<f32>,
    plane_words: u32,
    section: vec3<f32>,
    section_offset: f32,
    origin: vec2<f32>,
    whole: vec2<f32>,
    section_half: f32,
    ball_radius: f32,
    pad_0: u32,
    pad_1: u32,
}

struct Look {
    front: vec3<f32>,
    mode: u32,
    back: vec3<f32>,
    n_highlights: u32,
    background: vec3<f32>,
    transparent: u32,
    highlight: vec3<f32>,
    eye_dome: f32,
    selected: vec3<f32>,
    dim_unselected: f32,
    surface: vec3<f32>,
    split: f32,
    wrong: vec3<f32>,
    has_colors: u32,
    hair: vec3<f32>,
    hair_len: f32,
    hair_every: u32,
    hair_in_pixels: u32,
    hair_by_side: u32,
    pad_0: u32,
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
@group(0) @binding(1) var<storage, read> spheres: array<SphereMark>;
// One bit per instance in each plane.
@group(0) @binding(2) var<storage, read> flags: array<u32>;
@group(0) @binding(3) var<uniform> look: Look;

fn has_flag(plane: u32, instance: u32) -> bool {
    return ((flags[plane * frame.plane_words + instance / 32u] >> (instance % 32u)) & 1u) != 0u;
}

// The plane of the signs that a pixel column of what is drawn at once shows.
fn sign_plane(x: f32) -> u32 {
    return select(FLAG_TURNED, FLAG_COMPARED, frame.origin.x + x < look.split);
}

// Whether a place is cut away: its world position, the same from the eye, its depth.
fn is_clipped(position: vec3<f32>, from_eye: vec3<f32>, depth: f32) -> bool {
    return depth < frame.near_depth
        || any(position < frame.clip_min)
        || any(position > frame.clip_max)
        || abs(dot(from_eye, frame.section) - frame.section_offset) > frame.section_half;
}

// Depth from the bits of the clip-space depth.
fn depth_of(bits: u32) -> f32 {
    let z = bitcast<f32>(bits);
    let a = frame.depth_from_clip;
    return (a.x + a.y * z) / (a.z + a.w * z);
}

// World length of a pixel at a depth.
fn pixel_len_at(depth: f32) -> f32 {
    return frame.pixel_len * select(1.0, depth, frame.perspective > 0.5);
}

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
