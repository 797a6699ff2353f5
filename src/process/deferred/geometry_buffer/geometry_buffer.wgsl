struct Targets {
    @location(0) normal: vec4<f32>,
    @location(1) diffuse: vec4<f32>,
    @location(2) radiance: vec4<f32>,
}

@fragment
fn fragment(in: Surface) -> Targets {
    return surface_targets(in);
}

@fragment
fn masked_fragment(in: Surface) -> Targets {
    let targets = surface_targets(in);
    if is_cut_out(materials[in.material], in.uv) {
        discard;
    }
    return targets;
}

// Needs uniform control flow.
fn surface_targets(in: Surface) -> Targets {
    let material = materials[in.material];
    let normal = shading_normal(in, material);
    let diffuse = surface_diffuse(in, material).rgb;
    let radiance = material.emission + diffuse * view.ambient;
    return Targets(
        encode_normal(normal),
        // Above 65,504 a half float would become infinite, and NaN where it is multiplied by no light.
        vec4<f32>(min(diffuse, vec3<f32>(60000.0)), 1.0),
        vec4<f32>(min(radiance, vec3<f32>(60000.0)), 1.0),
    );
}
