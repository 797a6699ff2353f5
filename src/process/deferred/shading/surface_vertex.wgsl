// The interpolated vertex output of an object: what shaders that draw objects share.
struct Surface {
    @invariant @builtin(position) clip: vec4<f32>,
    @location(0) relative: vec3<f32>,
    @location(1) normal: vec3<f32>,
    @location(2) uv: vec2<f32>,
    @location(3) @interpolate(flat) material: u32,
    // The object's index in the scene.
    @location(4) @interpolate(flat) object: u32,
}

@vertex
fn vertex(in: VertexInput) -> Surface {
    let object = drawn_object(in.instance);
    let deformed = deform(in, object);
    let relative = relative_position(object, deformed.position);
    let uv = clamp(deformed.uv, vec2<f32>(-MAX_UV), vec2<f32>(MAX_UV));
    return Surface(clip_position(relative), relative, world_normal(object, deformed.normal), uv, object.material, object.index);
}

fn vertex_color(in: Surface) -> vec3<f32> {
    return vec3<f32>(1.0);
}
