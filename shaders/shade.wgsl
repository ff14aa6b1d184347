// Shade pass: what is seen at each pixel becomes a color. Colors are gamma-encoded, as displayed.

const MODE_NORMALS: u32 = 1u;

// Splats are edge-on below this cosine between normal and direction to the eye.
const EDGE_ON: f32 = 0.2;
// Where an edge-on splat looks for the surface beside it, in pixels.
const BESIDE: i32 = 3;
// How far nearer that surface may be, in lengths of a pixel.
const BESIDE_DEPTH: f32 = 64.0;

// A surface hides a splat's center when it is nearer by these, in lengths of a pixel: at least and at most, for each
// pixel between the center and the pixel shaded, and beyond that.
const HIDDEN_LEAST: f32 = 0.5;
const HIDDEN_MOST: f32 = 8.0;
const HIDDEN_STEP: f32 = 1.0;

// Darkness of creases and of what lies behind an edge.
const CREASE_STRENGTH: f32 = 60.0;
const CREASE_LIMIT: f32 = 0.006;
// Steps between the discs of one surface are no creases: up to so many lengths of a pixel, for each pixel to the center
// of the disc and beyond that.
const ROUGHNESS: f32 = 0.6;
const ROUGHNESS_STEP: f32 = 1.0;

struct Look {
    front: vec3<f32>,
    mode: u32,
    back: vec3<f32>,
    n_highlights: u32,
    background: vec3<f32>,
    pad_0: u32,
    highlight: vec3<f32>,
    pad_1: u32,
}

@group(0) @binding(1) var<storage, read> spheres: array<SphereMark>;
@group(1) @binding(0) var<uniform> look: Look;
// One bit per instance: turned or not.
@group(1) @binding(1) var<storage, read> turned: array<u32>;
// First and end of each highlighted range, ascending.
@group(1) @binding(2) var<storage, read> highlights: array<vec2<u32>>;
@group(1) @binding(3) var seen: texture_2d<u32>;
@group(1) @binding(4) var surfaces: texture_2d<u32>;

@vertex
fn vertex(@builtin(vertex_index) index: u32) -> @builtin(position) vec4<f32> {
    let corner = vec2<f32>(f32((index << 1u) & 2u), f32(index & 2u));
    return vec4<f32>(corner * 2.0 - 1.0, 0.0, 1.0);
}

fn is_splat(id: u32) -> bool {
    return id != ID_NONE && (id & ID_SPHERE) == 0u;
}

fn is_highlighted(id: u32) -> bool {
    if !is_splat(id) {
        return false;
    }
    let instance = id - 1u;
    // Binary search for the number of ranges that start at or before the instance.
    var low = 0u;
    var high = look.n_highlights;
    while low < high {
        let middle = (low + high) / 2u;
        if highlights[middle].x <= instance {
            low = middle + 1u;
        } else {
            high = middle;
        }
    }
    return low > 0u && instance < highlights[low - 1u].y;
}

fn is_turned(instance: u32) -> bool {
    return ((turned[instance / 32u] >> (instance % 32u)) & 1u) != 0u;
}

fn depth_of(bits: u32) -> f32 {
    let z = bitcast<f32>(bits);
    let a = frame.depth_from_clip;
    return (a.x + a.y * z) / (a.z + a.w * z);
}

// World length of a pixel at a depth.
fn pixel_len_at(depth: f32) -> f32 {
    return frame.pixel_len * select(1.0, depth, frame.perspective > 0.5);
}

struct Ray {
    // Relative to the eye.
    origin: vec3<f32>,
    // With a depth of 1.
    direction: vec3<f32>,
}

// The line of sight through the middle of a pixel.
fn ray(pixel: vec2<i32>) -> Ray {
    let from_center = (vec2<f32>(pixel) + 0.5 - 0.5 * frame.size) * frame.pixel_len;
    let up = cross(frame.back, frame.right);
    let across = frame.right * from_center.x - up * from_center.y;
    if frame.perspective > 0.5 {
        return Ray(vec3<f32>(0.0), across - frame.back);
    }
    return Ray(across, -frame.back);
}

