@group(2) @binding(1) var pyramid: texture_2d<f32>;
@group(2) @binding(2) var mirror: texture_2d<f32>;
@group(2) @binding(3) var wall: texture_2d_array<f32>;
@group(2) @binding(4) var probe: texture_cube<f32>;

struct Levels {
    @location(0) levels: vec4<f32>,
    @location(1) layers: vec4<f32>,
}

// The pixel, or the last one of a level of a texture of this size. Some software devices query the size of a level
// wrongly where the level differs from pixel to pixel.
fn within(pixel: vec2<u32>, size: vec2<u32>, level: u32) -> vec2<u32> {
    return min(pixel, max(size >> vec2<u32>(level), vec2<u32>(1u)) - 1u);
}

fn loaded(sampled: texture_2d<f32>, pixel: vec2<u32>) -> f32 {
    let level = pixel.x / 3u % textureNumLevels(sampled);
    return textureLoad(sampled, within(pixel, textureDimensions(sampled), level), level).r;
}

@fragment
fn fragment(in: FullScreenPixel) -> Levels {
    let pixel = vec2<u32>(in.position.xy);
    let uv = in.clip * vec2<f32>(0.5, -0.5) + 0.5;
    let between = textureSampleLevel(mirror, target_sampler, uv, f32(pixel.x % 11u) * 0.375 - 0.25).r;
    let level = pixel.x / 3u % textureNumLevels(wall);
    let of_wall = textureLoad(wall, within(pixel, textureDimensions(wall), level), pixel.x % 2u, level).r;
    var faces = array<vec3<f32>, 6>(
        vec3<f32>(1.0, 0.0, 0.0), vec3<f32>(-1.0, 0.0, 0.0),
        vec3<f32>(0.0, 1.0, 0.0), vec3<f32>(0.0, -1.0, 0.0),
        vec3<f32>(0.0, 0.0, -1.0), vec3<f32>(0.0, 0.0, 1.0),
    );
    let last = f32(textureNumLevels(probe) - 1u);
    let of_probe = textureSampleLevel(probe, target_sampler, cube_direction(faces[pixel.y % 6u]), last).r;
    let count = f32(textureNumLevels(pyramid));
    return Levels(
        vec4<f32>(loaded(pyramid, pixel), loaded(mirror, pixel), between, count),
        vec4<f32>(of_wall, of_probe, last, 0.0),
    );
}
