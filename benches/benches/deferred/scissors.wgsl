// The whole picture, as far away as the farthest point that the light may reach.
@vertex
fn vertex(@builtin(vertex_index) index: u32, @builtin(instance_index) light: u32) -> LightPixel {
    let corner = vec2<f32>(f32(index & 1u) * 4.0 - 1.0, f32(index >> 1u) * 4.0 - 1.0);
    let behind = view.clip_from_relative * vec4<f32>(lights[light].position + view.forward * lights[light].range, 1.0);
    return LightPixel(vec4<f32>(corner, behind.z / behind.w, 1.0), light);
}
