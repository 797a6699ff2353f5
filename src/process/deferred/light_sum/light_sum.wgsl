@group(2) @binding(1) var depth_target: texture_depth_2d;
@group(2) @binding(2) var normal_target: texture_2d<f32>;
@group(2) @binding(3) var diffuse_target: texture_2d<f32>;
@group(2) @binding(4) var tiles_target: texture_2d<u32>;

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
    let tile = tile_of(vec2<u32>(pixel) / 2u, textureDimensions(tiles_target));
    for (var word = 0u; word * BITS * tile.lights_per_bit < view.light_count; word++) {
        let marked = tile.first + vec2<u32>(word % tile.size.x, word / tile.size.x);
        var marks = textureLoad(tiles_target, marked, 0).x;
        while marks != 0u {
            let begin = (word * BITS + firstTrailingBit(marks)) * tile.lights_per_bit;
            marks &= marks - 1u;
            for (var index = begin; index < min(begin + tile.lights_per_bit, view.light_count); index++) {
                let light = lights[index];
                let unobstructed = illuminance_from(light, position, normal);
                if any(unobstructed > vec3<f32>(0.0)) && is_summed(index) {
                    add_light(&batches, unobstructed * light_visibility(light, position, normal));
                }
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

// Whether a light is of a class that is summed. Without a loop: llvmpipe ends all loops of a pixel after 65,535
// iterations in total.
fn is_summed(index: u32) -> bool {
    let ended = ENDED_CLASSES;
    let class_index = ended.x + ended.y + ended.z + ended.w;
    return ((CLASSES >> class_index) & 1u) != 0u;
}
