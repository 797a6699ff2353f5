// The prelude of every shader. A process's own WGSL follows it and may use all of it.
//
//   @group(0)  the frame and the view: below
//   @group(1)  materials and their textures: below
//   @group(2)  the process's own: binding 0 its parameters, bindings 1, 2 ... the targets that it samples, in order,
//              then the buffers that it reads or changes
//   @group(3)  the engine's own, from binding 0: the columns of objects that the process reads, the values of
//              materials, then its resources: from binding FIRST_RESOURCE
//
// `const ABSOLUTE_TRANSFORMS: bool` goes before it, as the frame's quality says, and so does
// `const FIRST_RESOURCE: u32`, as the process declares.

struct View {
    // No shader reads it. Lavapipe of Mesa 22.3 inlines the first four bytes of a uniform buffer into shaders that read
    // them and branch on a member of the buffer: it compiles these anew for each pass, and never frees what it
    // compiled.
    unread: vec4<f32>,
    // From world axes relative to the camera to clip space; depth is reversed.
    clip_from_relative: mat4x4<f32>,
    // The origin that vertices are relative to, in fixed point like an object's: the camera's position, or for a
    // directional light's shadow map a point midway between its near and far planes.
    position_low: vec3<u32>,
    light_count: u32,
    position_high: vec3<i32>,
    near: f32,
    // Right and up are as long as half the picture's width and height at a distance of 1. In perspective, forward is
    // the ray of the picture's centre.
    right: vec3<f32>,
    width: f32,
    up: vec3<f32>,
    height: f32,
    forward: vec3<f32>,
    projection: u32,
    // Linear.
    ambient: vec3<f32>,
    far: f32,
    // Where each class of lights ends in `lights`, four a vector. It begins where the one before ends. The classes are
    // in the order of the kinds, of each kind first those without a shadow and then those with one.
    light_ends: array<vec4<u32>, LIGHT_CLASS_VECTORS>,
}

const PERSPECTIVE: u32 = 0u;
const ORTHOGRAPHIC: u32 = 1u;
// What is in front of the near plane is drawn as if it were on it.
const ORTHOGRAPHIC_SHADOW: u32 = 2u;
const PARABOLOID: u32 = 3u;

// A position is 64-bit fixed point in steps of 2^-30 m, in two halves.
struct Object {
    position_low: vec3<u32>,
    material: u32,
    position_high: vec3<i32>,
    padding: u32,
    orientation: vec4<f32>,
    scale: vec3<f32>,
    index: u32,
}

const NO_SHADOW_MAP: u32 = 0xffffffffu;

struct Light {
    // Relative to the camera, along the world's axes. For a directional light: the position of its shadow map's camera.
    position: vec3<f32>,
    kind: u32,
    // The direction in which the light travels.
    direction: vec3<f32>,
    // For a directional light: where its shadow map ends.
    range: f32,
    // At 1 m; for a directional light, on a surface that faces it.
    intensity: vec3<f32>,
    // Spot: the light fades from this cosine to `cone_end`.
    cone_begin: f32,
    cone_end: f32,
    // The first layer, if it has several maps.
    shadow_layer: u32,
    // Half the width of its shadow map: at 1 m for a spot or point light, in metres for a directional one.
    shadow_half: f32,
    shadow_near: f32,
    // From the axes of the shadow map's camera to the world's.
    shadow_orientation: vec4<f32>,
}

struct Material {
    diffuse: vec3<f32>,
    opacity: f32,
    emission: vec3<f32>,
    // Where a mask's alpha is less, there is no surface; 0 for a material without a mask.
    alpha_cutoff: f32,
    // 1 if both sides are drawn.
    double_sided: u32,
    // 0 for none, 1 alpha, 2 additive, 3 subtractive.
    blend: u32,
    // In each place the array of the texture, among those that are bound, in the upper 8 bits, and its layer in the
    // others; `NO_TEXTURE` for none. Read them by `texture_at`.
    textures: array<u32, 6>,
}

const NO_TEXTURE: u32 = 0xffffffffu;
const ALPHA: u32 = 1u;

