@fragment
fn fragment(in: FullScreenPixel) -> @location(0) vec4<f32> {
    if !layer_is_there() {
        return vec4<f32>(0.0);
    }
    let pixel = vec2<i32>(in.position.xy);
    if all(vec2<f32>(textureDimensions(layer)) == vec2<f32>(view.width, view.height)) {
        return textureLoad(layer, pixel, 0);
    }
    return textureSampleLevel(layer, target_sampler, layer_position_of_clip(in.clip), 0.0);
}
