struct Settings {
    unread: vec4<u32>,
    // To the next pixel of the row or column.
    step: vec2<u32>,
    radius: u32,
    threshold: f32,
    // Four a vector, by distance.
    weights: array<vec4<f32>, 8>,
}

@group(2) @binding(0) var<uniform> settings: Settings;
@group(2) @binding(1) var source: texture_2d<f32>;

fn bright(pixel: vec2<i32>) -> vec3<f32> {
    let last = vec2<i32>(textureDimensions(source)) - 1;
    let color = textureLoad(source, clamp(pixel, vec2<i32>(0), last), 0).rgb;
    return clamp(color - settings.threshold, vec3<f32>(0.0), vec3<f32>(65504.0));
}

@fragment
fn fragment(in: FullScreenPixel) -> @location(0) vec4<f32> {
    let pixel = vec2<i32>(in.position.xy);
    let step = vec2<i32>(settings.step);
    var sum = settings.weights[0].x * bright(pixel);
    for (var distance = 1u; distance <= settings.radius; distance++) {
        let offset = i32(distance) * step;
        let weight = settings.weights[distance / 4u][distance % 4u];
        sum += weight * (bright(pixel - offset) + bright(pixel + offset));
    }
    return vec4<f32>(sum, 1.0);
}
