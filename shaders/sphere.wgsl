// Geometry pass of the spheres: discs that face the camera, of constant size on the screen.

struct Vertex {
    @builtin(position) position: vec4<f32>,
    @location(0) disc: vec2<f32>,
    @location(1) @interpolate(flat) id: u32,
}

@vertex
fn vertex(@builtin(vertex_index) vertex_index: u32) -> Vertex {
    let index = vertex_index / 3u;
    let sphere = spheres[index];

    var out: Vertex;
    out.id = ID_SPHERE | index;

    let center = sphere.center - frame.eye;
    let depth = -dot(center, frame.back);
    let is_perspective = frame.perspective > 0.5;
    if (is_perspective && depth <= 0.0) || is_clipped(sphere.center, center, depth) {
        out.position = nowhere();
        return out;
    }
    let to_eye = normalize(select(frame.back, -center, is_perspective));

    // The ring of a selected sphere takes room outside of it.
    let radius = frame.sphere_radius * select(1.0, SELECTED_RADIUS, sphere.selected != 0u);
    // Moved toward the eye, so that the surface on which it sits does not hide it unless that is steeper than 63°.
    let lift = 2.0 * radius * pixel_len_at(depth);
    let corner = triangle_corner(vertex_index % 3u);
    var position = frame.clip_from_eye * vec4<f32>(center + to_eye * lift, 1.0);
    position = vec4<f32>(position.xy + corner * radius * 2.0 / frame.size * position.w, position.zw);
    out.position = position;
    out.disc = corner;
    return out;
}

@fragment
fn fragment(in: Vertex) -> Seen {
    if dot(in.disc, in.disc) > 1.0 {
        discard;
    }
    return Seen(vec2<u32>(in.id, bitcast<u32>(in.position.z)), vec2<u32>(pack2x16snorm(in.disc), 0u));
}
