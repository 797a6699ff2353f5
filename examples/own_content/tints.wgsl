@group(3) @binding(0) var<storage, read> tints: array<vec4<f32>>;

struct Targets {
    @location(0) normal: vec4<f32>,
    @location(1) diffuse: vec4<f32>,
    @location(2) radiance: vec4<f32>,
}

@fragment
fn fragment(in: Surface) -> Targets {
    let material = materials[in.material];
    let normal = shading_normal(in, material);
    let tint = tints[in.object];
    let diffuse = surface_diffuse(in, material).rgb * tint.rgb;
    let radiance = diffuse * (view.ambient + tint.a);
    return Targets(encode_normal(normal), vec4<f32>(diffuse, 1.0), vec4<f32>(radiance, 1.0));
}
