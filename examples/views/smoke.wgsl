// Puffs of smoke in a smaller target. `const DIVISOR: i32`, how many pixels of the picture each of its pixels is wide,
// goes before it.

@group(2) @binding(1) var depth: texture_depth_2d;

struct Corner {
    @builtin(position) position: vec4<f32>,
    @location(0) relative: vec3<f32>,
    @location(1) normal: vec3<f32>,
}

@vertex
fn vertex(in: VertexInput) -> Corner {
    let object = drawn_object(in.instance);
    let relative = relative_position(object, in.position);
    return Corner(clip_position(relative), relative, world_normal(object, in.normal));
}

@fragment
fn fragment(in: Corner) -> @location(0) vec4<f32> {
    // The upper left of the pixels of the picture that this one stands for.
    let pixel = vec2<i32>(in.position.xy) * DIVISOR;
    let clip = clip_of_pixel(vec4<f32>(vec2<f32>(pixel) + 0.5, 0.0, 0.0));
    let behind = distance_of(clip, textureLoad(depth, pixel, 0)) - length(in.relative);
    // Denser in the middle, and gone where it touches a surface.
    let facing = max(dot(direction_to_eye(in.relative), normalize(in.normal)), 0.0);
    let alpha = 0.4 * facing * facing * clamp(behind / 0.3, 0.0, 1.0);
    let color = mix(vec3<f32>(0.25, 0.24, 0.3), vec3<f32>(0.75, 0.72, 0.7), 0.5 + 0.5 * normalize(in.normal).y);
    return vec4<f32>(color * alpha, alpha);
}
