// Shade pass: what is seen at each pixel becomes a color. Colors are gamma-encoded, as displayed.

const MODE_LIT: u32 = 1u;
const MODE_NORMALS: u32 = 2u;
const MODE_COLORS: u32 = 3u;

// The light of lit surfaces comes from above and to the left of the eye, as illustrators set it; in right, up, back.
const LIGHT: vec3<f32> = vec3<f32>(-0.35, 0.5, 0.79);
// What a lit surface shows where no light falls, and how much darker its back is: told apart at once, its shape kept.
const AMBIENT: f32 = 0.3;
const LIT_BACK: f32 = 0.16;

// Stripes on what is selected, so that it can be told without seeing its color: their distance in widths of a line, the
// share of the width that they take, and how much of the selection's color is on them and between.
const STRIPE_STEP: f32 = 7.0;
const STRIPE_SHARE: f32 = 0.4;
const STRIPE_TINT: f32 = 0.7;
const SELECTED_TINT: f32 = 0.35;

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

// Color and opacity of the line between compared and present signs.
const SPLIT_COLOR: vec3<f32> = vec3<f32>(0.5);
const SPLIT_OPACITY: f32 = 0.8;

// Most darkness of creases and of what lies behind an edge.
const CREASE_STRENGTH: f32 = 120.0;
const CREASE_LIMIT: f32 = 0.006;
// Steps between the discs of one surface are no creases: up to so many lengths of a pixel, for each pixel to the center
// of the disc and beyond that.
const ROUGHNESS: f32 = 0.6;
const ROUGHNESS_STEP: f32 = 1.0;

// First and end of each highlighted range, ascending.
@group(1) @binding(0) var<storage, read> highlights: array<vec2<u32>>;
// RGBA8 per instance, when there are colors.
@group(1) @binding(1) var<storage, read> colors: array<u32>;
@group(1) @binding(2) var seen: texture_2d<u32>;
@group(1) @binding(3) var surfaces: texture_2d<u32>;

// The plane of signs that the pixel being shaded shows.
var<private> signs: u32;

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
    return has_flag(signs, instance);
}

fn is_selected(id: u32) -> bool {
    return is_splat(id) && has_flag(FLAG_SELECTED, id - 1u);
}

struct Ray {
    // Relative to the eye.
    origin: vec3<f32>,
    // With a depth of 1.
    direction: vec3<f32>,
}

