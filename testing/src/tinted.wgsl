@group(3) @binding(0) var<storage, read> tints: array<vec4<f32>>;

struct Corner {
    @builtin(position) position: vec4<f32>,
    @location(0) color: vec3<f32>,
    @location(1) @interpolate(flat) object: u32,
}

@vertex
fn vertex(in: VertexInput) -> Corner {
    let object = drawn_object(in.instance);
    return Corner(clip_position(relative_position(object, in.position)), tints[object.index].rgb, object.index);
}

@fragment
fn fragment(in: Corner) -> @location(0) vec4<f32> {
    return vec4<f32>(in.color, tints[in.object].a);
}
