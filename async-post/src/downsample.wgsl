@group(2) @binding(0) var<uniform> divisor: vec4<u32>;
@group(2) @binding(1) var source: texture_2d<f32>;

// The mean of the pixels of the source that a pixel covers: fewer at the right and the lower edge.
@fragment
fn fragment(in: FullScreenPixel) -> @location(0) vec4<f32> {
    let first = vec2<u32>(in.position.xy) * divisor.w;
    let end = min(first + divisor.w, textureDimensions(source));
    var sum = vec4<f32>(0.0);
    for (var y = first.y; y < end.y; y++) {
        for (var x = first.x; x < end.x; x++) {
            sum += textureLoad(source, vec2<u32>(x, y), 0);
        }
    }
    let count = (end - first).x * (end - first).y;
    return sum / f32(count);
}
