@group(2) @binding(1) var depth_target: texture_depth_2d;
@group(2) @binding(2) var normal_target: texture_2d<f32>;
@group(2) @binding(3) var diffuse_target: texture_2d<f32>;

const PI: f32 = 3.14159265;

@fragment
fn fragment(in: FullScreenPixel) -> @location(0) vec4<f32> {
    let pixel = vec2<i32>(in.position.xy);
    let depth = textureLoad(depth_target, pixel, 0);
    if depth == 0.0 {
        discard;
    }
    let place = relative_of_pixel(in.clip, depth);
    let normal = direction_from_octahedral(textureLoad(normal_target, pixel, 0).xy);
    let diffuse = textureLoad(diffuse_target, pixel, 0).rgb;

    var illuminance = view.ambient * PI;
    for (var index = 0u; index < view.light_count; index++) {
        illuminance += illuminance_from(lights[index], place, normal);
    }
    // Half floats end at 65,504; past that they would be infinite, and infinities turn to NaN further on.
    return vec4<f32>(min(diffuse / PI * illuminance, vec3<f32>(60000.0)), 0.0);
}

fn illuminance_from(light: Light, place: vec3<f32>, normal: vec3<f32>) -> vec3<f32> {
    if light.kind == DIRECTIONAL {
        return light.intensity * max(dot(normal, -light.direction), 0.0);
    }
    let to_light = light.position - place;
    let distance_squared = dot(to_light, to_light);
    if distance_squared == 0.0 || distance_squared >= light.range * light.range {
        return vec3<f32>(0.0);
    }
    let towards = to_light * inverseSqrt(distance_squared);
    let along_axis = dot(-towards, light.direction);
    var shape = 1.0;
    if light.kind == SPOT {
        shape = smoothstep(light.cone_end, light.cone_begin, along_axis);
    } else if light.kind == HEMISPHERICAL {
        shape = max(along_axis, 0.0);
    }
    let share = distance_squared / (light.range * light.range);
    let window = 1.0 - share * share;
    return light.intensity * (shape * max(dot(normal, towards), 0.0) * window * window / distance_squared);
}
