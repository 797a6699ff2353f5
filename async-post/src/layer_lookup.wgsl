// What workers computed from an earlier frame, and the view of that frame.
@group(3) @binding(0) var layer: texture_2d<f32>;
@group(3) @binding(1) var layer_view: texture_2d<u32>;

fn layer_word(index: i32) -> u32 {
    return textureLoad(layer_view, vec2<i32>(index, 0), 0).x;
}

// Whether there is a layer for this view.
fn layer_is_there() -> bool {
    return layer_word(22) != 0u;
}

fn layer_matrix_column(first: i32) -> vec4<f32> {
    let words = vec4<u32>(layer_word(first), layer_word(first + 1), layer_word(first + 2), layer_word(first + 3));
    return bitcast<vec4<f32>>(words);
}

fn layer_position_of_clip(clip: vec2<f32>) -> vec2<f32> {
    return clip * vec2<f32>(0.5, -0.5) + 0.5;
}

// Where in the layer, from (0, 0) at its upper left to (1, 1) at its lower right, the surface is that this view shows
// at `clip` with a depth, if that surface has not moved. z is 1 if the layer's view shows that place, 0 if it is beside
// it, and -1 if it is behind its camera.
fn layer_position(clip: vec2<f32>, depth: f32) -> vec3<f32> {
    let layer_projection = layer_word(23);
    if view.projection == PARABOLOID || layer_projection == PARABOLOID {
        return vec3<f32>(layer_position_of_clip(clip), 1.0);
    }
    // Subtracted exactly, in fixed point, wherever in the world the cameras are.
    let moved = fixed_difference(
        view.position_low,
        view.position_high,
        vec3<u32>(layer_word(16), layer_word(17), layer_word(18)),
        bitcast<vec3<i32>>(vec3<u32>(layer_word(19), layer_word(20), layer_word(21))),
    );
    // Relative to the camera of the layer, in homogeneous coordinates: what is infinitely far away, with a depth of 0,
    // has a direction and no position, and is turned without being moved.
    var position = vec4<f32>(position_from_depth(clip, depth) + moved, 1.0);
    if view.projection == PERSPECTIVE {
        let ray = clip.x * view.right + clip.y * view.up + view.forward;
        let matrix = view.clip_from_relative;
        // 0 unless the near plane is oblique.
        let depth_at_infinity = dot(vec3<f32>(matrix[0].z, matrix[1].z, matrix[2].z), ray);
        let inverse_distance = max(depth - depth_at_infinity, 0.0) / matrix[3].z;
        position = vec4<f32>(ray + moved * inverse_distance, inverse_distance);
    }
    let matrix =
        mat4x4<f32>(layer_matrix_column(0), layer_matrix_column(4), layer_matrix_column(8), layer_matrix_column(12));
    let projected = matrix * position;
    if !(projected.w > 0.0) {
        return vec3<f32>(layer_position_of_clip(clip), -1.0);
    }
    let layer_clip = projected.xy / projected.w;
    // Not a number if a product overflowed: that is outside, too.
    let is_within = all(abs(layer_clip) <= vec2<f32>(1.0));
    return vec3<f32>(layer_position_of_clip(layer_clip), select(0.0, 1.0, is_within));
}
