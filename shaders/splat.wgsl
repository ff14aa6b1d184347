// Geometry pass of the splats: each is a disc in its tangent plane, drawn as one triangle around it.

// A disc of this radius, in pixels, holds at least one pixel center wherever it lies. Splats are never drawn thinner,
// so surfaces have no holes from far away and no flicker at grazing angles.
const MIN_RADIUS: f32 = 0.71;

// How far the rim of a disc lies behind its center in the depth test, in radii. So of discs that overlap in one plane, or
// nearly, each shows what is closest to its own center, instead of what rounding makes of equal depths.
const CONE: f32 = 0.1;

// How far a ball lies before its splat in the depth test, in radii of the ball: before the discs beside it, unless the
// surface is steeper than 63°.
const BALL_LIFT: f32 = 2.0;

struct Vertex {
    @builtin(position) position: vec4<f32>,
    @location(0) disc: vec2<f32>,
    @location(1) @interpolate(flat) id: u32,
    @location(2) @interpolate(flat) normal: u32,
    // Pixel of the disc's center.
    @location(3) @interpolate(flat) center: vec2<f32>,
    // How the cone changes the clip-space depth: a quotient (in perspective) and a difference (in parallel views).
    @location(4) @interpolate(flat) cone: vec2<f32>,
    // The same for a ball, the other way; zero without one.
    @location(5) @interpolate(flat) ball: vec2<f32>,
}

struct Fragment {
    @location(0) id_and_depth: vec2<u32>,
    @location(1) surface: vec2<u32>,
    @builtin(frag_depth) depth: f32,
}

// The cosine between normal and direction to the eye in 10 bits: sign and magnitude.
fn pack_cosine(cosine: f32) -> u32 {
    return select(0u, 512u, cosine < 0.0) | u32(min(abs(cosine), 1.0) * 511.0 + 0.5);
}

// How a world length along the line of sight changes the clip-space depth there: see Vertex.
fn depth_change(len: f32, depth: f32) -> vec2<f32> {
    let parallel = vec2<f32>(0.0, len / -frame.depth_from_clip.y);
    return select(parallel, vec2<f32>(len / depth, 0.0), frame.perspective > 0.5);
}

@vertex
fn vertex(@builtin(vertex_index) vertex_index: u32) -> Vertex {
    let local = nth_of_chunk(vertex_index / 3u, frame.stride);
    let point = points[local];
    let instance = chunk.first + local;

    var out: Vertex;
    out.id = instance + 1u;

    let center = point.position - frame.eye;
    let depth = -dot(center, frame.back);
    let is_perspective = frame.perspective > 0.5;
    if is_left_out(instance, point.position, center, depth) {
        out.position = nowhere();
        return out;
    }
    let to_eye = normalize(select(frame.back, -center, is_perspective));

    var normal = to_eye;
    if has_normal(point.packed) {
        normal = unpack_normal(point.packed);
    }
    let cosine = dot(normal, to_eye);
    out.normal = (point.packed & NORMAL_BITS) | (pack_cosine(cosine) << 22u);

    // Axes of the disc's ellipse on the screen: `long` lies across the view, `short` is foreshortened along `across`.
    var long = cross(normal, to_eye);
    if dot(long, long) < 1e-6 {
        long = frame.right - to_eye * dot(frame.right, to_eye);
    }
    long = normalize(long);
    let short = cross(long, normal);
    let across = cross(to_eye, long);

    let radius = unpack_radius(point.packed) * frame.max_radius;
    // A disc with a ball has room for it.
    let pixel_len = pixel_len_at(depth);
    let is_wrong = has_flag(FLAG_WRONG, instance);
    let least = select(MIN_RADIUS, frame.ball_radius + 1.0, is_wrong) * pixel_len;
    let seen = dot(short, across);
    let grow = max(least - radius * abs(seen), 0.0) * select(-1.0, 1.0, seen >= 0.0);

    let corner = triangle_corner(vertex_index % 3u);
    let drawn_radius = max(radius, least);
    let offset = long * (drawn_radius * corner.x) + (short * radius + across * grow) * corner.y;
    out.position = frame.clip_from_eye * vec4<f32>(center + offset, 1.0);
    out.disc = corner;

    let in_clip = frame.clip_from_eye * vec4<f32>(center, 1.0);
    out.center = (vec2<f32>(0.5, -0.5) * in_clip.xy / in_clip.w + 0.5) * frame.size;
    let drop = CONE * drawn_radius;
    out.cone = depth_change(drop, depth);
    out.ball = select(vec2<f32>(0.0), depth_change(BALL_LIFT * frame.ball_radius * pixel_len, depth), is_wrong);
    return out;
}

// A pixel offset in two signed halves.
fn pack_offset(offset: vec2<f32>) -> u32 {
    let whole = vec2<i32>(clamp(offset, vec2<f32>(-32768.0), vec2<f32>(32767.0)));
    return bitcast<u32>((whole.y << 16u) | (whole.x & 0xffff));
}

@fragment
fn fragment(in: Vertex) -> Fragment {
    let r_squared = dot(in.disc, in.disc);
    if r_squared > 1.0 {
        discard;
    }
    var out: Fragment;
    out.id_and_depth = vec2<u32>(in.id, bitcast<u32>(in.position.z));
    let to_center = floor(in.center) - floor(in.position.xy);
    out.surface = vec2<u32>(in.normal, pack_offset(to_center));
    out.depth = in.position.z / (1.0 + in.cone.x * r_squared) - in.cone.y * r_squared;
    // The ball wins the depth test, but what is kept is the depth of the surface: that is what a pick means, and the
    // shading sees no step.
    if any(in.ball > vec2<f32>(0.0)) && length(to_center) <= frame.ball_radius {
        out.depth = in.position.z / max(1.0 - in.ball.x, 0.5) + in.ball.y;
    }
    return out;
}
