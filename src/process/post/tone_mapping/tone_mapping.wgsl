struct Parameters {
    exposure: f32,
    // 1 clips radiance at 1, 0 applies the filmic curve.
    clips: f32,
}

@group(2) @binding(0) var<uniform> parameters: Parameters;
@group(2) @binding(1) var radiance_target: texture_2d<f32>;

@fragment
fn fragment(in: FullScreenPixel) -> @location(0) vec4<f32> {
    // A sum of several processes may exceed the half floats and be infinite; a difference may be negative.
    let sum = textureLoad(radiance_target, vec2<i32>(in.position.xy), 0).rgb;
    let finite = clamp(sum, vec3<f32>(0.0), vec3<f32>(65504.0));
    let radiance = min(finite * parameters.exposure, vec3<f32>(65504.0));
    if parameters.clips == 1.0 {
        return vec4<f32>(min(radiance, vec3<f32>(1.0)), 1.0);
    }
    return vec4<f32>(filmic(radiance), 1.0);
}

// Narkowicz 2015, "ACES Filmic Tone Mapping Curve".
fn filmic(radiance: vec3<f32>) -> vec3<f32> {
    let mapped = (radiance * (2.51 * radiance + 0.03)) / (radiance * (2.43 * radiance + 0.59) + 0.14);
    return clamp(mapped, vec3<f32>(0.0), vec3<f32>(1.0));
}
