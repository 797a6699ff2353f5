// Lottes, "FXAA", NVIDIA 2009, after its version 3.11.

struct Parameters {
    contrast_threshold: f32,
    dark_threshold: f32,
    sub_pixel: f32,
}

@group(2) @binding(0) var<uniform> parameters: Parameters;
@group(2) @binding(1) var source: texture_2d<f32>;

// How many pixels the search for the end of a step goes in each direction.
const REACH: i32 = 16;

@fragment
fn fragment(in: FullScreenPixel) -> @location(0) vec4<f32> {
    let pixel = vec2<i32>(in.position.xy);
    let color = color_at(pixel);
    let middle = brightness(color);
    let above = brightness_at(pixel + vec2<i32>(0, -1));
    let below = brightness_at(pixel + vec2<i32>(0, 1));
    let left = brightness_at(pixel + vec2<i32>(-1, 0));
    let right = brightness_at(pixel + vec2<i32>(1, 0));
    let brightest = max(middle, max(max(above, below), max(left, right)));
    let darkest = min(middle, min(min(above, below), min(left, right)));
    let contrast = brightest - darkest;
    if contrast <= max(parameters.dark_threshold, brightest * parameters.contrast_threshold) {
        return color;
    }

    let above_left = brightness_at(pixel + vec2<i32>(-1, -1));
    let above_right = brightness_at(pixel + vec2<i32>(1, -1));
    let below_left = brightness_at(pixel + vec2<i32>(-1, 1));
    let below_right = brightness_at(pixel + vec2<i32>(1, 1));

    // An edge lies across the direction in which brightness has the greatest second difference.
    let bend_down = abs(above_left - 2.0 * left + below_left) + 2.0 * abs(above - 2.0 * middle + below)
        + abs(above_right - 2.0 * right + below_right);
    let bend_right = abs(above_left - 2.0 * above + above_right) + 2.0 * abs(left - 2.0 * middle + right)
        + abs(below_left - 2.0 * below + below_right);
    let lies_along_row = bend_down >= bend_right;
    let along = select(vec2<i32>(0, 1), vec2<i32>(1, 0), lies_along_row);
    let before = select(left, above, lies_along_row);
    let after = select(right, below, lies_along_row);

    // The edge is on the side of the pixel with the greater contrast.
    let is_before = abs(before - middle) >= abs(after - middle);
    let other_side = select(along.yx, -along.yx, is_before);
    let other = select(after, before, is_before);

    let covered = covered_fraction(pixel, along, other_side, middle, other);
    let neighbours = 2.0 * (above + below + left + right) + above_left + above_right + below_left + below_right;
    let factor = max(covered, sub_pixel_factor(abs(neighbours / 12.0 - middle) / contrast));
    return mix(color, color_at(pixel + other_side), factor);
}

// The fraction of the pixel on the other side of a straight edge through the middles of the step's two ends; at most
// one half.
fn covered_fraction(pixel: vec2<i32>, along: vec2<i32>, other_side: vec2<i32>, middle: f32, other: f32) -> f32 {
    let between = (middle + other) / 2.0;
    let tolerance = abs(other - middle) / 4.0;
    let backward = step_end(pixel, -along, other_side, between, tolerance);
    let forward = step_end(pixel, along, other_side, between, tolerance);
    let length = backward.distance + forward.distance;
    if backward.distance == forward.distance {
        // In the middle of a step that leads from one side to the other, the edge cuts a triangle off the pixel: half a
        // pixel along, and half a pixel's slope across. Without this, edges at 45 degrees, whose steps are one pixel
        // long, would stay as they are.
        return select(0.0, 0.125 / length, backward.change * forward.change < 0.0);
    }

    // Beyond the end, both sides have the brightness of one of the two. If that is the pixel's own, the edge turns away
    // from it, and the pixels opposite are the ones that are partly covered.
    var nearest = forward;
    if backward.distance < forward.distance {
        nearest = backward;
    }
    let turns_away = (nearest.change < 0.0) == (middle < between);
    return select(0.5 - nearest.distance / length, 0.0, turns_away);
}

struct StepEnd {
    // From the pixel's centre, in pixels.
    distance: f32,
    // The mean brightness of the two sides there, less that at the pixel.
    change: f32,
}

// Where along an edge the mean of its two sides changes.
fn step_end(pixel: vec2<i32>, along: vec2<i32>, other_side: vec2<i32>, between: f32, tolerance: f32) -> StepEnd {
    for (var distance = 1; distance <= REACH; distance++) {
        let along_edge = pixel + distance * along;
        let change = (brightness_at(along_edge) + brightness_at(along_edge + other_side)) / 2.0 - between;
        if abs(change) >= tolerance {
            // The end is where the first pixel that differs begins.
            return StepEnd(f32(distance) - 0.5, change);
        }
    }
    return StepEnd(f32(REACH), 0.0);
}

// The blend factor for details smaller than a pixel, from the pixel's deviation from the mean of its neighbours as a
// fraction of the contrast. Beside a straight edge that is 1/3, which must not change.
fn sub_pixel_factor(deviation: f32) -> f32 {
    return parameters.sub_pixel * smoothstep(1.0 / 3.0, 1.0, deviation);
}

fn brightness_at(pixel: vec2<i32>) -> f32 {
    return brightness(color_at(pixel));
}

// Perceived brightness: approximately the square root of luminance.
fn brightness(color: vec4<f32>) -> f32 {
    return sqrt(dot(color.rgb, vec3<f32>(0.2126, 0.7152, 0.0722)));
}

// Coordinates are clamped to the picture.
fn color_at(pixel: vec2<i32>) -> vec4<f32> {
    let last = vec2<i32>(textureDimensions(source)) - 1;
    return textureLoad(source, clamp(pixel, vec2<i32>(0), last), 0);
}
