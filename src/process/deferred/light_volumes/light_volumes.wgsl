@group(2) @binding(1) var depth_target: texture_depth_2d;
@group(2) @binding(2) var normal_target: texture_2d<f32>;
@group(2) @binding(3) var diffuse_target: texture_2d<f32>;

@fragment
fn fragment(in: LightPixel) -> @location(0) vec4<f32> {
    let pixel = vec2<i32>(in.position.xy);
    let position = position_from_depth(clip_of_pixel(in.position), textureLoad(depth_target, pixel, 0));
    let normal = decode_normal(textureLoad(normal_target, pixel, 0));
    let light = lights[in.light];

    var illuminance = illuminance_from(light, position, normal);
    if all(illuminance == vec3<f32>(0.0)) {
        discard;
    }
    illuminance *= light_visibility(light, position, normal);
    let diffuse = textureLoad(diffuse_target, pixel, 0).rgb;
    // Above 65,504 a half float would become infinite, and later NaN.
    return vec4<f32>(min(diffuse / PI * illuminance, vec3<f32>(60000.0)), 0.0);
}
