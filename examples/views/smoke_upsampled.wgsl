// The smoke over the picture: the mean of the four nearest pixels of the smaller target, in which those count less that
// stand for something at another distance (Kopf et al. 2007, "Joint Bilateral Upsampling").

@group(2) @binding(1) var smoke: texture_2d<f32>;
@group(2) @binding(2) var depth: texture_depth_2d;

@fragment
fn fragment(in: FullScreenPixel) -> @location(0) vec4<f32> {
    let pixel = vec2<i32>(in.position.xy);
    let own = distance_of(in.clip, textureLoad(depth, pixel, 0));
    let position = (vec2<f32>(pixel) + 0.5) / f32(DIVISOR) - 0.5;
    let first = vec2<i32>(floor(position));
    let share = position - floor(position);
    let last = vec2<i32>(textureDimensions(smoke)) - 1;
    var sum = vec4<f32>(0.0);
    var weights = 0.0;
    for (var corner = 0; corner < 4; corner++) {
        let offset = vec2<i32>(corner & 1, corner >> 1u);
        let at = clamp(first + offset, vec2<i32>(0), last);
        let clip = clip_of_pixel(vec4<f32>(vec2<f32>(DIVISOR * at) + 0.5, 0.0, 0.0));
        let difference = abs(distance_of(clip, textureLoad(depth, DIVISOR * at, 0)) - own);
        let near = select(1.0 - share, share, offset == vec2<i32>(1));
        let weight = near.x * near.y / (0.02 + difference) + 1e-6;
        sum += textureLoad(smoke, at, 0) * weight;
        weights += weight;
    }
    return sum / weights;
}
