fn looked_up(in: FullScreenPixel) -> vec3<f32> {
    return vec3<f32>(layer_position_of_clip(in.clip), 1.0);
}
