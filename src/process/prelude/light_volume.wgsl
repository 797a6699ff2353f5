// What a light reaches, drawn as geometry: the vertex shader of every process that draws lights.
@vertex
fn light_volume(@location(0) corner: vec3<f32>, @builtin(instance_index) instance: u32) -> LightPixel {
    let light = lights[instance];
    if light.kind == DIRECTIONAL {
        // Infinitely far away.
        return LightPixel(vec4<f32>(corner.xy, 0.0, 1.0), instance);
    }
    // Nothing is farther from a camera than this, and what is larger could leave the range of f32.
    let range = min(light.range, 0x1p36);
    var local = corner * range;
    if light.kind != POINT {
        local = around_axis(light.direction, cone_corner(corner, light.cone_end, range));
    }
    var clip = clip_position(light.position + local);
    if view.projection == ORTHOGRAPHIC && dot(light.position, view.forward) + 2.0 * range > view.far {
        // The far plane would cut the far side off, and what lies before it would stay dark. All corners of a light take the
        // same way, since a side with one of its corners moved would be tilted.
        clip.z = 0.0;
    }
    return LightPixel(clip, instance);
}

// How large a light volume is beyond the light, as a share of its range: the same as in `light_volume.rs`.
const VOLUME_GROWTH: f32 = 1e-4;

// Where the cosine's own rounding could hide an angle, the cone is as wide as if it did.
const COSINE_ROUNDING: f32 = 0x1p-22;

// cos(π/16): the middle of each of the cone's sixteen sides is that much closer to the axis than its edges.
const APOTHEM: f32 = 0.98078528;

// The place of a corner (x, y, tier) of the cone, for a light at the origin that shines along +Z. `cosine` is that of the
// angle between the axis and where the light ends, from 0 to 1.
fn cone_corner(corner: vec3<f32>, cosine: f32, range: f32) -> vec3<f32> {
    let along = clamp(cosine, 0.0, 1.0);
    let sine = sqrt(max(1.0 - along * along, 0.0) + COSINE_ROUNDING);
    let radius = (sine + VOLUME_GROWTH) / APOTHEM;
    var height = 1.0 + VOLUME_GROWTH;
    if corner.z == 0.0 {
        height = -VOLUME_GROWTH;
    } else if corner.z == 1.0 {
        height = along - VOLUME_GROWTH;
    }
    return vec3<f32>(corner.xy * radius, height) * range;
}

// Turns +Z onto an axis of unit length, and whatever else there is with it (Duff et al., "Building an Orthonormal Basis,
// Revisited", JCGT 2017). The sign keeps the divisor away from 0.
fn around_axis(axis: vec3<f32>, local: vec3<f32>) -> vec3<f32> {
    let sign = select(-1.0, 1.0, axis.z >= 0.0);
    let a = -1.0 / (sign + axis.z);
    let b = axis.x * axis.y * a;
    let right = vec3<f32>(1.0 + sign * axis.x * axis.x * a, sign * b, -sign * axis.x);
    let up = vec3<f32>(b, sign + axis.y * axis.y * a, -axis.y);
    return local.x * right + local.y * up + local.z * axis;
}
