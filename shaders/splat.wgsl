// Geometry pass of the splats: each is a disc in its tangent plane, drawn as one triangle around it.

// A disc of this radius, in pixels, holds at least one pixel center wherever it lies. Splats are never drawn thinner,
// so surfaces have no holes from far away and no flicker at grazing angles.
const MIN_RADIUS: f32 = 0.71;

struct Chunk {
    first: u32,
    pad_0: u32,
    pad_1: u32,
    pad_2: u32,
}

@group(1) @binding(0) var<uniform> chunk: Chunk;
@group(1) @binding(1) var<storage, read> points: array<Point>;

struct Vertex {
    @builtin(position) position: vec4<f32>,
    @location(0) disc: vec2<f32>,
    @location(1) @interpolate(flat) id: u32,
    @location(2) @interpolate(flat) surface: u32,
}

// The cosine between normal and direction to the eye in 10 bits: sign and magnitude.
fn pack_cosine(cosine: f32) -> u32 {
    return select(0u, 512u, cosine < 0.0) | u32(min(abs(cosine), 1.0) * 511.0 + 0.5);
}

@vertex
fn vertex(@builtin(vertex_index) vertex_index: u32) -> Vertex {
    // The drawn instances are the multiples of the stride, in whichever chunk they are.
    let skipped = (frame.stride - chunk.first % frame.stride) % frame.stride;
    let local = skipped + vertex_index / 3u * frame.stride;
    let point = points[local];

    var out: Vertex;
    out.id = chunk.first + local + 1u;

    let center = point.position - frame.eye;
    let depth = -dot(center, frame.back);
    let is_perspective = frame.perspective > 0.5;
    if is_perspective && depth <= 0.0 {
        out.position = nowhere();
        return out;
    }
    let to_eye = normalize(select(frame.back, -center, is_perspective));

    var normal = to_eye;
    if has_normal(point.packed) {
        normal = unpack_normal(point.packed);
    }
    let cosine = dot(normal, to_eye);
    out.surface = (point.packed & NORMAL_BITS) | (pack_cosine(cosine) << 22u);

    // Axes of the disc's ellipse on the screen: `long` lies across the view, `short` is foreshortened along `across`.
    var long = cross(normal, to_eye);
    if dot(long, long) < 1e-6 {
        long = frame.right - to_eye * dot(frame.right, to_eye);
    }
    long = normalize(long);
    let short = cross(long, normal);
    let across = cross(to_eye, long);

    let radius = unpack_radius(point.packed) * frame.max_radius;
    let least = MIN_RADIUS * frame.pixel_len * select(1.0, depth, is_perspective);
    let seen = dot(short, across);
    let grow = max(least - radius * abs(seen), 0.0) * select(-1.0, 1.0, seen >= 0.0);

    let corner = triangle_corner(vertex_index % 3u);
    let offset = long * (max(radius, least) * corner.x) + (short * radius + across * grow) * corner.y;
    out.position = frame.clip_from_eye * vec4<f32>(center + offset, 1.0);
    out.disc = corner;
    return out;
}

@fragment
fn fragment(in: Vertex) -> Seen {
    if dot(in.disc, in.disc) > 1.0 {
        discard;
    }
    return Seen(vec2<u32>(in.id, bitcast<u32>(in.position.z)), in.surface);
}
