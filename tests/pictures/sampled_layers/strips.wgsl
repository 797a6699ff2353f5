@group(2) @binding(1) var layers: texture_2d_array<f32>;

@fragment
fn fragment(in: FullScreenPixel) -> @location(0) vec4<f32> {
    let pixel = vec2<u32>(in.position.xy);
    return textureLoad(layers, pixel, pixel.x / 16u, 0);
}
