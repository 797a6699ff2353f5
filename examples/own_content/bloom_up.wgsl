@group(2) @binding(1) var half_size: texture_2d<f32>;
@group(2) @binding(2) var quarter_size: texture_2d<f32>;

@fragment
fn fragment(in: FullScreenPixel) -> @location(0) vec4<f32> {
    let point = in.clip * vec2<f32>(0.5, -0.5) + 0.5;
    let near = textureSampleLevel(half_size, target_sampler, point, 0.0).rgb;
    let far = textureSampleLevel(quarter_size, target_sampler, point, 0.0).rgb;
    return vec4<f32>(0.3 * near + 0.5 * far, 0.0);
}
