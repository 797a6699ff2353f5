struct Caster {
    @builtin(position) clip: vec4<f32>,
    // For a paraboloid, the cosine between the camera's direction and the position's; otherwise 1.
    @location(0) forward: f32,
}

@vertex
fn vertex(in: VertexInput) -> Caster {
    let object = drawn_object(in.instance);
    let relative = relative_position(object, deform(in, object).position);
    return Caster(clip_position(relative), forward_of(relative));
}

// Discards pixels behind a paraboloid: a triangle behind it whose corners surround its axis would be rasterized across
// the picture.
@fragment
fn fragment(in: Caster) {
    if in.forward < -RIM_MARGIN {
        discard;
    }
}

struct MaskedCaster {
    @builtin(position) clip: vec4<f32>,
    @location(0) forward: f32,
    @location(1) uv: vec2<f32>,
    @location(2) @interpolate(flat) material: u32,
}

@vertex
fn masked_vertex(in: VertexInput) -> MaskedCaster {
    let object = drawn_object(in.instance);
    let deformed = deform(in, object);
    let relative = relative_position(object, deformed.position);
    return MaskedCaster(clip_position(relative), forward_of(relative), bounded_uv(deformed.uv), object.material);
}

@fragment
fn masked_fragment(in: MaskedCaster) {
    if in.forward < -RIM_MARGIN || is_cut_out(materials[in.material], in.uv) {
        discard;
    }
}

fn forward_of(relative: vec3<f32>) -> f32 {
    if view.projection == PARABOLOID {
        return dot(view.forward, relative) / max(length(relative), 1e-30);
    }
    return 1.0;
}

// A margin beyond the disc's rim: filtering at the rim reads a few pixels past it.
const RIM_MARGIN: f32 = 0.05;
