// A point of a light's shadow map.
struct ShadowMapPoint {
    // From (-1, -1) at the map's lower left to (1, 1) at its upper right.
    clip: vec2<f32>,
    depth: f32,
    // The width of a pixel of the map there, in metres.
    pixel: f32,
}

// The fraction of a light that reaches a position, from 0 to 1.
fn light_visibility(light: Light, position: vec3<f32>, normal: vec3<f32>) -> f32 {
    if light.shadow_layer == NO_SHADOW_MAP {
        return 1.0;
    }
    let off_surface = distance_off_surface(position);
    if has_cube_map(light.kind) {
        let face = shadow_map_of_layer(light.shadow_layer + cube_face(position - light.position));
        return filtered_visibility(face.shadow_layer, biased_point(face, position, normal, off_surface));
    }
    var map = light;
    if reaches_everything(light.kind) {
        // It has cascades. The finest cascade in which the filter reads no pixel outside of the map.
        let side = f32(textureDimensions(shadow_maps).x);
        let extent = 1.0 - f32(2 * SHADOW_FILTER + 1) / side;
        for (var cascade = 1u; cascade < SHADOW_CASCADES; cascade++) {
            let found = biased_point(map, position, normal, off_surface);
            if all(abs(found.clip) < vec2<f32>(extent)) && found.depth > 0.0 && found.depth < 1.0 {
                return filtered_visibility(map.shadow_layer, found);
            }
            map = shadow_map_of_layer(light.shadow_layer + cascade);
        }
    }
    let found = biased_point(map, position, normal, off_surface);
    if any(abs(found.clip) >= vec2<f32>(1.0)) || found.depth <= 0.0 {
        return 1.0;
    }
    return filtered_visibility(map.shadow_layer, found);
}

// A light that has several maps, as one of them shows it.
fn shadow_map_of_layer(layer: u32) -> Light {
    return lights[view.light_count + layer];
}

// The face of a cube around the origin that a position is seen through: 0 for +X, 1 for -X, and so on.
fn cube_face(position: vec3<f32>) -> u32 {
    let distance = abs(position);
    if distance.x >= distance.y && distance.x >= distance.z {
        return select(0u, 1u, position.x < 0.0);
    }
    if distance.y >= distance.z {
        return select(2u, 3u, position.y < 0.0);
    }
    return select(4u, 5u, position.z < 0.0);
}

// The point of a light's map at which a position is looked up: that of the position, moved towards the light by the
// bias.
fn biased_point(light: Light, position: vec3<f32>, normal: vec3<f32>, off_surface: f32) -> ShadowMapPoint {
    var towards = -light.direction;
    if !reaches_everything(light.kind) {
        towards = normalize(light.position - position);
    }
    // An upper bound of the depth change within the filter.
    let filter_pixels = 0.1 + f32(SHADOW_FILTER + 1) * shadow_slope(light, normal, towards);
    let depth_change = shadow_map_point(light, position).pixel * filter_pixels;
    let offset = SHADOW_BIAS * (depth_change + off_surface / max(dot(normal, towards), 1e-3));

    // An offset towards the light does not change where in the map the position is.
    return shadow_map_point(light, position + towards * min(offset, length(light.position - position)));
}

// How far a position from depth may be off its surface, in metres. Devices move the corners of triangles to multiples
// of 1/256 of a pixel, and their depth with them. That moves a position parallel to the picture, by at most √2/512 of a
// pixel's width at its distance, for which 1/256 is an upper bound. Where an oblique near plane makes depth differ
// across the picture, the same depth is that of a position farther or nearer there, too. And the corners were rounded
// to the steps of fixed-point positions.
fn distance_off_surface(position: vec3<f32>) -> f32 {
    var pixel = 2.0 * length(view.up) / view.height;
    if view.projection == PERSPECTIVE {
        let distance = length(position);
        let matrix = view.clip_from_relative;
        let row = vec3<f32>(matrix[0].z, matrix[1].z, matrix[2].z);
        // The depth of a position at distance t is row · ray + matrix[3].z ÷ t, for a ray that is at least 1 long.
        let depth_change = abs(dot(row, view.right)) / view.width + abs(dot(row, view.up)) / view.height;
        pixel = distance * (pixel + distance * depth_change / abs(matrix[3].z));
    }
    return pixel / 256.0 + 0x1p-29;
}

