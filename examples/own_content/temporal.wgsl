@group(2) @binding(1) var current: texture_2d<f32>;
@group(2) @binding(2) var motion: texture_2d<f32>;
@group(2) @binding(3) var history: texture_2d<f32>;

@fragment
fn fragment(in: FullScreenPixel) -> @location(0) vec4<f32> {
    let pixel = vec2<i32>(in.position.xy);
    let now = textureLoad(current, pixel, 0).rgb;
    let point = in.clip * vec2<f32>(0.5, -0.5) + 0.5 - textureLoad(motion, pixel, 0).rg;
    let then = textureSampleLevel(history, target_sampler, point, 0.0);
    // Without a history its alpha is 0. What was outside of the picture has none either.
    let is_known = then.a > 0.5 && all(point >= vec2<f32>(0.0)) && all(point <= vec2<f32>(1.0));
    if !is_known {
        return vec4<f32>(now, 1.0);
    }
    // A colour that none of the neighbours has now was another surface's.
    var least = now;
    var most = now;
    let last = vec2<i32>(textureDimensions(current)) - 1;
    for (var index = 0; index < 9; index++) {
        let neighbour = clamp(pixel + vec2<i32>(index % 3 - 1, index / 3 - 1), vec2<i32>(0), last);
        let color = textureLoad(current, neighbour, 0).rgb;
        least = min(least, color);
        most = max(most, color);
    }
    return vec4<f32>(mix(clamp(then.rgb, least, most), now, 0.15), 1.0);
}
