@vertex
fn vertex(in: VertexInput) -> @builtin(position) vec4<f32> {
    return clip_position(relative_position(drawn_object(in.instance), in.position));
}

@fragment
fn fragment() -> @location(0) vec4<f32> {
    return vec4<f32>(1.0);
}
