@group(2) @binding(1) var source: texture_2d<f32>;

// The mean of 16 pixels of the source around a point of the target, each sampled between pixels.
fn blurred(clip: vec2<f32>) -> vec3<f32> {
    let center = clip * vec2<f32>(0.5, -0.5) + 0.5;
    let pixel = 1.0 / vec2<f32>(textureDimensions(source));
    var sum = vec3<f32>(0.0);
    for (var index = 0; index < 16; index++) {
        let offset = vec2<f32>(f32(index % 4), f32(index / 4)) * 2.0 - 3.0;
        sum += bright(textureSampleLevel(source, target_sampler, center + offset * pixel, 0.0).rgb);
    }
    return sum / 16.0;
}

@fragment
fn fragment(in: FullScreenPixel) -> @location(0) vec4<f32> {
    return vec4<f32>(blurred(in.clip), 1.0);
}
