// The illuminance of a surface by all lights that reach the view, with their shadows; not the ambient light's.
fn illuminance_at(position: vec3<f32>, normal: vec3<f32>) -> vec3<f32> {
    var illuminance = vec3<f32>(0.0);
    for (var index = 0u; index < view.light_count; index++) {
        let light = lights[index];
        let unobstructed = illuminance_from(light, position, normal);
        if any(unobstructed > vec3<f32>(0.0)) {
            illuminance += unobstructed * light_visibility(light, position, normal);
        }
    }
    return illuminance;
}
