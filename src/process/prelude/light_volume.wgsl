// The vertex shader of every process that draws lights: places the corners of a light volume.
@vertex
fn light_volume(@location(0) corner: vec3<f32>, @builtin(instance_index) instance: u32) -> LightPixel {
    let light = lights[instance];
    if reaches_everything(light.kind) {
        // Infinitely far away.
        return LightPixel(vec4<f32>(corner.xy, 0.0, 1.0), instance);
    }
    // No surface is farther from a camera than this, and a larger range could leave the range of f32.
    let range = min(light.range, 0x1p36);
    var local = corner * range;
    if has_cone_volume(light.kind) {
        local = around_axis(light.direction, cone_corner(corner, light.cone_end, range));
    }
    var clip = clip_position(light.position + local);
    if view.projection == ORTHOGRAPHIC && dot(light.position, view.forward) + 2.0 * range > view.far {
        // The far plane would clip the far side of the volume, and the surfaces in front of it would stay dark. All
        // corners of a light are moved, because moving only some would tilt a side.
        clip.z = 0.0;
    }
    return LightPixel(clip, instance);
}

// How far a light volume exceeds what the light reaches, as a fraction of its range: the same as in `light_volume.rs`.
const VOLUME_GROWTH: f32 = 1e-4;

// Added to the sine's square: the angle that the rounding of the cosine may hide.
const COSINE_ROUNDING: f32 = 0x1p-22;

// cos(π/16): the middle of each of the cone's sixteen sides is closer to the axis than its edges by this factor.
const APOTHEM: f32 = 0.98078528;

// The position of a corner (x, y, tier) of the cone, for a light at the origin that shines along +Z. `cosine` is the
// cosine of the cone's half-angle, from 0 to 1.
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

// Rotates a vector so that +Z becomes an axis of unit length (Duff et al., "Building an Orthonormal Basis, Revisited",
// JCGT 2017). The sign keeps the divisor away from 0.
fn around_axis(axis: vec3<f32>, local: vec3<f32>) -> vec3<f32> {
    let sign = select(-1.0, 1.0, axis.z >= 0.0);
    let a = -1.0 / (sign + axis.z);
    let b = axis.x * axis.y * a;
    let right = vec3<f32>(1.0 + sign * axis.x * axis.x * a, sign * b, -sign * axis.x);
    let up = vec3<f32>(b, sign + axis.y * axis.y * a, -axis.y);
    return local.x * right + local.y * up + local.z * axis;
}
