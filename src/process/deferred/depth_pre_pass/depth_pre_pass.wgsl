@vertex
fn vertex(in: VertexInput) -> @invariant @builtin(position) vec4<f32> {
    let object = drawn_object(in.instance);
    return clip_position(relative_position(object, deform(in, object).position));
}
