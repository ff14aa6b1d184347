// Hair: the normal of a point as a line from its splat, drawn over the finished picture and hidden by nearer surfaces.

// A hair starts so many pixels before its splat, so that the discs beside it do not swallow its root.
const LIFT: f32 = 2.0;
// Width in widths of a line.
const WIDTH: f32 = 1.5;
// Part of the color at the root of a hair: the surface below has the same color.
const ROOT: f32 = 0.3;

// A point is hidden, and has no hair, when something is seen at its pixel that is nearer by more than these: so many
// lengths of a pixel, and so many radii of its own disc, because those beside it overlap it.
const HIDDEN_PIXELS: f32 = 3.0;
const HIDDEN_RADII: f32 = 1.5;

@group(2) @binding(0) var seen: texture_2d<u32>;

struct Vertex {
    @builtin(position) position: vec4<f32>,
    @location(0) color: vec3<f32>,
}

@vertex
fn vertex(@builtin(vertex_index) vertex_index: u32) -> Vertex {
    let local = nth_of_chunk(vertex_index / 6u, frame.stride * look.hair_every);
    let point = points[local];
    let instance = chunk.first + local;

    var out: Vertex;
    let center = point.position - frame.eye;
    let depth = -dot(center, frame.back);
    if !has_normal(point.packed) || is_left_out(instance, point.position, center, depth) {
        out.position = nowhere();
        return out;
    }
    let is_perspective = frame.perspective > 0.5;
    let to_eye = normalize(select(frame.back, -center, is_perspective));
    let pixel_len = pixel_len_at(depth);
    let center_in_clip = frame.clip_from_eye * vec4<f32>(center, 1.0);
    let pixel = (vec2<f32>(0.5, -0.5) * center_in_clip.xy / center_in_clip.w + 0.5) * frame.size;
    if all(pixel >= vec2<f32>(0.0)) && all(pixel < frame.size) {
        let there = textureLoad(seen, vec2<i32>(pixel), 0).xy;
        let radius = unpack_radius(point.packed) * frame.max_radius;
        let nearer = depth - depth_of(there.y);
        if there.x != ID_NONE && nearer > HIDDEN_PIXELS * pixel_len + HIDDEN_RADII * radius {
            out.position = nowhere();
            return out;
        }
    }
    var normal = unpack_normal(point.packed);
    if has_flag(sign_plane(pixel.x), instance) {
        normal = -normal;
    }
    let is_front = dot(normal, to_eye) > 0.0;
    // What points away from the eye stays behind its surface.
    let lift = select(0.0, LIFT * pixel_len, is_front);
    let root = frame.clip_from_eye * vec4<f32>(center + to_eye * lift, 1.0);
    let len = look.hair_len * select(1.0, pixel_len, look.hair_in_pixels != 0u);
    let tip = frame.clip_from_eye * vec4<f32>(center + normal * len, 1.0);
    if root.w <= 0.0 || tip.w <= 0.0 {
        out.position = nowhere();
        return out;
    }

    // Two triangles: root left, root right, tip left; tip left, root right, tip right.
    let corner = vertex_index % 6u;
    let at_tip = corner == 2u || corner == 3u || corner == 5u;
    let on_right = corner == 1u || corner == 4u || corner == 5u;
    let along = (tip.xy / tip.w - root.xy / root.w) * frame.size;
    let direction = select(vec2<f32>(1.0, 0.0), along / length(along), dot(along, along) > 1e-6);
    let side = select(-WIDTH, WIDTH, on_right) * frame.line_width;
    let sideways = vec2<f32>(-direction.y, direction.x) * side / frame.size;
    let end = select(root, tip, at_tip);
    out.position = vec4<f32>(end.xy + sideways * end.w, end.zw);

    let by_side = select(look.back, look.front, is_front) * select(ROOT, 1.0, at_tip);
    out.color = select(look.hair, by_side, look.hair_by_side != 0u);
    return out;
}

@fragment
fn fragment(in: Vertex) -> @location(0) vec4<f32> {
    return vec4<f32>(in.color, 1.0);
}
