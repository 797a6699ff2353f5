// `uncolored_surface.wgsl` for objects whose vertices have colours.
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

fn set_color(surface: ptr<function, Surface>, vertex: VertexInput) {
    (*surface).color = vertex.color;
}

fn vertex_color(in: Surface) -> vec3<f32> {
    return in.color;
}
