struct View {
    clip_from_relative: mat4x4<f32>,
    eye: vec4<f32>,
}

struct Object {
    position: vec4<f32>,
    orientation: vec4<f32>,
    scale: vec4<f32>,
    box_center: vec4<f32>,
    box_half: vec4<f32>,
}

@group(0) @binding(0) var<uniform> view: View;
@group(0) @binding(1) var<storage, read> objects: array<Object>;
@group(0) @binding(2) var<storage, read> listed: array<u32>;

fn clip_position(object: Object, local: vec3<f32>) -> vec4<f32> {
    let q = object.orientation;
    let scaled = local * object.scale.xyz;
    let rotated = scaled + 2.0 * cross(q.xyz, cross(q.xyz, scaled) + q.w * scaled);
    return view.clip_from_relative * vec4<f32>(rotated + (object.position.xyz - view.eye.xyz), 1.0);
}

@vertex
fn vertex(@location(0) position: vec3<f32>, @builtin(instance_index) instance: u32) -> @builtin(position) vec4<f32> {
    return clip_position(objects[listed[instance]], position);
}

// A box as a strip of 14 vertices: each bit is a side of the box.
@vertex
fn box_vertex(
    @builtin(vertex_index) index: u32,
    @builtin(instance_index) instance: u32,
) -> @builtin(position) vec4<f32> {
    let object = objects[listed[instance]];
    let side = (vec3<u32>(0x287au, 0x02afu, 0x31e3u) >> vec3<u32>(index)) & vec3<u32>(1u);
    return clip_position(object, object.box_center.xyz + object.box_half.xyz * (vec3<f32>(side) * 2.0 - 1.0));
}

@fragment
fn fragment() -> @location(0) vec4<f32> {
    return vec4<f32>(1.0);
}
