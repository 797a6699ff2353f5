struct TextureSlot {
    matrix: vec4<f32>,
    offset: vec2<f32>,
    // 1 for the second texture coordinates.
    coordinates: u32,
    padding: u32,
}

struct GltfMaterial {
    base_color: vec4<f32>,
    emission: vec3<f32>,
    alpha_cutoff: f32,
    metallic: f32,
    roughness: f32,
    normal_scale: f32,
    occlusion_strength: f32,
    flags: u32,
    padding_0: u32,
    padding_1: u32,
    padding_2: u32,
    base_color_texture: TextureSlot,
    metallic_roughness_texture: TextureSlot,
    normal_texture: TextureSlot,
    occlusion_texture: TextureSlot,
    emission_texture: TextureSlot,
}

// The places of the textures in Drawloom's materials.
const BASE_COLOR: u32 = 0u;
const METALLIC_ROUGHNESS: u32 = 1u;
const NORMAL: u32 = 2u;
const OCCLUSION: u32 = 3u;
const EMISSION: u32 = 4u;

const UNLIT: u32 = 1u;
const DOUBLE_SIDED: u32 = 2u;
const BLENDED: u32 = 4u;

struct Corner {
    @invariant @builtin(position) clip: vec4<f32>,
    @location(0) relative: vec3<f32>,
    @location(1) normal: vec3<f32>,
    @location(2) tangent: vec4<f32>,
    @location(3) uv: vec2<f32>,
    @location(4) second_uv: vec2<f32>,
    @location(5) color: vec4<f32>,
    @location(6) @interpolate(flat) material: u32,
}

@vertex
fn vertex(in: VertexInput) -> Corner {
    let object = drawn_object(in.instance);
    let deformed = deform(in, object);
    let relative = relative_position(object, deformed.position);
    // A mirror turns the third axis around.
    let mirror = select(1.0, -1.0, object.scale.x * object.scale.y * object.scale.z < 0.0);
    let tangent = rotate(object.orientation, object.scale * deformed.tangent.xyz);
    return Corner(
        clip_position(relative), relative, world_normal(object, deformed.normal),
        vec4<f32>(tangent, deformed.tangent.w * mirror),
        deformed.uv, deformed.second_uv, deformed.color, object.material,
    );
}

// The texture coordinates of a fragment, with their derivatives.
struct Coordinates {
    uv: vec2<f32>,
    uv_dx: vec2<f32>,
    uv_dy: vec2<f32>,
}

struct AllCoordinates {
    first: Coordinates,
    second: Coordinates,
}

// The shadows of surfaces with holes.
@fragment
fn caster(in: Corner) {
    if is_hole(in, gltf_materials[in.material]) {
        discard;
    }
}

// Whether there is no surface. Alpha is that of the whole image: its mean over a mip level may be below the cut-off
// everywhere, so that what is far away would vanish.
fn is_hole(in: Corner, material: GltfMaterial) -> bool {
    let first = Coordinates(in.uv, vec2<f32>(0.0), vec2<f32>(0.0));
    let second = Coordinates(in.second_uv, vec2<f32>(0.0), vec2<f32>(0.0));
    let used = placed(material.base_color_texture, AllCoordinates(first, second));
    let texel = texture_level_0(materials[in.material], BASE_COLOR, used.uv);
    return material.base_color.a * in.color.a * texel.a < material.alpha_cutoff;
}

// A texture of a fragment's material.
fn texel(in: Corner, place: u32, slot: TextureSlot, coordinates: AllCoordinates) -> vec4<f32> {
    let used = placed(slot, coordinates);
    return texture_at(materials[in.material], place, used.uv, used.uv_dx, used.uv_dy);
}

// Where a texture is sampled.
fn placed(slot: TextureSlot, coordinates: AllCoordinates) -> Coordinates {
    var used = coordinates.first;
    if slot.coordinates == 1u {
        used = coordinates.second;
    }
    let matrix = mat2x2<f32>(slot.matrix.xy, slot.matrix.zw);
    return Coordinates(matrix * used.uv + slot.offset, matrix * used.uv_dx, matrix * used.uv_dy);
}

