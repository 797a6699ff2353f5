// The pictures of other views, in three rows of three.

@group(2) @binding(1) var main_view: texture_2d<f32>;
@group(2) @binding(2) var guest: texture_2d<f32>;
@group(2) @binding(3) var pool: texture_2d<f32>;
@group(2) @binding(4) var portal: texture_2d<f32>;
@group(2) @binding(5) var inner_portal: texture_2d<f32>;
@group(2) @binding(6) var screen: texture_2d<f32>;
@group(2) @binding(7) var shadow_map: texture_depth_2d;
@group(2) @binding(8) var detail: texture_2d<f32>;
@group(2) @binding(9) var tile_upper_left: texture_2d<f32>;
@group(2) @binding(10) var tile_upper_right: texture_2d<f32>;
@group(2) @binding(11) var tile_lower_left: texture_2d<f32>;
@group(2) @binding(12) var tile_lower_right: texture_2d<f32>;

const PICTURE: vec2<i32> = vec2<i32>(480, 270);
const LABEL: i32 = 22;

// Outside of a texture, as in that of a view that the frame does not have, it is black.
fn load(source: texture_2d<f32>, at: vec2<i32>) -> vec3<f32> {
    return textureLoad(source, at, 0).rgb;
}

fn shadow_at(at: vec2<i32>) -> vec3<f32> {
    let across = at - vec2<i32>((PICTURE.x - PICTURE.y) / 2, 0);
    if across.x < 0 || across.x >= PICTURE.y {
        return vec3<f32>(0.0);
    }
    let side = i32(textureDimensions(shadow_map).x);
    let depth = textureLoad(shadow_map, across * side / PICTURE.y, 0);
    // Most of what a lamp sees is close to it compared with its range.
    return vec3<f32>(depth * depth * depth * depth);
}

fn tile_at(at: vec2<i32>) -> vec3<f32> {
    let tile = at / PICTURE;
    let within = at % PICTURE;
    switch tile.x + 2 * tile.y {
        case 0: { return load(tile_upper_left, within); }
        case 1: { return load(tile_upper_right, within); }
        case 2: { return load(tile_lower_left, within); }
        default: { return load(tile_lower_right, within); }
    }
}

@fragment
fn fragment(in: FullScreenPixel) -> @location(0) vec4<f32> {
    let pixel = vec2<i32>(in.position.xy);
    let cell = pixel / vec2<i32>(PICTURE.x, PICTURE.y + LABEL);
    let at = pixel % vec2<i32>(PICTURE.x, PICTURE.y + LABEL) - vec2<i32>(0, LABEL);
    if at.y < 0 {
        discard;
    }
    var color: vec3<f32>;
    switch cell.x + 3 * cell.y {
        case 0: { color = load(main_view, at); }
        case 1: { color = load(guest, at); }
        case 2: { color = load(pool, at); }
        case 3: { color = load(portal, at); }
        case 4: { color = load(inner_portal, at); }
        case 5: { color = load(screen, at); }
        case 6: { color = shadow_at(at); }
        case 7: { color = load(detail, at); }
        default: {
            let first = 2 * at;
            let upper = tile_at(first) + tile_at(first + vec2<i32>(1, 0));
            let lower = tile_at(first + vec2<i32>(0, 1)) + tile_at(first + vec2<i32>(1, 1));
            color = 0.25 * (upper + lower);
        }
    }
    return vec4<f32>(color, 1.0);
}
