@vertex
fn vertex(in: VertexInput) -> @invariant @builtin(position) vec4<f32> {
    return clip_position(relative_position(drawn_object(in.instance), in.position));
}
