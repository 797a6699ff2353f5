@group(2) @binding(2) var depth_target: texture_depth_2d;

fn looked_up(in: FullScreenPixel) -> vec3<f32> {
    return layer_position(in.clip, textureLoad(depth_target, vec2<i32>(in.position.xy), 0));
}