@group(0) @binding(0) var<uniform> view: View;
@group(0) @binding(1) var<storage, read> objects: array<Object>;
// The object of each instance, in batch order.
@group(0) @binding(2) var<storage, read> drawn: array<u32>;
// `view.light_count` lights. If a light has several shadow maps, one more follows for each layer of the maps: the light
// that the layer belongs to, as that map shows it.
@group(0) @binding(3) var<storage, read> lights: array<Light>;

@group(1) @binding(0) var<storage, read> materials: array<Material>;
// The arrays of a set of textures, which all materials have that are drawn together, and their samplers.
@group(1) @binding(1) var textures_0: texture_2d_array<f32>;
@group(1) @binding(2) var textures_1: texture_2d_array<f32>;
@group(1) @binding(3) var textures_2: texture_2d_array<f32>;
@group(1) @binding(4) var textures_3: texture_2d_array<f32>;
@group(1) @binding(5) var textures_4: texture_2d_array<f32>;
@group(1) @binding(6) var textures_5: texture_2d_array<f32>;
@group(1) @binding(7) var sampler_0: sampler;
@group(1) @binding(8) var sampler_1: sampler;
@group(1) @binding(9) var sampler_2: sampler;
@group(1) @binding(10) var sampler_3: sampler;
@group(1) @binding(11) var sampler_4: sampler;
@group(1) @binding(12) var sampler_5: sampler;
// Linear between pixels, and the nearest pixel outside: for targets.
@group(1) @binding(13) var target_sampler: sampler;

struct FullScreenPixel {
    @builtin(position) position: vec4<f32>,
    // From (-1, -1) at the picture's lower left to (1, 1) at its upper right.
    @location(0) clip: vec2<f32>,
}

// A pixel that a light may reach.
struct LightPixel {
    @builtin(position) position: vec4<f32>,
    @location(0) @interpolate(flat) light: u32,
}

// One triangle that covers the picture.
@vertex
fn full_screen(@builtin(vertex_index) index: u32) -> FullScreenPixel {
    let clip = vec2<f32>(f32(index & 1u) * 4.0 - 1.0, f32(index >> 1u) * 4.0 - 1.0);
    return FullScreenPixel(vec4<f32>(clip, 0.0, 1.0), clip);
}

fn drawn_object(instance: u32) -> Object {
    return objects[drawn[instance]];
}

fn rotate(orientation: vec4<f32>, direction: vec3<f32>) -> vec3<f32> {
    let twice = 2.0 * cross(orientation.xyz, direction);
    return direction + orientation.w * twice + cross(orientation.xyz, twice);
}

// From object space to world axes relative to the camera.
fn relative_position(object: Object, position: vec3<f32>) -> vec3<f32> {
    let turned = rotate(object.orientation, object.scale * position);
    if ABSOLUTE_TRANSFORMS {
        // Far from the world's origin both are rounded before they are subtracted.
        let in_world = metres_from_origin(object.position_low, object.position_high) + turned;
        return in_world - metres_from_origin(view.position_low, view.position_high);
    }
    return fixed_difference(object.position_low, object.position_high, view.position_low, view.position_high) + turned;
}

// Shaders that must draw at exactly the same depth both call this, and mark their position `@invariant`.
fn clip_position(relative: vec3<f32>) -> vec4<f32> {
    var clip = unclamped_clip_position(relative);
    if CLAMPS_CORNERS && view.projection == ORTHOGRAPHIC_SHADOW {
        clip.z = min(clip.z, 1.0);
    }
    return clip;
}

// The same where a pixel's depth is clamped to the near plane, and not that of corners.
fn unclamped_clip_position(relative: vec3<f32>) -> vec4<f32> {
    let clip = view.clip_from_relative * vec4<f32>(relative, 1.0);
    if view.projection == PARABOLOID {
        return paraboloid_position(clip.xyz);
    }
    return clip;
}

// From the camera's axes to clip space, by a paraboloid mapping (Brabec et al. 2002). The half space in front of the
// camera is mapped to a disc as wide as the picture, and depth is the distance.
fn paraboloid_position(position: vec3<f32>) -> vec4<f32> {
    let distance = length(position);
    let forward = -position.z / max(distance, 1e-30);
    let depth = (view.far - distance) / (view.far - view.near);
    // The mapping is singular straight behind the camera. Everything near that direction is outside of the picture and
    // clipped.
    let on_disc = position.xy / (max(distance, 1e-30) * max(1.0 + forward, 0.1));
    return vec4<f32>(on_disc, select(depth, -1.0, forward < -0.6), 1.0);
}

