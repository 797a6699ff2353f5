@group(2) @binding(0) var<uniform> settings: vec4<f32>;
@group(2) @binding(1) var source: texture_2d<f32>;
@group(2) @binding(2) var layer: texture_2d<f32>;

@fragment
fn fragment(in: FullScreenPixel) -> @location(0) vec4<f32> {
    let color = textureLoad(source, vec2<i32>(in.position.xy), 0);
    let value = textureSampleLevel(layer, target_sampler, in.clip * vec2<f32>(0.5, -0.5) + 0.5, 0.0).rgb;
    return vec4<f32>(color.rgb + settings.w * value, color.a);
}
