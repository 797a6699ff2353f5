// What the cells of the sheet have in common. The bindings, `const ROW: i32` and
// `fn color_of(column: i32, at: vec2<i32>) -> vec3<f32>` go before it.

const PICTURE: vec2<i32> = vec2<i32>(480, 270);
const LABEL: i32 = 22;

// The pixel of something of this size that is stretched to the height of the cell; negative beside it.
fn fitted(at: vec2<i32>, size: vec2<u32>) -> vec2<i32> {
    let shown = vec2<i32>(size);
    let across = PICTURE.y * shown.x / shown.y;
    let x = at.x - (PICTURE.x - across) / 2;
    if x < 0 || x >= across {
        return vec2<i32>(-1);
    }
    return vec2<i32>(x, at.y) * shown.y / PICTURE.y;
}

fn picture(shown: texture_2d<f32>, at: vec2<i32>) -> vec3<f32> {
    let pixel = fitted(at, textureDimensions(shown));
    return select(vec3<f32>(0.0), textureLoad(shown, max(pixel, vec2<i32>(0)), 0).rgb, pixel.x >= 0);
}

// The number of the square of this side in which a pixel is, three to a row, and where in the square; the number is
// negative beside the squares.
fn square_of(at: vec2<i32>, count: i32, side: i32) -> vec3<i32> {
    let columns = min(count, 3);
    let x = at.x - (PICTURE.x - columns * side) / 2;
    let index = x / side + at.y / side * 3;
    if x < 0 || x >= columns * side || index >= count {
        return vec3<i32>(0, 0, -1);
    }
    return vec3<i32>(x % side, at.y % side, index);
}

// One of the shadow maps of a light, black outside of its square. `light` is a number of `ShadowedLight`.
fn shadow_map(shown: texture_depth_2d, at: vec2<i32>, map: i32, count: i32, side: i32, light: i32) -> vec3<f32> {
    let square = square_of(at, count, side);
    if square.z != map {
        return vec3<f32>(0.0);
    }
    let depth = textureLoad(shown, square.xy * i32(textureDimensions(shown).x) / side, 0);
    switch light {
        case 0: { return vec3<f32>(depth * depth * depth * depth); }
        case 1: { return vec3<f32>(min(depth * 6.0, 1.0)); }
        default: { return vec3<f32>(max(1.0 - 1e-5 / max(depth, 1e-9), 0.0)); }
    }
}

// Two pixels of the tiles in each direction are one of the picture.
fn tiles(shown: texture_2d_array<f32>, at: vec2<i32>) -> vec3<f32> {
    var sum = vec3<f32>(0.0);
    for (var corner = 0; corner < 4; corner++) {
        let pixel = 2 * at + vec2<i32>(corner & 1, corner >> 1u);
        let tile = pixel / PICTURE;
        sum += textureLoad(shown, pixel % PICTURE, tile.x + 2 * tile.y, 0).rgb;
    }
    return 0.25 * sum;
}

fn cube(shown: texture_2d_array<f32>, at: vec2<i32>) -> vec3<f32> {
    let side = PICTURE.y / 2;
    let square = square_of(at, 6, side);
    if square.z < 0 {
        return vec3<f32>(0.0);
    }
    return textureLoad(shown, square.xy * i32(textureDimensions(shown).x) / side, square.z, 0).rgb;
}

@fragment
fn fragment(in: FullScreenPixel) -> @location(0) vec4<f32> {
    let pixel = vec2<i32>(in.position.xy);
    let cell = pixel / vec2<i32>(PICTURE.x, PICTURE.y + LABEL);
    let at = pixel % vec2<i32>(PICTURE.x, PICTURE.y + LABEL) - vec2<i32>(0, LABEL);
    if at.y < 0 || cell.y != ROW {
        discard;
    }
    return vec4<f32>(color_of(cell.x, at), 1.0);
}
