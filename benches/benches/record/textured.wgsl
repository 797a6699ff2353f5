struct Surface {
    @builtin(position) clip: vec4<f32>,
    @location(0) normal: vec3<f32>,
    @location(1) uv: vec2<f32>,
}

@group(0) @binding(0) var<uniform> clip_from_world: mat4x4<f32>;
@group(1) @binding(0) var colors: texture_2d<f32>;
@group(1) @binding(1) var normals: texture_2d<f32>;
@group(1) @binding(2) var roughness: texture_2d<f32>;
@group(1) @binding(3) var linear: sampler;

@vertex
fn vertex(
    @location(0) position: vec3<f32>,
    @location(1) normal: vec3<f32>,
    @location(2) x_axis: vec4<f32>,
    @location(3) y_axis: vec4<f32>,
    @location(4) z_axis: vec4<f32>,
    @location(5) translation: vec4<f32>,
) -> Surface {
    let world_from_object = mat4x4<f32>(x_axis, y_axis, z_axis, translation);
    let world_normal = (world_from_object * vec4<f32>(normal, 0.0)).xyz;
    return Surface(clip_from_world * world_from_object * vec4<f32>(position, 1.0), world_normal, position.xy);
}

@fragment
fn fragment(in: Surface) -> @location(0) vec4<f32> {
    let normal = normalize(in.normal + textureSample(normals, linear, in.uv).xyz);
    let color = textureSample(colors, linear, in.uv).rgb * (1.0 - 0.5 * textureSample(roughness, linear, in.uv).r);
    return vec4<f32>(color * (0.6 + 0.4 * normal.y), 1.0);
}
