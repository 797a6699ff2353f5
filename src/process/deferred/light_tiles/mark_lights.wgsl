@fragment
fn fragment(in: FullScreenPixel) -> @location(0) vec4<u32> {
    let picture = vec2<u32>(u32(view.width), u32(view.height));
    let target_size = (picture + 1u) / 2u;
    let pixel = vec2<u32>(in.position.xy);
    let tile = tile_of(pixel, target_size);
    let local = pixel - tile.first;
    let first_bit = (local.y * tile.size.x + local.x) * BITS;
    var marks = 0u;
    if first_bit * tile.lights_per_bit < view.light_count {
        let first = vec2<f32>(tile.first * 2u);
        let end = min(vec2<f32>((tile.first + tile.size) * 2u), vec2<f32>(picture));
        let one = clip_of_pixel(vec4<f32>(first, 0.0, 1.0));
        let other = clip_of_pixel(vec4<f32>(end, 0.0, 1.0));
        for (var bit = 0u; bit < BITS; bit++) {
            let begin = (first_bit + bit) * tile.lights_per_bit;
            for (var index = begin; index < min(begin + tile.lights_per_bit, view.light_count); index++) {
                if may_reach(lights[index], min(one, other), max(one, other)) {
                    marks |= 1u << bit;
                    break;
                }
            }
        }
    }
    return vec4<u32>(marks, 0u, 0u, 0u);
}

// Whether a light may reach what is seen between two clip coordinates: whether its sphere is not wholly beyond one of
// four planes. The margin is a hundred times what rounding makes.
fn may_reach(light: Light, low: vec2<f32>, high: vec2<f32>) -> bool {
    if reaches_everything(light.kind) {
        return true;
    }
    let reach = light.range * 1.001 + length(light.position) * 1e-5;
    return distance_beyond(view.right, view.up, low.x, light.position) >= -reach
        && distance_beyond(view.right, view.up, high.x, light.position) <= reach
        && distance_beyond(view.up, view.right, low.y, light.position) >= -reach
        && distance_beyond(view.up, view.right, high.y, light.position) <= reach;
}

// The distance of a position, along an axis of the picture, beyond the plane of all that has a clip coordinate there.
fn distance_beyond(axis: vec3<f32>, other_axis: vec3<f32>, clip: f32, position: vec3<f32>) -> f32 {
    var ray = view.forward;
    var from_plane = position;
    if view.projection == PERSPECTIVE {
        ray += clip * axis;
    } else {
        from_plane -= clip * axis;
    }
    let normal = normalize(cross(other_axis, ray));
    return dot(normal, from_plane) * sign(dot(normal, axis));
}