// The greatest change of a surface's distance to the light over a pixel of its map along both of the map's axes, in
// pixel widths.
fn shadow_slope(light: Light, normal: vec3<f32>, towards: vec3<f32>) -> f32 {
    let cosine = clamp(dot(normal, towards), 1e-3, 1.0);
    if has_paraboloid_map(light.kind) {
        // A pixel's diagonal, and a little more because pixels differ in size.
        return 1.5 * sqrt(1.0 - cosine * cosine) / cosine;
    }
    // The map is flat, so a surface that faces the light off the map's axis has a slope too.
    let local = along_map_axes(light, normal);
    return (abs(local.x) + abs(local.y)) / cosine;
}

// From the world's axes to those of the light's shadow map.
fn along_map_axes(light: Light, direction: vec3<f32>) -> vec3<f32> {
    return rotate(vec4<f32>(-light.shadow_orientation.xyz, light.shadow_orientation.w), direction);
}

fn shadow_map_point(light: Light, position: vec3<f32>) -> ShadowMapPoint {
    let side = f32(textureDimensions(shadow_maps).x);
    let local = along_map_axes(light, position - light.position);
    let reach = light.range - light.shadow_near;
    if reaches_everything(light.kind) {
        let half = light.shadow_half;
        return ShadowMapPoint(local.xy / half, (light.range + local.z) / reach, 2.0 * half / side);
    }
    if has_paraboloid_map(light.kind) {
        let distance = max(length(local), 1e-30);
        let clip = local.xy / (distance * max(1.0 - local.z / distance, 1e-3));
        // Coarsest in the middle (Brabec et al. 2002).
        let pixel = 4.0 * distance / (side * (1.0 + dot(clip, clip)));
        return ShadowMapPoint(clip, (light.range - distance) / reach, pixel);
    }
    let distance = max(-local.z, light.shadow_near);
    let half = light.shadow_half * distance;
    return ShadowMapPoint(local.xy / half, light.shadow_near / distance, 2.0 * half / side);
}

// The mean of the depth tests of the map's pixels around a point: a box filter, in which pixels on the edge are
// weighted by how much of them is inside.
fn filtered_visibility(layer: u32, point: ShadowMapPoint) -> f32 {
    let side = i32(textureDimensions(shadow_maps).x);
    let center = (point.clip * vec2<f32>(0.5, -0.5) + 0.5) * f32(side) - 0.5;
    let first = vec2<i32>(floor(center)) - SHADOW_FILTER;
    let inside = fract(center);
    let last = 2 * SHADOW_FILTER + 1;
    var lit = 0.0;
    var is_shadowed = false;
    for (var row = 0; row <= last; row++) {
        var weight_of_row = 1.0;
        if row == 0 { weight_of_row = 1.0 - inside.y; } else if row == last { weight_of_row = inside.y; }
        for (var column = 0; column <= last; column++) {
            var weight = weight_of_row;
            if column == 0 { weight *= 1.0 - inside.x; } else if column == last { weight *= inside.x; }
            let pixel = clamp(first + vec2<i32>(column, row), vec2<i32>(0), vec2<i32>(side - 1));
            // Depth is reversed: nearer to the light is greater.
            if textureLoad(shadow_maps, pixel, layer, 0) <= point.depth {
                lit += weight;
            } else {
                is_shadowed = true;
            }
        }
    }
    // Without an occluder the result is exactly 1, as without a map, although the sum of the weights is rounded.
    return select(1.0, lit / f32(last * last), is_shadowed);
}
