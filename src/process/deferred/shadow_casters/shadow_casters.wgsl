struct Caster {
    @builtin(position) clip: vec4<f32>,
    // For a paraboloid, the cosine between the camera's direction and the position's; otherwise 1.
    @location(0) forward: f32,
    // Not clamped to the near plane.
    @location(1) depth: f32,
}

@vertex
fn vertex(in: VertexInput) -> Caster {
    let object = drawn_object(in.instance);
    let relative = relative_position(object, deform(in, object).position);
    return Caster(caster_position(relative), forward_of(relative), unclamped_clip_position(relative).z);
}

// Where corners are clamped to the near plane, they are to the far one too: a triangle that crosses both would
// otherwise be clipped by the far plane where it is not. The fragment shader has the depth of each pixel.
fn caster_position(relative: vec3<f32>) -> vec4<f32> {
    var clip = clip_position(relative);
    if CLAMPS_CORNERS && view.projection == ORTHOGRAPHIC_SHADOW {
        clip.z = max(clip.z, 0.0);
    }
    return clip;
}

// Discards pixels behind a paraboloid: a triangle behind it whose corners surround its axis would be rasterized across
// the picture.
@fragment
fn fragment(in: Caster) {
    if in.forward < -RIM_MARGIN {
        discard;
    }
}

// The depth of what is in front of the near plane is that of the plane.
@fragment
fn clamped_fragment(in: Caster) -> @builtin(frag_depth) f32 {
    return clamp(in.depth, 0.0, 1.0);
}

struct MaskedCaster {
    @builtin(position) clip: vec4<f32>,
    @location(0) forward: f32,
    @location(1) depth: f32,
    @location(2) uv: vec2<f32>,
    @location(3) @interpolate(flat) material: u32,
}

@vertex
fn masked_vertex(in: VertexInput) -> MaskedCaster {
    let object = drawn_object(in.instance);
    let deformed = deform(in, object);
    let relative = relative_position(object, deformed.position);
    let depth = unclamped_clip_position(relative).z;
    let clip = caster_position(relative);
    return MaskedCaster(clip, forward_of(relative), depth, bounded_uv(deformed.uv), object.material);
}

@fragment
fn masked_fragment(in: MaskedCaster) {
    if in.forward < -RIM_MARGIN || is_cut_out(materials[in.material], in.uv) {
        discard;
    }
}

@fragment
fn clamped_masked_fragment(in: MaskedCaster) -> @builtin(frag_depth) f32 {
    if is_cut_out(materials[in.material], in.uv) {
        discard;
    }
    return clamp(in.depth, 0.0, 1.0);
}

fn forward_of(relative: vec3<f32>) -> f32 {
    if view.projection == PARABOLOID {
        return dot(view.forward, relative) / max(length(relative), 1e-30);
    }
    return 1.0;
}

// A margin beyond the disc's rim: filtering at the rim reads a few pixels past it.
const RIM_MARGIN: f32 = 0.05;
