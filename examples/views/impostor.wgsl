@group(2) @binding(1) var radiance: texture_2d<f32>;
@group(2) @binding(2) var depth: texture_depth_2d;

struct Corner {
    @invariant @builtin(position) position: vec4<f32>,
    @location(0) uv: vec2<f32>,
}

@vertex
fn vertex(in: VertexInput) -> Corner {
    let relative = relative_position(drawn_object(in.instance), in.position);
    return Corner(clip_position(relative), in.uv);
}

@fragment
fn fragment(in: Corner) -> @location(0) vec4<f32> {
    let size = vec2<f32>(textureDimensions(depth));
    let pixel = min(vec2<i32>(in.uv * size), vec2<i32>(size) - 1);
    // The background is infinitely far away.
    if textureLoad(depth, pixel, 0) <= 0.0 {
        discard;
    }
    return vec4<f32>(textureLoad(radiance, pixel, 0).rgb, 1.0);
}
