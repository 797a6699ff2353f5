struct Targets {
    @location(0) normal: vec4<f32>,
    @location(1) diffuse: vec4<f32>,
    @location(2) radiance: vec4<f32>,
}

@fragment
fn fragment(in: Surface) -> Targets {
    let material = materials[in.material];
    let normal = shading_normal(in, material);
    let diffuse = surface_diffuse(in, material).rgb;
    let radiance = material.emission + diffuse * view.ambient;
    return Targets(
        encode_normal(normal),
        // Past this a half float would be infinite, and not a number where no light falls.
        vec4<f32>(min(diffuse, vec3<f32>(60000.0)), 1.0),
        vec4<f32>(min(radiance, vec3<f32>(60000.0)), 1.0),
    );
}
