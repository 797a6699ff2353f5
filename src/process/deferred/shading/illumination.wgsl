const PI: f32 = 3.14159265;

// Above the range of f32 light would be infinite, and NaN once it is multiplied by 0.
const MAX_ILLUMINANCE: vec3<f32> = vec3<f32>(1e30);

// The illuminance of a light on a surface, without shadows.
fn illuminance_from(light: Light, position: vec3<f32>, normal: vec3<f32>) -> vec3<f32> {
    if reaches_everything(light.kind) {
        return min(light.intensity * max(dot(normal, -light.direction), 0.0), MAX_ILLUMINANCE);
    }
    let to_light = light.position - position;
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
    let fraction = distance_squared / (light.range * light.range);
    let window = 1.0 - fraction * fraction;
    let factor = shape * max(dot(normal, towards), 0.0) * window * window / distance_squared;
    return min(light.intensity * min(factor, 1e30), MAX_ILLUMINANCE);
}
