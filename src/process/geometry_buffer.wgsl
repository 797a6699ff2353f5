struct Targets {
    @location(0) normal: vec4<f32>,
    @location(1) diffuse: vec4<f32>,
    @location(2) radiance: vec4<f32>,
}

@fragment
fn fragment(in: Surface) -> Targets {
    let material = materials[in.material];
    let normal = octahedral_from_direction(seen_normal(in, material));
    let diffuse = seen_diffuse(in, material).rgb;
    let radiance = material.emission + diffuse * view.ambient;
    return Targets(
        vec4<f32>(select(normal, normal * 0.5 + 0.5, NORMALS_FROM_ZERO_TO_ONE), 0.0, 1.0),
        vec4<f32>(diffuse, 1.0),
        // Past this a half float would be infinite.
        vec4<f32>(min(radiance, vec3<f32>(60000.0)), 1.0),
    );
}
