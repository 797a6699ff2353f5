//! How shaders read shadow maps.

use crate::view::ShadowMaps;

/// WGSL by which a shader asks what share of a light reaches a place: from the shadow maps at a binding of `@group(2)`, or all
/// of it where there are none.
pub(super) fn shadow_shader(maps: Option<(u32, &ShadowMaps)>) -> String {
    match maps {
        None => include_str!("no_shadow.wgsl").to_owned(),
        Some((binding, maps)) => format!(
            "@group(2) @binding({binding}) var shadow_maps: texture_depth_2d_array;\n\
             const SHADOW_BIAS: f32 = {:?};\n\
             const SHADOW_FILTER: i32 = {};\n{}",
            maps.bias,
            maps.filter,
            include_str!("shadow.wgsl")
        ),
    }
}
