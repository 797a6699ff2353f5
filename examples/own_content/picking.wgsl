struct Corner {
    @builtin(position) position: vec4<f32>,
    @location(0) @interpolate(flat) object: u32,
}

@vertex
fn vertex(in: VertexInput) -> Corner {
    let object = drawn_object(in.instance);
    return Corner(clip_position(relative_position(object, in.position)), object.index);
}

@fragment
fn fragment(in: Corner) -> @location(0) u32 {
    return in.object;
}
