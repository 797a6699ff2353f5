struct View {
    clip_from_world: mat4x4<f32>,
    shadow_from_world: mat4x4<f32>,
    eye: vec4<f32>,
    towards_sun: vec4<f32>,
    // Nothing behind this plane is drawn.
    plane: vec4<f32>,
    size: vec4<f32>,
}

struct Instance {
    world_from_object: mat4x4<f32>,
    tint: vec4<f32>,
}

@group(0) @binding(0) var<uniform> view: View;
@group(0) @binding(1) var<storage, read> instances: array<Instance>;

@group(1) @binding(0) var colors: texture_2d<f32>;
@group(1) @binding(1) var details: texture_2d<f32>;
@group(1) @binding(2) var glosses: texture_2d<f32>;
@group(1) @binding(3) var material_sampler: sampler;

@group(2) @binding(0) var shadow_map: texture_depth_2d;
@group(2) @binding(1) var shadow_sampler: sampler_comparison;

struct Corner {
    @builtin(position) position: vec4<f32>,
    @location(0) world: vec3<f32>,
    @location(1) normal: vec3<f32>,
    @location(2) uv: vec2<f32>,
    @location(3) @interpolate(flat) tint: vec3<f32>,
}

@vertex
fn vertex(
    @builtin(instance_index) index: u32,
    @location(0) position: vec3<f32>,
    @location(1) normal: vec3<f32>,
    @location(2) uv: vec2<f32>,
) -> Corner {
    let instance = instances[index];
    let world = instance.world_from_object * vec4(position, 1.0);
    let turned = normalize((instance.world_from_object * vec4(normal, 0.0)).xyz);
    return Corner(view.clip_from_world * world, world.xyz, turned, uv, instance.tint.rgb);
}

fn lit(in: Corner, color: vec3<f32>, detail: vec3<f32>, gloss: f32) -> vec3<f32> {
    let shifted = view.shadow_from_world * vec4(in.world + in.normal * 0.05, 1.0);
    let shadow_uv = shifted.xy * vec2(0.5, -0.5) + 0.5;
    let sunlit = textureSampleCompareLevel(shadow_map, shadow_sampler, shadow_uv, shifted.z + 0.0005);
    let normal = normalize(in.normal + (detail * 2.0 - 1.0) * 0.3);
    let towards_eye = normalize(view.eye.xyz - in.world);
    let halfway = normalize(towards_eye + view.towards_sun.xyz);
    let shine = gloss * pow(max(dot(normal, halfway), 0.0), 32.0);
    let sun = sunlit * (color * max(dot(normal, view.towards_sun.xyz), 0.0) + shine);
    return color * vec3(0.25, 0.3, 0.4) + sun;
}

fn is_clipped(in: Corner) -> bool {
    return dot(view.plane, vec4(in.world, 1.0)) < 0.0;
}

@fragment
fn surface(in: Corner) -> @location(0) vec4<f32> {
    let color = textureSample(colors, material_sampler, in.uv).rgb * in.tint;
    let detail = textureSample(details, material_sampler, in.uv).rgb;
    let gloss = textureSample(glosses, material_sampler, in.uv).r;
    if is_clipped(in) {
        discard;
    }
    return vec4(lit(in, color, detail, gloss), 1.0);
}

@fragment
fn leaf(in: Corner) -> @location(0) vec4<f32> {
    let color = textureSample(colors, material_sampler, in.uv);
    let detail = textureSample(details, material_sampler, in.uv).rgb;
    let gloss = textureSample(glosses, material_sampler, in.uv).r;
    if color.a < 0.5 || is_clipped(in) {
        discard;
    }
    return vec4(lit(in, color.rgb * in.tint, detail, gloss), 1.0);
}

// The texture of colours is what the mirrored camera has drawn, with left and right swapped.
@fragment
fn mirror(in: Corner) -> @location(0) vec4<f32> {
    let detail = textureSample(details, material_sampler, in.uv * 8.0).rgb;
    let gloss = textureSample(glosses, material_sampler, in.uv).r;
    let across = in.position.xy / view.size.xy + (detail.xy - 0.5) * 0.01;
    let mirrored = textureSample(colors, material_sampler, vec2(1.0 - across.x, across.y)).rgb;
    return vec4(mix(lit(in, vec3(0.02, 0.05, 0.06), detail, gloss), mirrored, 0.7), 1.0);
}

@fragment
fn leaf_shadow(in: Corner) {
    if textureSample(colors, material_sampler, in.uv).a < 0.5 {
        discard;
    }
}
