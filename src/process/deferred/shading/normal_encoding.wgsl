// Encodes and decodes normals in the target `normal`. `NORMAL_ENCODING`, `NORMAL_STEPS` and `NORMAL_LARGEST` go before
// this.
const SIGNED: u32 = 0u;
const STEPS: u32 = 1u;
const TWO_BYTES: u32 = 2u;

// A normal without direction is stored as +Z.
fn encode_normal(normal: vec3<f32>) -> vec4<f32> {
    let sum = abs(normal.x) + abs(normal.y) + abs(normal.z);
    let point = select(vec2<f32>(0.0), octahedral_from_direction(normal), sum > 0.0 && sum < 3e38);
    if NORMAL_ENCODING == SIGNED {
        return vec4<f32>(point, 0.0, 1.0);
    }
    // Rounded here, because some devices round to slightly different steps than the format's.
    let whole = round(point * NORMAL_STEPS) + NORMAL_STEPS;
    if NORMAL_ENCODING == STEPS {
        return vec4<f32>(whole / NORMAL_LARGEST, 0.0, 1.0);
    }
    let high = floor(whole / 256.0);
    return vec4<f32>(high, whole - high * 256.0) / 255.0;
}

// The normal of a texel, of unit length.
fn decode_normal(texel: vec4<f32>) -> vec3<f32> {
    if NORMAL_ENCODING == SIGNED {
        return direction_from_octahedral(texel.xy);
    }
    let bytes = round(texel * 255.0);
    let whole = select(round(texel.xy * NORMAL_LARGEST), bytes.xy * 256.0 + bytes.zw, NORMAL_ENCODING == TWO_BYTES);
    return direction_from_octahedral((whole - NORMAL_STEPS) / NORMAL_STEPS);
}