// Depth on a scale on which equal steps look equally deep.
fn visual_depth(bits: u32) -> f32 {
    let depth = depth_of(bits);
    if frame.perspective > 0.5 {
        return log2(depth);
    }
    return depth / frame.pivot_depth;
}

// Length of a pixel on that scale.
fn visual_pixel_len() -> f32 {
    return frame.pixel_len * select(1.0 / frame.pivot_depth, 1.4426950, frame.perspective > 0.5);
}

// How far a pixel lies behind the line between its two neighbors, beyond `rough`; 0 for planes at any angle.
fn crease(here: f32, rough: f32, a: vec2<u32>, b: vec2<u32>) -> f32 {
    let before = select(here, visual_depth(a.y), a.x != ID_NONE);
    let after = select(here, visual_depth(b.y), b.x != ID_NONE);
    return clamp(2.0 * here - before - after - rough, 0.0, CREASE_LIMIT);
}

fn background(y: f32) -> vec3<f32> {
    return look.background * mix(1.0, 0.92, y / frame.size.y);
}

fn sphere_color(id: u32, surface: u32) -> vec3<f32> {
    let sphere = spheres[id & ~ID_SPHERE];
    let selected = sphere.selected != 0u;
    let r = length(unpack2x16snorm(surface)) * select(1.0, SELECTED_RADIUS, selected);
    if selected && r > 1.0 {
        // Dark, light, dark: visible on any ground.
        let ring = (r - 1.0) / (SELECTED_RADIUS - 1.0);
        return select(vec3<f32>(0.06), vec3<f32>(1.0), ring > 0.3 && ring < 0.8);
    }
    let light = mix(0.62, 1.0, sqrt(max(1.0 - r * r, 0.0)));
    let rim = smoothstep(0.72, 0.86, r);
    return sphere.color * light * mix(1.0, 0.22, rim);
}

// The cosine between oriented normal and direction to the eye: positive on the front.
fn signed_cosine(id: u32, surface: u32) -> f32 {
    let code = surface >> 22u;
    let cosine = f32(code & 511u) / 511.0;
    return select(-cosine, cosine, (code < 512u) != is_turned(id - 1u));
}

fn signed_cosine_beside(pixel: vec2<i32>, depth: f32) -> f32 {
    let at = clamp(pixel, vec2<i32>(0), vec2<i32>(frame.size) - 1);
    let there = textureLoad(seen, at, 0).xy;
    if !is_splat(there.x) {
        return 0.0;
    }
    let nearer = depth - depth_of(there.y);
    let surface = textureLoad(surfaces, at, 0).x;
    if nearer <= 0.0 || nearer > BESIDE_DEPTH * pixel_len_at(depth) || !has_normal(surface) {
        return 0.0;
    }
    return signed_cosine(there.x, surface);
}

// From a pixel of a splat to the pixel of its center.
fn center_offset(surface: vec2<u32>) -> vec2<i32> {
    let packed = bitcast<i32>(surface.y);
    return vec2<i32>((packed << 16u) >> 16u, packed >> 16u);
}

fn is_inside(pixel: vec2<i32>) -> bool {
    return all(pixel >= vec2<i32>(0)) && all(pixel < vec2<i32>(frame.size));
}

// The signed cosine of the surface that hides the center of the splat at `pixel`; 0 when nothing does.
fn side_of_cover(pixel: vec2<i32>, surface: vec2<u32>, depth: f32) -> f32 {
    let offset = center_offset(surface);
    let at = pixel + offset;
    if all(offset == vec2<i32>(0)) || !is_inside(at) {
        return 0.0;
    }
    let there = textureLoad(seen, at, 0).xy;
    let cover = textureLoad(surfaces, at, 0).xy;
    if !is_splat(there.x) || !has_normal(cover.x) {
        return 0.0;
    }
    // The depth of the center is where the ray through it meets the plane of the disc.
    let normal = unpack_normal(surface.x & NORMAL_BITS);
    let here_ray = ray(pixel);
    let center_ray = ray(at);
    let point = here_ray.origin + here_ray.direction * depth;
    let center_depth = dot(normal, point - center_ray.origin) / dot(normal, center_ray.direction);
    let nearer = (center_depth - depth_of(there.y)) / pixel_len_at(center_depth);
    let away = length(vec2<f32>(offset));
    if nearer < HIDDEN_LEAST * away + HIDDEN_STEP || nearer > HIDDEN_MOST * away + HIDDEN_STEP {
        return 0.0;
    }
    // What itself only sticks out from behind hides nothing.
    let center_of_cover = at + center_offset(cover);
    if !is_inside(center_of_cover) || textureLoad(seen, center_of_cover, 0).x != there.x {
        return 0.0;
    }
    return signed_cosine(there.x, cover.x);
}

