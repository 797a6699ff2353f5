struct Surface {
    @builtin(position) clip: vec4<f32>,
    @location(0) normal: vec3<f32>,
}

@group(0) @binding(0) var<uniform> clip_from_world: mat4x4<f32>;
@group(1) @binding(0) var<uniform> color: vec4<f32>;

@vertex
fn vertex(
    @location(0) position: vec3<f32>,
    @location(1) normal: vec3<f32>,
    @location(2) x_axis: vec4<f32>,
    @location(3) y_axis: vec4<f32>,
    @location(4) z_axis: vec4<f32>,
    @location(5) translation: vec4<f32>,
) -> Surface {
    let world_from_item = mat4x4<f32>(x_axis, y_axis, z_axis, translation);
    let world_position = world_from_item * vec4<f32>(position, 1.0);
    return Surface(clip_from_world * world_position, (world_from_item * vec4<f32>(normal, 0.0)).xyz);
}

@fragment
fn fragment(in: Surface) -> @location(0) vec4<f32> {
    return vec4<f32>(color.rgb * (AMBIENT + (1.0 - AMBIENT) * normalize(in.normal).y), 1.0);
}
