fn color_texel(slot: TextureSlot, coordinates: AllCoordinates) -> vec4<f32> {
    if slot.texture == 0xffffffffu {
        return vec4<f32>(1.0);
    }
    let layer = slot.texture & 0xffffu;
    let nearest = (slot.flags & 2u) != 0u;
    switch slot.texture >> 16u {
        case 0u: { return texel(colors_0, slot, placed(slot, coordinates), layer, nearest); }
        case 1u: { return texel(colors_1, slot, placed(slot, coordinates), layer, nearest); }
        case 2u: { return texel(colors_2, slot, placed(slot, coordinates), layer, nearest); }
        default: { return texel(colors_3, slot, placed(slot, coordinates), layer, nearest); }
    }
}

fn number_texel(slot: TextureSlot, coordinates: AllCoordinates) -> vec4<f32> {
    if slot.texture == 0xffffffffu {
        return vec4<f32>(1.0);
    }
    let layer = slot.texture & 0xffffu;
    let nearest = (slot.flags & 2u) != 0u;
    switch slot.texture >> 16u {
        case 0u: { return texel(numbers_0, slot, placed(slot, coordinates), layer, nearest); }
        case 1u: { return texel(numbers_1, slot, placed(slot, coordinates), layer, nearest); }
        case 2u: { return texel(numbers_2, slot, placed(slot, coordinates), layer, nearest); }
        default: { return texel(numbers_3, slot, placed(slot, coordinates), layer, nearest); }
    }
}

// Where a texture is sampled, before it wraps.
fn placed(slot: TextureSlot, coordinates: AllCoordinates) -> Coordinates {
    var used = coordinates.first;
    if (slot.flags & 1u) != 0u {
        used = coordinates.second;
    }
    let matrix = mat2x2<f32>(slot.matrix.xy, slot.matrix.zw);
    return Coordinates(matrix * used.uv + slot.offset, matrix * used.uv_dx, matrix * used.uv_dy);
}

fn texel(colors: texture_2d_array<f32>, slot: TextureSlot, at: Coordinates, layer: u32, nearest: bool) -> vec4<f32> {
    let size = vec2<f32>(textureDimensions(colors));
    let pixels_dx = at.uv_dx * size;
    let pixels_dy = at.uv_dy * size;
    let level = max(0.5 * log2(max(max(dot(pixels_dx, pixels_dx), dot(pixels_dy, pixels_dy)), 1e-20)), 0.0);
    // Half a pixel of the mip level that is sampled: what is nearer to an edge would be blended with the opposite one.
    let edge = min(0.5 * exp2(ceil(level)) / size, vec2<f32>(0.5));
    let uv = vec2<f32>(
        wrapped(at.uv.x, (slot.flags >> 8u) & 3u, edge.x),
        wrapped(at.uv.y, (slot.flags >> 10u) & 3u, edge.y),
    );
    if nearest {
        return textureSampleGrad(colors, nearest_pixel, uv, layer, at.uv_dx, at.uv_dy);
    }
    return textureSampleGrad(colors, smooth_pixels, uv, layer, at.uv_dx, at.uv_dy);
}

// The samplers repeat; this clamps and mirrors.
fn wrapped(coordinate: f32, wrap: u32, edge: f32) -> f32 {
    switch wrap {
        case 1u: { return clamp(coordinate, edge, 1.0 - edge); }
        case 2u: { return clamp(1.0 - abs(fract(coordinate * 0.5) * 2.0 - 1.0), edge, 1.0 - edge); }
        default: { return fract(coordinate); }
    }
}
