@group(2) @binding(1) var depth_target: texture_depth_2d;
@group(2) @binding(2) var normal_target: texture_2d<f32>;
@group(2) @binding(3) var diffuse_target: texture_2d<f32>;

@fragment
fn fragment(in: FullScreenPixel) -> @location(0) vec4<f32> {
    let pixel = vec2<i32>(in.position.xy);
    let depth = textureLoad(depth_target, pixel, 0);
    if depth == 0.0 {
        discard;
    }
    let position = position_from_depth(clip_of_pixel(in.position), depth);
    let normal = decode_normal(textureLoad(normal_target, pixel, 0));

    var batches = LightBatches();
    var end = 0u;
    for (var class_index = 0u; class_index < CLASS_COUNT; class_index++) {
        let begin = end;
        end = view.light_ends[class_index / 4u][class_index % 4u];
        if (CLASSES >> class_index & 1u) == 0u {
            continue;
        }
        for (var index = begin; index < end; index++) {
            let light = lights[index];
            let unobstructed = illuminance_from(light, position, normal);
            if any(unobstructed > vec3<f32>(0.0)) {
                add_light(&batches, unobstructed * light_visibility(light, position, normal));
            }
        }
    }
    let illuminance = sum_of_light(batches);
    if all(illuminance == vec3<f32>(0.0)) {
        discard;
    }
    let diffuse = textureLoad(diffuse_target, pixel, 0).rgb;
    // Above 65,504 a half float would become infinite, and later NaN.
    return vec4<f32>(min(diffuse / PI * illuminance, vec3<f32>(60000.0)), 0.0);
}
