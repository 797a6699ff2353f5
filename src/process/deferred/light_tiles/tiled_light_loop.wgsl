// The illuminance of a surface, at a pixel of the picture, by the lights that reach its tile, with their shadows; not
// the ambient light's.
fn illuminance_in_tile(pixel: vec2<u32>, position: vec3<f32>, normal: vec3<f32>) -> vec3<f32> {
    var illuminance = vec3<f32>(0.0);
    let tile = tile_of(pixel / 2u, textureDimensions(light_tiles));
    for (var word = 0u; word * BITS * tile.lights_per_bit < view.light_count; word++) {
        let marked = tile.first + vec2<u32>(word % tile.size.x, word / tile.size.x);
        var marks = textureLoad(light_tiles, marked, 0).x;
        while marks != 0u {
            let begin = (word * BITS + firstTrailingBit(marks)) * tile.lights_per_bit;
            marks &= marks - 1u;
            for (var index = begin; index < min(begin + tile.lights_per_bit, view.light_count); index++) {
                illuminance += visible_illuminance_from(lights[index], position, normal);
            }
        }
    }
    return illuminance;
}
