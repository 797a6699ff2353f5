struct Object {
    world_from_object: mat4x4<f32>,
    material: u32,
}

struct Surface {
    @builtin(position) clip: vec4<f32>,
    @location(0) normal: vec3<f32>,
    @location(1) @interpolate(flat) material: u32,
}

@group(0) @binding(0) var<uniform> clip_from_world: mat4x4<f32>;
@group(0) @binding(1) var<storage, read> objects: array<Object>;
@group(0) @binding(2) var<storage, read> colors: array<vec4<f32>>;

@vertex
fn vertex(
    @location(0) position: vec3<f32>,
    @location(1) normal: vec3<f32>,
    @builtin(instance_index) instance: u32,
) -> Surface {
    let object = objects[object_index(instance)];
    let world_position = object.world_from_object * vec4<f32>(position, 1.0);
    let world_normal = (object.world_from_object * vec4<f32>(normal, 0.0)).xyz;
    return Surface(clip_from_world * world_position, world_normal, object.material);
}

@fragment
fn fragment(in: Surface) -> @location(0) vec4<f32> {
    return vec4<f32>(colors[in.material].rgb * (0.6 + 0.4 * normalize(in.normal).y), 1.0);
}
