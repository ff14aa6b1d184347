// The points of a chunk, for the passes that go through them. Structs have twins of the same name in gpu_types.rs.

struct Chunk {
    first: u32,
    pad_0: u32,
    pad_1: u32,
    pad_2: u32,
}

struct Point {
    position: vec3<f32>,
    packed: u32,
}

@group(1) @binding(0) var<uniform> chunk: Chunk;
@group(1) @binding(1) var<storage, read> points: array<Point>;

// Index in the chunk of the `number`-th of its instances that are multiples of `step`, in whichever chunk they are.
fn nth_of_chunk(number: u32, step: u32) -> u32 {
    return (step - chunk.first % step) % step + number * step;
}

// Whether an instance at `position` is left out of the picture.
fn is_left_out(instance: u32, position: vec3<f32>, from_eye: vec3<f32>, depth: f32) -> bool {
    return (frame.perspective > 0.5 && depth <= 0.0)
        || has_flag(FLAG_HIDDEN, instance)
        || is_clipped(position, from_eye, depth);
}
