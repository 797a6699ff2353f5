struct Caster {
    @builtin(position) clip: vec4<f32>,
    // For a paraboloid, the cosine between the camera's direction and the position's; otherwise 1.
    @location(0) forward: f32,
}

@vertex
fn vertex(in: VertexInput) -> Caster {
    let object = drawn_object(in.instance);
    let relative = relative_position(object, deform(in, object).position);
    var forward = 1.0;
    if view.projection == PARABOLOID {
        forward = dot(view.forward, relative) / max(length(relative), 1e-30);
    }
    return Caster(clip_position(relative), forward);
}

// Discards pixels behind a paraboloid: a triangle behind it whose corners surround its axis would be rasterized across
// the picture.
@fragment
fn fragment(in: Caster) {
    if in.forward < -RIM_MARGIN {
        discard;
    }
}

// A margin beyond the disc's rim: filtering at the rim reads a few pixels past it.
const RIM_MARGIN: f32 = 0.05;
