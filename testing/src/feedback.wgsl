@group(2) @binding(1) var left: texture_2d<f32>;
@group(2) @binding(2) var right: texture_2d<f32>;

@fragment
fn fragment(in: FullScreenPixel) -> @location(0) vec4<f32> {
    let pixel = vec2<u32>(in.position.xy);
    let gradient = view.width / 256.0 + f32(pixel.x + 3u * pixel.y) / 1024.0;
    let of_left = textureLoad(left, min(pixel, textureDimensions(left) - 1u), 0).r;
    let of_right = textureLoad(right, min(pixel, textureDimensions(right) - 1u), 0).r;
    return vec4<f32>(gradient + of_left * 0.5 + of_right * 0.25, 0.0, 0.0, 1.0);
}
