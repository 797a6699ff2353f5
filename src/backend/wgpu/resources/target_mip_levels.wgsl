@group(0) @binding(0) var finer: texture_2d<f32>;

@vertex
fn vertex(@builtin(vertex_index) index: u32) -> @builtin(position) vec4<f32> {
    // A triangle around the whole level.
    return vec4<f32>(f32(index & 1u) * 4.0 - 1.0, f32(index >> 1u) * 4.0 - 1.0, 0.0, 1.0);
}

// The weights, along one axis, of the finer level's pixels 2i, 2i + 1 and 2i + 2 in pixel i.
fn shares(index: u32, finer_size: u32) -> array<f32, 3> {
    if finer_size == 1u {
        return array<f32, 3>(1.0, 0.0, 0.0);
    }
    if (finer_size & 1u) == 0u {
        return array<f32, 3>(0.5, 0.5, 0.0);
    }
    // Each pixel covers finer_size / size of them.
    let size = finer_size / 2u;
    let whole = f32(finer_size);
    return array<f32, 3>(f32(size - index) / whole, f32(size) / whole, f32(index + 1u) / whole);
}

@fragment
fn fragment(@builtin(position) position: vec4<f32>) -> @location(0) vec4<f32> {
    let pixel = vec2<u32>(position.xy);
    let finer_size = textureDimensions(finer);
    var columns = shares(pixel.x, finer_size.x);
    var rows = shares(pixel.y, finer_size.y);
    var mean = vec4<f32>(0.0);
    for (var y = 0u; y < 3u; y++) {
        for (var x = 0u; x < 3u; x++) {
            let share = columns[x] * rows[y];
            // Pixels without a share may not exist.
            if share > 0.0 {
                mean += textureLoad(finer, pixel * 2u + vec2<u32>(x, y), 0) * share;
            }
        }
    }
    return mean;
}
