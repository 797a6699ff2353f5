struct Surface {
    @builtin(position) clip: vec4<f32>,
    @location(0) normal: vec3<f32>,
    @location(1) @interpolate(flat) material: u32,
}

@vertex
fn vertex(in: VertexInput) -> Surface {
    let object = drawn_object(in.instance);
    let relative = relative_position(object, in.position);
    return Surface(clip_position(relative), world_normal(object, in.normal), object.material);
}

@fragment
fn fragment(in: Surface) -> @location(0) vec4<f32> {
    return vec4<f32>(materials[in.material].diffuse * (0.6 + 0.4 * normalize(in.normal).y), 1.0);
}
