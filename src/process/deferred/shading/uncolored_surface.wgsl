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

fn set_color(surface: ptr<function, Surface>, vertex: VertexInput) {}

fn vertex_color(in: Surface) -> vec3<f32> {
    return vec3<f32>(1.0);
}
