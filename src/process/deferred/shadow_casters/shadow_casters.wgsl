struct Caster {
    @builtin(position) clip: vec4<f32>,
    // The cosine between the way that the camera looks and the way to the place, of a paraboloid; 1 for what needs none.
    @location(0) forward: f32,
}

@vertex
fn vertex(in: VertexInput) -> Caster {
    let relative = relative_position(drawn_object(in.instance), in.position);
    var forward = 1.0;
    if view.projection == PARABOLOID {
        forward = dot(view.forward, relative) / max(length(relative), 1e-30);
    }
    return Caster(clip_position(relative), forward);
}

// A triangle behind a paraboloid whose corners lie all around its axis is drawn right across the picture, where it must not be.
@fragment
fn fragment(in: Caster) {
    if in.forward < -RIM_MARGIN {
        discard;
    }
}

// Who filters a map at the disc's rim looks a few pixels past it.
const RIM_MARGIN: f32 = 0.05;
