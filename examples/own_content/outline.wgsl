const WIDTH: f32 = 3.0;

@vertex
fn vertex(in: VertexInput) -> @builtin(position) vec4<f32> {
    let object = drawn_object(in.instance);
    let deformed = deform(in, object);
    let relative = relative_position(object, deformed.position);
    let position = clip_position(relative);
    let along_normal = clip_position(relative + 0.01 * world_normal(object, deformed.normal));
    // In pixels, so that the line is as wide everywhere.
    let pixels = 0.5 * vec2<f32>(view.width, view.height);
    let direction = (along_normal.xy / along_normal.w - position.xy / position.w) * pixels;
    let outward = direction / max(length(direction), 1e-6) * WIDTH / pixels;
    return position + vec4<f32>(outward * position.w, 0.0, 0.0);
}

@fragment
fn fragment() -> @location(0) vec4<f32> {
    return vec4<f32>(1.0, 0.45, 0.05, 1.0);
}