// The line of sight through the middle of a pixel.
fn ray(pixel: vec2<i32>) -> Ray {
    let from_center = (vec2<f32>(pixel) + 0.5 + frame.origin - 0.5 * frame.whole) * frame.pixel_len;
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
    return look.background * mix(1.0, 0.92, (frame.origin.y + y) / frame.whole.y);
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

// Light on the visible side of a surface.
fn lit(normal: vec3<f32>, cosine: f32) -> f32 {
    let up = cross(frame.back, frame.right);
    let light = frame.right * LIGHT.x + up * LIGHT.y + frame.back * LIGHT.z;
    let toward_eye = select(-normal, normal, cosine >= 0.0);
    return mix(AMBIENT, 1.0, max(dot(toward_eye, light), 0.0));
}

fn splat_color(pixel: vec2<i32>, id: u32, surface: vec2<u32>, depth: f32) -> vec3<f32> {
    let far = (depth - frame.scene_depth.x) / max(frame.scene_depth.y - frame.scene_depth.x, 1e-30);
    let is_known = has_normal(surface.x);
    let headlight = f32((surface.x >> 22u) & 511u) / 511.0;
    if look.mode == MODE_COLORS && look.has_colors != 0u {
        let color = unpack4x8unorm(colors[id - 1u]);
        let light = select(mix(1.0, 0.7, clamp(far, 0.0, 1.0)), mix(0.6, 1.0, headlight), is_known);
        return mix(look.surface, color.rgb, color.a) * light;
    }
    if !is_known {
        return vec3<f32>(mix(0.86, 0.42, clamp(far, 0.0, 1.0)));
    }
    let normal = unpack_normal(surface.x & NORMAL_BITS);
    if look.mode == MODE_NORMALS {
        return select(normal, -normal, is_turned(id - 1u)) * 0.5 + 0.5;
    }
    let front = is_front(pixel, id, surface, depth);
    if look.mode == MODE_LIT || look.mode == MODE_COLORS {
        let cosine = select(1.0, -1.0, (surface.x >> 31u) != 0u);
        return look.surface * lit(normal, cosine) * select(LIT_BACK, 1.0, front);
    }
    return select(look.back, look.front, front) * mix(0.4, 1.0, headlight);
}

// A small ball, `r` radii from its middle, with a light rim that sets it off from what has its color.
fn ball_color(r: f32) -> vec3<f32> {
    let light = mix(0.7, 1.0, sqrt(max(1.0 - r * r, 0.0)));
    return mix(look.wrong * light, vec3<f32>(1.0), 0.8 * smoothstep(0.75, 1.0, r));
}

fn opaque_color(position: vec2<f32>, here: vec2<u32>) -> vec3<f32> {
    let pixel = vec2<i32>(position);
    let surface = textureLoad(surfaces, pixel, 0).xy;
    if !is_splat(here.x) {
        return sphere_color(here.x, surface.x);
    }

    let reach = i32(max(round(frame.line_width), 1.0));
    let last = vec2<i32>(frame.size) - 1;
    let left = textureLoad(seen, vec2<i32>(max(pixel.x - reach, 0), pixel.y), 0).xy;
    let right = textureLoad(seen, vec2<i32>(min(pixel.x + reach, last.x), pixel.y), 0).xy;
    let above = textureLoad(seen, vec2<i32>(pixel.x, max(pixel.y - reach, 0)), 0).xy;
    let below = textureLoad(seen, vec2<i32>(pixel.x, min(pixel.y + reach, last.y)), 0).xy;

    let depth = visual_depth(here.y);
    let from_center = length(vec2<f32>(center_offset(surface)));
    let rough = visual_pixel_len() * (ROUGHNESS * from_center + ROUGHNESS_STEP);
    let dark = crease(depth, rough, left, right) + crease(depth, rough, above, below);
    var color = splat_color(pixel, here.x, surface, depth_of(here.y));
    color *= exp(-CREASE_STRENGTH * look.eye_dome * dark);

    if is_selected(here.x) {
        let stripe = fract((position.x + position.y + frame.origin.x + frame.origin.y) / (STRIPE_STEP * frame.line_width));
        color = mix(color, look.selected, select(SELECTED_TINT, STRIPE_TINT, stripe < STRIPE_SHARE));
        let inside = is_selected(left.x) && is_selected(right.x) && is_selected(above.x) && is_selected(below.x);
        if !inside {
            color = mix(look.selected, vec3<f32>(1.0), 0.75);
        }
    } else {
        color = mix(color, background(position.y), look.dim_unselected);
    }
    // What is wrong is so by the present signs.
    if signs == FLAG_TURNED && has_flag(FLAG_WRONG, here.x - 1u) && from_center <= frame.ball_radius {
        color = ball_color(from_center / frame.ball_radius);
    }
    if look.n_highlights > 0u && is_highlighted(here.x) {
        color = mix(color, look.highlight, 0.55);
        let inside = is_highlighted(left.x) && is_highlighted(right.x) && is_highlighted(above.x) && is_highlighted(below.x);
        if !inside {
            color = mix(look.highlight, vec3<f32>(1.0), 0.45);
        }
    }
    return color;
}

@fragment
fn fragment(@builtin(position) position: vec4<f32>) -> @location(0) vec4<f32> {
    signs = sign_plane(position.x);
    let here = textureLoad(seen, vec2<i32>(position.xy), 0).xy;
    var color = vec4<f32>(background(position.y), 1.0);
    if here.x != ID_NONE {
        color = vec4<f32>(opaque_color(position.xy, here), 1.0);
    } else if look.transparent != 0u {
        color = vec4<f32>(0.0);
    }
    // A quiet line where the signs to compare with end.
    let beyond = frame.origin.x + position.x - look.split;
    let half_width = max(0.5 * frame.line_width, 0.5);
    if beyond >= -half_width && beyond < half_width {
        color = mix(color, vec4<f32>(SPLIT_COLOR, 1.0), SPLIT_OPACITY);
    }
    return color;
}
