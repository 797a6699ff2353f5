@group(2) @binding(1) var own: texture_2d<f32>;
@group(2) @binding(2) var mirror: texture_2d<f32>;

fn held(history: texture_2d<f32>, pixel: vec2<u32>, wanted: u32) -> f32 {
    let level = min(wanted, textureNumLevels(history) - 1u);
    return textureLoad(history, min(pixel, textureDimensions(history, level) - 1u), level).r;
}

@fragment
fn fragment(in: FullScreenPixel) -> @location(0) vec4<f32> {
    let pixel = vec2<u32>(in.position.xy);
    let pattern = f32((pixel.x * 7u + pixel.y * 13u + u32(view.width)) % 32u) / 32.0;
    return vec4<f32>(pattern + (held(own, pixel, 1u) + held(mirror, pixel, 2u)) * 0.25, 0.0, 0.0, 1.0);
}
