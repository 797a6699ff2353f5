// `surface_vertex.wgsl` for objects whose vertices have colours.
struct Surface {
    @invariant @builtin(position) clip: vec4<f32>,
    @location(0) relative: vec3<f32>,
    @location(1) normal: vec3<f32>,
    @location(2) uv: vec2<f32>,
    @location(3) @interpolate(flat) material: u32,
    // The object's index in the scene.
    @location(4) @interpolate(flat) object: u32,
    @location(5) color: vec3<f32>,
}

@vertex
fn vertex(in: VertexInput) -> Surface {
    let object = drawn_object(in.instance);
    let deformed = deform(in, object);
    let relative = relative_position(object, deformed.position);
    let uv = clamp(deformed.uv, vec2<f32>(-MAX_UV), vec2<f32>(MAX_UV));
    return Surface(clip_position(relative), relative, world_normal(object, deformed.normal), uv, object.material, object.index, deformed.color);
}

fn vertex_color(in: Surface) -> vec3<f32> {
    return in.color;
}
