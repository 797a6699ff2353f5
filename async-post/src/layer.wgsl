struct Settings {
    unread: vec4<f32>,
    strength: f32,
    multiplies: u32,
    // 0 the same place, 1 the layer's edge, 2 neutral.
    outside: u32,
    padding: u32,
}

@group(2) @binding(0) var<uniform> settings: Settings;
@group(2) @binding(1) var source: texture_2d<f32>;

@fragment
fn fragment(in: FullScreenPixel) -> @location(0) vec4<f32> {
    let color = textureLoad(source, vec2<i32>(in.position.xy), 0);
    if !layer_is_there() {
        return color;
    }
    var found = looked_up(in);
    if found.z < 1.0 {
        if settings.outside == 2u {
            return color;
        }
        // What is behind the camera has no nearest edge.
        if settings.outside == 0u || found.z < 0.0 {
            found = vec3<f32>(layer_position_of_clip(in.clip), 1.0);
        }
    }
    // Not a number, where a product overflowed, becomes a corner.
    let value = textureSampleLevel(layer, target_sampler, clamp(found.xy, vec2<f32>(0.0), vec2<f32>(1.0)), 0.0).rgb;
    if settings.multiplies != 0u {
        return vec4<f32>(color.rgb * mix(vec3<f32>(1.0), value, settings.strength), color.a);
    }
    return vec4<f32>(color.rgb + settings.strength * value, color.a);
}
