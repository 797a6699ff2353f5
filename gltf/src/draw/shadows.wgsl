@group(2) @binding(1) var shadow_maps: texture_depth_2d_array;

// The fraction of a light that reaches a surface, from 0 to 1.
fn visibility(light: Light, position: vec3<f32>, outward: vec3<f32>) -> f32 {
    if light.shadow_layer == NO_SHADOW_MAP {
        return 1.0;
    }
    let side = i32(textureDimensions(shadow_maps).x);
    let to_map = vec4<f32>(-light.shadow_orientation.xyz, light.shadow_orientation.w);
    let distance = -rotate(to_map, position - light.position).z;
    let width = 2.0 * light.shadow_half * select(1.0, max(distance, light.shadow_near), light.kind == SPOT) / f32(side);
    // Moved outwards by some pixels of the map, so that surfaces do not shadow themselves.
    let local = rotate(to_map, position + outward * width * 3.0 - light.position);
    var clip = local.xy / light.shadow_half;
    var depth = (light.range + local.z) / (light.range - light.shadow_near);
    if light.kind == SPOT {
        clip /= max(-local.z, light.shadow_near);
        depth = light.shadow_near / max(-local.z, light.shadow_near);
    }
    if any(abs(clip) >= vec2<f32>(1.0)) || depth <= 0.0 {
        return 1.0;
    }
    let center = (clip * vec2<f32>(0.5, -0.5) + 0.5) * f32(side) - 0.5;
    let first = vec2<i32>(floor(center)) - 1;
    let inside = fract(center);
    var lit = 0.0;
    for (var row = 0; row < 4; row++) {
        let weight_of_row = select(select(1.0, inside.y, row == 3), 1.0 - inside.y, row == 0);
        for (var column = 0; column < 4; column++) {
            let weight = weight_of_row * select(select(1.0, inside.x, column == 3), 1.0 - inside.x, column == 0);
            let pixel = clamp(first + vec2<i32>(column, row), vec2<i32>(0), vec2<i32>(side - 1));
            // Depth is reversed: nearer to the light is greater.
            lit += select(0.0, weight, textureLoad(shadow_maps, pixel, light.shadow_layer, 0) <= depth);
        }
    }
    return min(lit / 9.0, 1.0);
}
