// The distance of what has a depth, in metres, up to 1 km.
fn distance_of(clip: vec2<f32>, depth: f32) -> f32 {
    return min(length(position_from_depth(clip, max(depth, 1e-9))), 1000.0);
}
