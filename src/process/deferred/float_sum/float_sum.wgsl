@group(2) @binding(1) var sum_target: texture_2d<f32>;

@fragment
fn fragment(in: FullScreenPixel) -> @location(0) vec4<f32> {
    let sum = textureLoad(sum_target, vec2<i32>(in.position.xy), 0);
    if all(sum == vec4<f32>(0.0)) {
        discard;
    }
    // Beyond 65,504 a half float would become infinite, and later NaN.
    return vec4<f32>(clamp(sum.rgb, vec3<f32>(-60000.0), vec3<f32>(60000.0)), sum.a);
}
