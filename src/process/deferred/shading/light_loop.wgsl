// The illuminance of a light on a surface, with its shadow.
fn visible_illuminance_from(light: Light, position: vec3<f32>, normal: vec3<f32>) -> vec3<f32> {
    let unobstructed = illuminance_from(light, position, normal);
    if any(unobstructed > vec3<f32>(0.0)) {
        return unobstructed * light_visibility(light, position, normal);
    }
    return vec3<f32>(0.0);
}

// The illuminance of a surface by all lights that reach the view, with their shadows; not the ambient light's.
fn illuminance_at(position: vec3<f32>, normal: vec3<f32>) -> vec3<f32> {
    var illuminance = vec3<f32>(0.0);
    for (var index = 0u; index < view.light_count; index++) {
        illuminance += visible_illuminance_from(lights[index], position, normal);
    }
    return illuminance;
}
