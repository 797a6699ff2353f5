@fragment
fn fragment(in: Surface) -> @location(0) vec4<f32> {
    let material = materials[in.material];
    let diffuse = surface_diffuse(in, material).rgb;
    let normal = shading_normal(in, material);
    var illuminance = view.ambient * PI;
    for (var index = 0u; index < view.light_count; index++) {
        illuminance += illuminance_from(lights[index], in.relative, normal);
    }
    return vec4<f32>(material.emission + diffuse / PI * illuminance, 1.0);
}
