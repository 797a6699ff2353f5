@fragment
fn fragment(in: Surface) -> @location(0) vec4<f32> {
    let material = materials[in.material];
    let diffuse = surface_diffuse(in, material).rgb;
    return vec4<f32>(material.emission + diffuse * view.ambient, 1.0);
}