// Whether the front is seen. Discs reach beyond the edges of a surface, and there those of the far side stick out and
// would line it with the other color. So a splat whose center is hidden takes the side of what hides it, and one that
// is edge-on the side of the surface that curves away from the eye there.
fn is_front(pixel: vec2<i32>, id: u32, surface: vec2<u32>, depth: f32) -> bool {
    let own = signed_cosine(id, surface.x);
    if abs(own) >= EDGE_ON {
        let cover = side_of_cover(pixel, surface, depth);
        return select(own, cover, cover != 0.0) > 0.0;
    }
    let horizontal = signed_cosine_beside(pixel - vec2<i32>(BESIDE, 0), depth)
        + signed_cosine_beside(pixel + vec2<i32>(BESIDE, 0), depth);
    let vertical = signed_cosine_beside(pixel - vec2<i32>(0, BESIDE), depth)
        + signed_cosine_beside(pixel + vec2<i32>(0, BESIDE), depth);
    return own + horizontal + vertical > 0.0;
}

fn splat_color(pixel: vec2<i32>, id: u32, surface: vec2<u32>, depth: f32) -> vec3<f32> {
    if !has_normal(surface.x) {
        let far = (depth - frame.scene_depth.x) / max(frame.scene_depth.y - frame.scene_depth.x, 1e-30);
        return vec3<f32>(mix(0.86, 0.42, clamp(far, 0.0, 1.0)));
    }
    if look.mode == MODE_NORMALS {
        let normal = unpack_normal(surface.x & NORMAL_BITS);
        return select(normal, -normal, is_turned(id - 1u)) * 0.5 + 0.5;
    }
    let headlight = mix(0.4, 1.0, f32((surface.x >> 22u) & 511u) / 511.0);
    return select(look.back, look.front, is_front(pixel, id, surface, depth)) * headlight;
}

@fragment
fn fragment(@builtin(position) position: vec4<f32>) -> @location(0) vec4<f32> {
    let pixel = vec2<i32>(position.xy);
    let here = textureLoad(seen, pixel, 0).xy;
    if here.x == ID_NONE {
        return vec4<f32>(background(position.y), 1.0);
    }
    let surface = textureLoad(surfaces, pixel, 0).xy;
    if !is_splat(here.x) {
        return vec4<f32>(sphere_color(here.x, surface.x), 1.0);
    }

    let reach = i32(max(round(frame.line_width), 1.0));
    let last = vec2<i32>(frame.size) - 1;
    let left = textureLoad(seen, vec2<i32>(max(pixel.x - reach, 0), pixel.y), 0).xy;
    let right = textureLoad(seen, vec2<i32>(min(pixel.x + reach, last.x), pixel.y), 0).xy;
    let above = textureLoad(seen, vec2<i32>(pixel.x, max(pixel.y - reach, 0)), 0).xy;
    let below = textureLoad(seen, vec2<i32>(pixel.x, min(pixel.y + reach, last.y)), 0).xy;

    let depth = visual_depth(here.y);
    let rough = visual_pixel_len() * (ROUGHNESS * length(vec2<f32>(center_offset(surface))) + ROUGHNESS_STEP);
    let dark = crease(depth, rough, left, right) + crease(depth, rough, above, below);
    var color = splat_color(pixel, here.x, surface, depth_of(here.y)) * exp(-CREASE_STRENGTH * dark);

    if look.n_highlights > 0u && is_highlighted(here.x) {
        color = mix(color, look.highlight, 0.55);
        let inside = is_highlighted(left.x) && is_highlighted(right.x) && is_highlighted(above.x) && is_highlighted(below.x);
        if !inside {
            color = mix(look.highlight, vec3<f32>(1.0), 0.45);
        }
    }
    return vec4<f32>(color, 1.0);
}