@fragment
fn fragment(in: Corner) -> @location(0) vec4<f32> {
    let material = gltf_materials[in.material];
    // Derivatives need uniform control flow.
    let relative_dx = dpdx(in.relative);
    let relative_dy = dpdy(in.relative);
    let first = Coordinates(in.uv, dpdx(in.uv), dpdy(in.uv));
    let second = Coordinates(in.second_uv, dpdx(in.second_uv), dpdy(in.second_uv));
    let coordinates = AllCoordinates(first, second);

    let base = material.base_color * in.color * texel(in, BASE_COLOR, material.base_color_texture, coordinates);
    if material.alpha_cutoff > 0.0 && is_hole(in, material) {
        discard;
    }
    let opacity = select(1.0, clamp(base.a, 0.0, 1.0), (material.flags & BLENDED) != 0u);
    if (material.flags & UNLIT) != 0u {
        return vec4<f32>(min(base.rgb, vec3<f32>(60000.0)), opacity);
    }

    let to_eye = direction_to_eye(in.relative);
    let geometric = cross(relative_dx, relative_dy);
    let facing = normalize_or(geometric * sign(dot(geometric, to_eye)), to_eye);
    let smooth_normal = normalize_or(in.normal, facing);
    var normal = bumped_normal(in, material, coordinates, smooth_normal, relative_dx, relative_dy);
    var outward = smooth_normal;
    if (material.flags & DOUBLE_SIDED) != 0u && dot(smooth_normal, facing) < 0.0 {
        normal = -normal;
        outward = -outward;
    }

    let surface = texel(in, METALLIC_ROUGHNESS, material.metallic_roughness_texture, coordinates);
    let metallic = clamp(material.metallic * surface.b, 0.0, 1.0);
    let roughness = clamp(material.roughness * surface.g, 0.045, 1.0);
    let occluded = texel(in, OCCLUSION, material.occlusion_texture, coordinates).r;
    let occlusion = mix(1.0, occluded, material.occlusion_strength);
    let emission = material.emission * texel(in, EMISSION, material.emission_texture, coordinates).rgb;
    let head_on = mix(vec3<f32>(0.04), base.rgb, metallic);
    let diffuse = base.rgb * (1.0 - metallic);

    let n_v = clamp(dot(normal, to_eye), 1e-4, 1.0);
    var radiance = emission + view.ambient * occlusion * (diffuse + reflected_ambient(head_on, roughness, n_v));
    for (var index = 0u; index < view.light_count; index++) {
        let light = lights[index];
        let illuminance = punctual_illuminance(light, in.relative, normal);
        if any(illuminance > vec3<f32>(0.0)) {
            let to_light = normalize(select(light.position - in.relative, -light.direction, light.kind == DIRECTIONAL));
            let reflected = reflection(normal, to_eye, to_light, n_v, roughness, head_on, diffuse);
            radiance += illuminance * visibility(light, in.relative, outward) * reflected;
        }
    }
    return vec4<f32>(min(radiance, vec3<f32>(60000.0)), opacity);
}

// What a light sends to a surface, as `KHR_lights_punctual` has it: `illuminance_from` fades otherwise at the end of a
// range and of a cone.
fn punctual_illuminance(light: Light, position: vec3<f32>, normal: vec3<f32>) -> vec3<f32> {
    if light.kind == DIRECTIONAL {
        return illuminance_from(light, position, normal);
    }
    let to_light = light.position - position;
    let distance_squared = dot(to_light, to_light);
    if distance_squared == 0.0 || distance_squared >= light.range * light.range {
        return vec3<f32>(0.0);
    }
    let towards = to_light * inverseSqrt(distance_squared);
    var cone = 1.0;
    if light.kind == SPOT {
        cone = clamp((dot(-towards, light.direction) - light.cone_end) / (light.cone_begin - light.cone_end), 0.0, 1.0);
    }
    let fraction = distance_squared / (light.range * light.range);
    let factor = cone * cone * max(dot(normal, towards), 0.0) * (1.0 - fraction * fraction) / distance_squared;
    return min(light.intensity * min(factor, 1e30), MAX_ILLUMINANCE);
}

