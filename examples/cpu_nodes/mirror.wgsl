struct Mirror {
    middle: vec4<f32>,
    half: vec4<f32>,
    // Of the traced picture, in pixels.
    size: vec4<f32>,
}

@group(2) @binding(0) var<uniform> mirror: Mirror;
// Radiance, and 1 where it was traced.
@group(2) @binding(1) var<storage, read> traced: array<vec4<f32>>;

@vertex
fn vertex(@builtin(vertex_index) vertex: u32) -> @builtin(position) vec4<f32> {
    let corner = vec2<f32>(f32((0x32u >> vertex) & 1u), f32((0x2cu >> vertex) & 1u)) * 2.0 - 1.0;
    let position = mirror.middle.xyz + vec3<f32>(corner * mirror.half.xy, 0.0);
    return clip_position(position - metres_from_origin(view.position_low, view.position_high));
}

fn traced_at(pixel: vec2<f32>) -> vec4<f32> {
    let inside = vec2<u32>(clamp(pixel, vec2<f32>(0.0), mirror.size.xy - 1.0));
    return traced[inside.y * u32(mirror.size.x) + inside.x];
}

// The mean of the four nearest pixels that were traced, by their distance.
@fragment
fn fragment(@builtin(position) position: vec4<f32>) -> @location(0) vec4<f32> {
    let place = position.xy / vec2<f32>(view.width, view.height) * mirror.size.xy - 0.5;
    let first = floor(place);
    let share = place - first;
    var sum = vec4<f32>(0.0);
    for (var index = 0u; index < 4u; index += 1u) {
        let offset = vec2<f32>(f32(index & 1u), f32(index >> 1u));
        let weight = abs(1.0 - offset - share);
        sum += traced_at(first + offset) * weight.x * weight.y;
    }
    return vec4<f32>(sum.rgb / max(sum.a, 0.001) * 0.9, 1.0);
}
