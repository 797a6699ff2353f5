@fragment
fn fragment(in: Surface) -> @location(0) vec4<f32> {
    let material = materials[in.material];
    let normal = shading_normal(in, material);
    let diffuse = surface_diffuse(in, material);
    var illuminance = view.ambient * PI;
    var batches = LightBatches();
    for (var index = 0u; index < view.light_count; index++) {
        let light = lights[index];
        let unobstructed = illuminance_from(light, in.relative, normal);
        if any(unobstructed > vec3<f32>(0.0)) {
            let visible = unobstructed * light_visibility(light, in.relative, normal);
            if SUMS {
                add_light(&batches, visible);
            } else {
                illuminance += visible;
            }
        }
    }
    if SUMS {
        illuminance += sum_of_light(batches);
    }
    let radiance = min(material.emission + diffuse.rgb / PI * illuminance, vec3<f32>(60000.0));
    let is_alpha = material.blend == ALPHA;
    // Alpha blending multiplies by the opacity. In a sum alpha is how much is hidden of what is behind: what is added
    // hides nothing.
    return vec4<f32>(select(radiance * diffuse.a, radiance, is_alpha), select(diffuse.a, 0.0, SUMS && !is_alpha));
}
