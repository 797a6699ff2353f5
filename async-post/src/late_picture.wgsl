@group(2) @binding(1) var source: texture_2d<f32>;

@fragment
fn fragment(in: FullScreenPixel) -> @location(0) vec4<f32> {
    let pixel = vec2<i32>(in.position.xy);
    if !layer_is_there() {
        return textureLoad(source, pixel, 0);
    }
    if all(textureDimensions(layer) == textureDimensions(source)) {
        return textureLoad(layer, pixel, 0);
    }
    return textureSampleLevel(layer, target_sampler, layer_position_of_clip(in.clip), 0.0);
}
