//! How shaders read shadow maps, in WGSL.

use crate::view::ShadowMaps;

/// WGSL with `light_visibility`: it reads the shadow maps at a binding of `@group(2)`, or returns 1 if there are none.
pub(in crate::process::deferred) fn shadow_shader(maps: Option<(u32, &ShadowMaps)>) -> String {
    match maps {
        None => include_str!("no_shadow.wgsl").to_owned(),
        Some((binding, maps)) => format!(
            "@group(2) @binding({binding}) var shadow_maps: texture_depth_2d_array;\n\
             const SHADOW_BIAS: f32 = {:?};\n\
             const SHADOW_FILTER: i32 = {};\n\
             const SHADOW_CASCADES: u32 = {};\n{}",
            maps.bias,
            maps.filter,
            maps.cascades,
            include_str!("shadow.wgsl")
        ),
    }
}
