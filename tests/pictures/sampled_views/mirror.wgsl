// The picture of a mirrored camera, which sees left and right swapped.
@group(2) @binding(1) var sampled: texture_2d<f32>;

@vertex
fn vertex(in: VertexInput) -> @invariant @builtin(position) vec4<f32> {
    return clip_position(relative_position(drawn_object(in.instance), in.position));
}

@fragment
fn fragment(@builtin(position) position: vec4<f32>) -> @location(0) vec4<f32> {
    let size = vec2<i32>(textureDimensions(sampled));
    let mirrored = vec2<i32>(size.x - 1 - i32(position.x), i32(position.y));
    return textureLoad(sampled, clamp(mirrored, vec2<i32>(0), size - 1), 0);
}