// A normal from object space to the world's axes, of unit length; 0 if there is none. The cofactors of a scale need no
// division, so it works for a scale of 0 along one axis too.
fn world_normal(object: Object, normal: vec3<f32>) -> vec3<f32> {
    // Products of the unnormalized scale could leave the range of f32.
    let sizes = abs(object.scale);
    let largest = max(max(sizes.x, sizes.y), sizes.z);
    let scale = select(vec3<f32>(1.0), object.scale / largest, largest > 0.0);
    let cofactors = scale.yzx * scale.zxy;
    let mirrored = select(1.0, -1.0, scale.x * scale.y * scale.z < 0.0);
    let turned = rotate(object.orientation, mirrored * cofactors * normal);
    let length_squared = dot(turned, turned);
    return select(vec3<f32>(0.0), turned * inverseSqrt(length_squared), length_squared > 0.0);
}

// Where a cube map of `Camera::cube_faces` is to be sampled for what lies in a direction of the world.
fn cube_direction(direction: vec3<f32>) -> vec3<f32> {
    return vec3<f32>(direction.xy, -direction.z);
}

// A pixel's position relative to the camera, along the world's axes, from its depth.
fn position_from_depth(clip: vec2<f32>, depth: f32) -> vec3<f32> {
    let across = clip.x * view.right + clip.y * view.up;
    if view.projection == PERSPECTIVE {
        let ray = across + view.forward;
        let matrix = view.clip_from_relative;
        // 0 unless the near plane is oblique.
        let depth_at_infinity = dot(vec3<f32>(matrix[0].z, matrix[1].z, matrix[2].z), ray);
        return ray * (matrix[3].z / max(depth - depth_at_infinity, 0.0));
    }
    return across + view.forward * mix(view.far, view.near, depth);
}

// A pixel's clip coordinates, from (-1, -1) at the picture's lower left to (1, 1) at its upper right.
fn clip_of_pixel(position: vec4<f32>) -> vec2<f32> {
    return position.xy / vec2<f32>(view.width, view.height) * vec2<f32>(2.0, -2.0) + vec2<f32>(-1.0, 1.0);
}

// The direction from a position towards the eye, of unit length.
fn direction_to_eye(relative: vec3<f32>) -> vec3<f32> {
    if view.projection == PERSPECTIVE {
        return -normalize(relative);
    }
    return -view.forward;
}

// The exact difference of two fixed-point positions, rounded once, in metres.
fn fixed_difference(low: vec3<u32>, high: vec3<i32>, from_low: vec3<u32>, from_high: vec3<i32>) -> vec3<f32> {
    let borrow = select(vec3<i32>(0), vec3<i32>(1), low < from_low);
    let difference_low = low - from_low;
    let difference_high = high - from_high - borrow;
    // The magnitude is converted, because both halves of a small negative number are large.
    let negative = difference_high < vec3<i32>(0);
    let carry = select(vec3<u32>(0u), vec3<u32>(1u), difference_low == vec3<u32>(0u));
    let magnitude_low = select(difference_low, ~difference_low + 1u, negative);
    let high_bits = bitcast<vec3<u32>>(difference_high);
    let magnitude_high = select(high_bits, ~high_bits + carry, negative);
    let magnitude = vec3<f32>(magnitude_high) * 4.0 + vec3<f32>(magnitude_low) * 0x1p-30;
    return select(magnitude, -magnitude, negative);
}

// A fixed-point position in the world, rounded to f32: in steps of 6 cm at 1,000 km.
fn metres_from_origin(low: vec3<u32>, high: vec3<i32>) -> vec3<f32> {
    return fixed_difference(low, high, vec3<u32>(0u), vec3<i32>(0));
}

// Whether a material has a texture of this index, from 0 to 5, and it is on the device.
fn has_texture(material: Material, index: u32) -> bool {
    return material.textures[index] != NO_TEXTURE;
}