// The normal with that of the texture.
fn bumped_normal(
    in: Corner, material: GltfMaterial, coordinates: AllCoordinates, normal: vec3<f32>, relative_dx: vec3<f32>,
    relative_dy: vec3<f32>,
) -> vec3<f32> {
    let slot = material.normal_texture;
    if !has_texture(materials[in.material], NORMAL) {
        return normal;
    }
    let tilted = texel(in, NORMAL, slot, coordinates).xyz * 2.0 - 1.0;
    let bump = vec3<f32>(tilted.xy * material.normal_scale, tilted.z);
    var along_u = in.tangent.xyz;
    var sign = in.tangent.w;
    if sign == 0.0 {
        // The mesh has no tangents: from how position and texture coordinates change over the picture.
        let used = placed(slot, coordinates);
        let determinant = used.uv_dx.x * used.uv_dy.y - used.uv_dx.y * used.uv_dy.x;
        let turn = select(1.0, -1.0, determinant < 0.0);
        along_u = (used.uv_dy.y * relative_dx - used.uv_dx.y * relative_dy) * turn;
        let along_v = (used.uv_dx.x * relative_dy - used.uv_dy.x * relative_dx) * turn;
        // v grows downwards.
        sign = select(1.0, -1.0, dot(cross(normal, along_u), along_v) > 0.0);
    }
    let tangent = normalize_or(along_u - normal * dot(along_u, normal), vec3<f32>(0.0));
    let bitangent = cross(normal, tangent) * sign;
    return normalize_or(tangent * bump.x + bitangent * bump.y + normal * bump.z, normal);
}

// What a surface reflects of a light, for each unit of illuminance: appendix B of the glTF specification.
fn reflection(
    normal: vec3<f32>, to_eye: vec3<f32>, to_light: vec3<f32>, n_v: f32, roughness: f32, head_on: vec3<f32>,
    diffuse: vec3<f32>,
) -> vec3<f32> {
    let halfway = normalize_or(to_eye + to_light, normal);
    let n_h = clamp(dot(normal, halfway), 0.0, 1.0);
    let n_l = clamp(dot(normal, to_light), 1e-4, 1.0);
    let alpha = roughness * roughness;
    let squared = alpha * alpha;
    let spread = n_h * n_h * (squared - 1.0) + 1.0;
    let distribution = squared / (PI * spread * spread);
    let masking = n_l * sqrt(n_v * n_v * (1.0 - squared) + squared) + n_v * sqrt(n_l * n_l * (1.0 - squared) + squared);
    let fresnel = head_on + (1.0 - head_on) * pow(1.0 - clamp(dot(to_eye, halfway), 0.0, 1.0), 5.0);
    return (1.0 - fresnel) * diffuse / PI + fresnel * distribution * 0.5 / max(masking, 1e-6);
}

// What a glossy surface reflects of radiance that comes from everywhere: Karis, "Physically Based Shading on Mobile",
// 2014.
fn reflected_ambient(head_on: vec3<f32>, roughness: f32, n_v: f32) -> vec3<f32> {
    let r = roughness * vec4<f32>(-1.0, -0.0275, -0.572, 0.022) + vec4<f32>(1.0, 0.0425, 1.04, -0.04);
    let bent = min(r.x * r.x, exp2(-9.28 * n_v)) * r.x + r.y;
    return head_on * (bent * -1.04 + r.z) + bent * 1.04 + r.w;
}

fn normalize_or(vector: vec3<f32>, other: vec3<f32>) -> vec3<f32> {
    let size = max(max(abs(vector.x), abs(vector.y)), abs(vector.z));
    let scaled = vector / max(size, 1e-37);
    return select(other, scaled * inverseSqrt(max(dot(scaled, scaled), 1e-37)), size > 1e-37 && size < 1e37);
}
