// Which light, and nothing.
@group(2) @binding(0) var<uniform> chosen: vec4<u32>;

@fragment
fn fragment(in: Surface) -> @location(0) vec4<f32> {
    // Taken before the flow parts.
    let gradient_x = dpdx(in.uv);
    let gradient_y = dpdy(in.uv);
    let material = materials[in.material];

    let illuminance = illuminance_from(lights[chosen.x], in.relative, shading_normal(in, material));
    // As the deferred pipeline does.
    if all(illuminance == vec3<f32>(0.0)) {
        discard;
    }
    let diffuse = diffuse_at(material, in.uv, gradient_x, gradient_y).rgb;
    return vec4<f32>(diffuse / PI * illuminance, 0.0);
}
