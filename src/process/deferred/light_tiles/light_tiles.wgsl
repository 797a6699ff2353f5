// The width and height of a tile in pixels of the target that holds its marks, which is half as wide and high as the
// picture.
const TILE_SIDE: u32 = 16u;

// How many bits of a pixel are marks.
const BITS: u32 = 24u;

// A tile, in pixels of the target. At the right and the lower edge it may be smaller.
struct LightTile {
    first: vec2<u32>,
    size: vec2<u32>,
    // How many lights, one after the other, share a bit.
    lights_per_bit: u32,
}

fn tile_of(pixel: vec2<u32>, target_size: vec2<u32>) -> LightTile {
    let first = pixel / TILE_SIDE * TILE_SIDE;
    let size = min(vec2<u32>(TILE_SIDE), target_size - first);
    let bits = size.x * size.y * BITS;
    return LightTile(first, size, max((view.light_count + bits - 1u) / bits, 1u));
}

