fn color_texel(slot: TextureSlot, coordinates: AllCoordinates) -> vec4<f32> {
    if slot.texture == 0xffffffffu {
        return vec4<f32>(1.0);
    }
    switch slot.texture >> 16u {
        case 0u: { return texel(colors_0, slot, placed(slot, coordinates)); }
        case 1u: { return texel(colors_1, slot, placed(slot, coordinates)); }
        case 2u: { return texel(colors_2, slot, placed(slot, coordinates)); }
        default: { return texel(colors_3, slot, placed(slot, coordinates)); }
    }
}

fn number_texel(slot: TextureSlot, coordinates: AllCoordinates) -> vec4<f32> {
    if slot.texture == 0xffffffffu {
        return vec4<f32>(1.0);
    }
    switch slot.texture >> 16u {
        case 0u: { return texel(numbers_0, slot, placed(slot, coordinates)); }
        case 1u: { return texel(numbers_1, slot, placed(slot, coordinates)); }
        case 2u: { return texel(numbers_2, slot, placed(slot, coordinates)); }
        default: { return texel(numbers_3, slot, placed(slot, coordinates)); }
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

fn texel(colors: texture_2d_array<f32>, slot: TextureSlot, at: Coordinates) -> vec4<f32> {
    let size = vec2<f32>(slot.size);
    let pixels_dx = at.uv_dx * size;
    let pixels_dy = at.uv_dy * size;
    let wanted = 0.5 * log2(max(max(dot(pixels_dx, pixels_dx), dot(pixels_dy, pixels_dy)), 1e-20));
    let nearest = (slot.flags & select(4u, 2u, wanted <= 0.0)) != 0u;
    var level = clamp(wanted, 0.0, f32(last_level(slot)));
    if (slot.flags & 8u) != 0u {
        level = 0.0;
    } else if (slot.flags & 16u) != 0u {
        level = floor(level + 0.5);
    }
    let layer = slot.texture & 0xffffu;
    let first = u32(level);
    let texel = texel_of_level(colors, slot, at.uv, layer, first, nearest);
    if fract(level) == 0.0 {
        return texel;
    }
    // Each mip level has its own edges.
    let next = texel_of_level(colors, slot, at.uv, layer, min(first + 1u, last_level(slot)), nearest);
    return mix(texel, next, fract(level));
}

fn texel_of_level(
    colors: texture_2d_array<f32>, slot: TextureSlot, uv: vec2<f32>, layer: u32, level: u32, nearest: bool,
) -> vec4<f32> {
    let size = max(slot.size >> vec2<u32>(level), vec2<u32>(1u));
    let wraps = vec2<u32>((slot.flags >> 8u) & 3u, (slot.flags >> 10u) & 3u);
    if any(slot.size != textureDimensions(colors)) {
        return texel_of_part(colors, size, wraps, uv, layer, level, nearest);
    }
    // Half a pixel: what is nearer to an edge would be blended with the opposite one.
    let edge = 0.5 / vec2<f32>(size);
    let within = vec2<f32>(wrapped(uv.x, wraps.x, edge.x), wrapped(uv.y, wraps.y, edge.y));
    if nearest {
        return textureSampleLevel(colors, nearest_pixel, within, layer, f32(level));
    }
    return textureSampleLevel(colors, smooth_pixels, within, layer, f32(level));
}

fn last_level(slot: TextureSlot) -> u32 {
    return firstLeadingBit(max(max(slot.size.x, slot.size.y), 1u));
}

// The samplers repeat; this clamps and mirrors.
fn wrapped(coordinate: f32, wrap: u32, edge: f32) -> f32 {
    switch wrap {
        case 1u: { return clamp(coordinate, edge, 1.0 - edge); }
        case 2u: { return clamp(1.0 - abs(fract(coordinate * 0.5) * 2.0 - 1.0), edge, 1.0 - edge); }
        default: { return fract(coordinate); }
    }
}

// The image is in the upper left of the layer, so that the samplers would blend it with what is beside it.
fn texel_of_part(
    colors: texture_2d_array<f32>, size: vec2<u32>, wraps: vec2<u32>, uv: vec2<f32>, layer: u32, level: u32,
    nearest: bool,
) -> vec4<f32> {
    let position = vec2<f32>(within_period(uv.x, wraps.x), within_period(uv.y, wraps.y)) * vec2<f32>(size);
    if nearest {
        return pixel(colors, vec2<i32>(floor(position)), size, wraps, layer, level);
    }
    let corner = vec2<i32>(floor(position - 0.5));
    let inside = fract(position - 0.5);
    let above = mix(
        pixel(colors, corner, size, wraps, layer, level),
        pixel(colors, corner + vec2<i32>(1, 0), size, wraps, layer, level),
        inside.x,
    );
    let below = mix(
        pixel(colors, corner + vec2<i32>(0, 1), size, wraps, layer, level),
        pixel(colors, corner + vec2<i32>(1, 1), size, wraps, layer, level),
        inside.x,
    );
    return mix(above, below, inside.y);
}

// A coordinate where the texture shows the same, near 0: the numbers of pixels stay within the range of integers.
fn within_period(coordinate: f32, wrap: u32) -> f32 {
    switch wrap {
        case 1u: { return clamp(coordinate, -1.0, 2.0); }
        case 2u: { return fract(coordinate * 0.5) * 2.0; }
        default: { return fract(coordinate); }
    }
}

fn pixel(
    colors: texture_2d_array<f32>, at: vec2<i32>, size: vec2<u32>, wraps: vec2<u32>, layer: u32, level: u32,
) -> vec4<f32> {
    let within = vec2<i32>(wrapped_pixel(at.x, i32(size.x), wraps.x), wrapped_pixel(at.y, i32(size.y), wraps.y));
    return textureLoad(colors, within, layer, level);
}

fn wrapped_pixel(number: i32, size: i32, wrap: u32) -> i32 {
    switch wrap {
        case 1u: { return clamp(number, 0, size - 1); }
        case 2u: {
            let within = (number + 2 * size) % (2 * size);
            return min(within, 2 * size - 1 - within);
        }
        default: { return (number + size) % size; }
    }
}
