struct PreviousCamera {
    clip_from_relative: mat4x4<f32>,
    camera_moved: vec4<f32>,
}

@group(2) @binding(0) var<uniform> previous: PreviousCamera;
@group(3) @binding(0) var<storage, read> previous_objects: array<Object>;

struct Corner {
    @invariant @builtin(position) position: vec4<f32>,
    @location(0) now: vec3<f32>,
    @location(1) then: vec3<f32>,
}

@vertex
fn vertex(in: VertexInput) -> Corner {
    let object = drawn_object(in.instance);
    let relative = relative_position(object, in.position);
    // From this frame's camera to where the corner was, then from the camera of the frame before.
    let relative_then = relative_position(previous_objects[object.index], in.position) + previous.camera_moved.xyz;
    let now = clip_position(relative);
    let then = previous.clip_from_relative * vec4<f32>(relative_then, 1.0);
    return Corner(now, now.xyw, then.xyw);
}

@fragment
fn fragment(in: Corner) -> @location(0) vec2<f32> {
    return (in.now.xy / in.now.z - in.then.xy / in.then.z) * vec2<f32>(0.5, -0.5);
}