// A texture of a material, by its index from 0 to 5, at texture coordinates; white if it has none. The caller takes the
// derivatives of `uv`, because that needs uniform control flow.
fn texture_at(material: Material, index: u32, uv: vec2<f32>, uv_dx: vec2<f32>, uv_dy: vec2<f32>) -> vec4<f32> {
    let texture = material.textures[index];
    let layer = texture & 0xffffffu;
    switch texture >> 24u {
        case 0u: { return textureSampleGrad(textures_0, sampler_0, uv, layer, uv_dx, uv_dy); }
        case 1u: { return textureSampleGrad(textures_1, sampler_1, uv, layer, uv_dx, uv_dy); }
        case 2u: { return textureSampleGrad(textures_2, sampler_2, uv, layer, uv_dx, uv_dy); }
        case 3u: { return textureSampleGrad(textures_3, sampler_3, uv, layer, uv_dx, uv_dy); }
        case 4u: { return textureSampleGrad(textures_4, sampler_4, uv, layer, uv_dx, uv_dy); }
        case 5u: { return textureSampleGrad(textures_5, sampler_5, uv, layer, uv_dx, uv_dy); }
        default: { return vec4<f32>(1.0); }
    }
}

// The same from mip level 0.
fn texture_level_0(material: Material, index: u32, uv: vec2<f32>) -> vec4<f32> {
    let texture = material.textures[index];
    let layer = texture & 0xffffffu;
    switch texture >> 24u {
        case 0u: { return textureSampleLevel(textures_0, sampler_0, uv, layer, 0.0); }
        case 1u: { return textureSampleLevel(textures_1, sampler_1, uv, layer, 0.0); }
        case 2u: { return textureSampleLevel(textures_2, sampler_2, uv, layer, 0.0); }
        case 3u: { return textureSampleLevel(textures_3, sampler_3, uv, layer, 0.0); }
        case 4u: { return textureSampleLevel(textures_4, sampler_4, uv, layer, 0.0); }
        case 5u: { return textureSampleLevel(textures_5, sampler_5, uv, layer, 0.0); }
        default: { return vec4<f32>(1.0); }
    }
}

// A material's diffuse colour and opacity at texture coordinates, with their derivatives.
fn diffuse_at(material: Material, uv: vec2<f32>, uv_dx: vec2<f32>, uv_dy: vec2<f32>) -> vec4<f32> {
    return vec4<f32>(material.diffuse, material.opacity) * texture_at(material, 0u, uv, uv_dx, uv_dy);
}

// Whether a mask has a hole at texture coordinates. It is read at the texture's full resolution, because an averaged
// alpha may be below the cutoff everywhere: leaves would vanish in the distance.
fn is_cut_out(material: Material, uv: vec2<f32>) -> bool {
    return material.opacity * texture_level_0(material, 0u, uv).a < material.alpha_cutoff;
}

// Texture coordinates of a vertex that can be interpolated.
fn bounded_uv(uv: vec2<f32>) -> vec2<f32> {
    return clamp(uv, vec2<f32>(-MAX_UV), vec2<f32>(MAX_UV));
}

// From here on all f32 are integers, so the fraction of a texture coordinate is 0. Near the end of the range of f32,
// interpolation and filtering would lead to NaN.
const MAX_UV: f32 = 0x1p23;

// A direction as a point of the unfolded octahedron, each coordinate from -1 to 1 (Cigolle et al. 2014).
fn octahedral_from_direction(direction: vec3<f32>) -> vec2<f32> {
    let point = direction.xy / (abs(direction.x) + abs(direction.y) + abs(direction.z));
    return select(fold(point), point, direction.z >= 0.0);
}

fn direction_from_octahedral(point: vec2<f32>) -> vec3<f32> {
    let z = 1.0 - abs(point.x) - abs(point.y);
    return normalize(vec3<f32>(select(fold(point), point, z >= 0.0), z));
}

fn fold(point: vec2<f32>) -> vec2<f32> {
    let sign = select(vec2<f32>(-1.0), vec2<f32>(1.0), point >= vec2<f32>(0.0));
    return (1.0 - abs(point.yx)) * sign;
}
