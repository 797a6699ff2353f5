struct Surface {
    @builtin(position) clip: vec4<f32>,
    @location(0) normal: vec3<f32>,
    @location(1) uv: vec2<f32>,
    @location(2) @interpolate(flat) material: u32,
}

@vertex
fn vertex(in: VertexInput) -> Surface {
    let object = drawn_object(in.instance);
    let relative = relative_position(object, in.position);
    return Surface(clip_position(relative), world_normal(object, in.normal), in.position.xy, object.material);
}

@fragment
fn fragment(in: Surface) -> @location(0) vec4<f32> {
    let material = materials[in.material];
    let across = dpdx(in.uv);
    let down = dpdy(in.uv);
    let normal = normalize(in.normal + texture_at(material, 1u, in.uv, across, down).xyz);
    let roughness = texture_at(material, 2u, in.uv, across, down).r;
    let color = texture_at(material, 0u, in.uv, across, down).rgb * (1.0 - 0.5 * roughness);
    return vec4<f32>(color * (0.6 + 0.4 * normal.y), 1.0);
}
