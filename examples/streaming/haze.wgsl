// The sky above the horizon, and haze over the land, which is all haze where the tiles end.

struct Parameters {
    unread: vec4<f32>,
    color: vec4<f32>,
}

@group(2) @binding(0) var<uniform> parameters: Parameters;
@group(2) @binding(1) var depth: texture_depth_2d;

const SUN: vec3<f32> = vec3<f32>(-0.55, 0.42, -0.72);

@fragment
fn fragment(in: FullScreenPixel) -> @location(0) vec4<f32> {
    let found = textureLoad(depth, vec2<i32>(in.position.xy), 0);
    let ray = normalize(position_from_depth(in.clip, 0.01));
    let toward_sun = max(dot(ray, normalize(SUN)), 0.0);
    let glow = vec3<f32>(0.9, 0.62, 0.34) * (0.35 * pow(toward_sun, 8.0) + 0.9 * pow(toward_sun, 64.0));
    let horizon = parameters.color.rgb + glow;
    if found == 0.0 {
        let zenith = vec3<f32>(0.13, 0.28, 0.62) + glow;
        return vec4<f32>(mix(horizon, zenith, smoothstep(0.0, 0.5, ray.y)), 1.0);
    }
    let distance = length(position_from_depth(in.clip, found));
    let thickness = smoothstep(140.0, 400.0, distance) * 0.75 + smoothstep(300.0, 425.0, distance) * 0.25;
    return vec4<f32>(horizon * thickness, thickness);
}
