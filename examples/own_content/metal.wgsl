struct Metal {
    color: vec3<f32>,
    roughness: f32,
}

@group(3) @binding(0) var<storage, read> metals: array<Metal>;
@group(3) @binding(1) var base_colors: texture_2d<f32>;
@group(3) @binding(2) var normals: texture_2d<f32>;
@group(3) @binding(3) var metalness_and_roughness: texture_2d<f32>;
@group(3) @binding(4) var repeat: sampler;

struct Corner {
    @invariant @builtin(position) clip: vec4<f32>,
    @location(0) relative: vec3<f32>,
    @location(1) normal: vec3<f32>,
    @location(2) tangent: vec4<f32>,
    @location(3) uv: vec2<f32>,
    @location(4) color: vec3<f32>,
    @location(5) @interpolate(flat) material: u32,
}

@vertex
fn vertex(in: VertexInput) -> Corner {
    let object = drawn_object(in.instance);
    let relative = relative_position(object, in.position);
    let turned = rotate(object.orientation, object.scale * in.tangent.xyz);
    let normal = world_normal(object, in.normal);
    // A mirror turns the third axis around.
    let mirror = select(1.0, -1.0, object.scale.x * object.scale.y * object.scale.z < 0.0);
    let tangent = vec4<f32>(turned, in.tangent.w * mirror);
    return Corner(clip_position(relative), relative, normal, tangent, in.uv, in.colour.rgb, object.material);
}

@fragment
fn fragment(in: Corner) -> @location(0) vec4<f32> {
    let metal = metals[in.material];
    let base = textureSample(base_colors, repeat, in.uv).rgb * in.color * metal.color;
    let bump = textureSample(normals, repeat, in.uv).xyz * 2.0 - 1.0;
    let surface = textureSample(metalness_and_roughness, repeat, in.uv);
    let metalness = surface.r;
    let roughness = clamp(surface.g * metal.roughness, 0.05, 1.0);

    // From the tangent space of the texture to the world's axes.
    let smooth_normal = normalize(in.normal);
    let tangent = normalize(in.tangent.xyz - smooth_normal * dot(in.tangent.xyz, smooth_normal));
    let bitangent = cross(smooth_normal, tangent) * in.tangent.w;
    let normal = normalize(tangent * bump.x + bitangent * bump.y + smooth_normal * bump.z);

    let to_eye = direction_to_eye(in.relative);
    let reflected_head_on = mix(vec3<f32>(0.04), base, metalness);
    let sky = mix(view.ambient * 0.5, view.ambient * 4.0 + 0.3, smoothstep(-0.3, 0.6, reflect(-to_eye, normal).y));
    var radiance = view.ambient * base * (1.0 - metalness) + reflected_head_on * sky * (1.0 - roughness * 0.7);
    for (var index = 0u; index < view.light_count; index++) {
        let light = lights[index];
        let illuminance = illuminance_from(light, in.relative, normal);
        let to_light = normalize(select(light.position - in.relative, -light.direction, light.kind == DIRECTIONAL));
        let diffuse = base * (1.0 - metalness) / PI;
        radiance += illuminance * (diffuse + specular(normal, to_eye, to_light, roughness, reflected_head_on));
    }
    return vec4<f32>(min(radiance, vec3<f32>(60000.0)), 1.0);
}

// The microfacet distribution of Trowbridge and Reitz, the visibility of Smith and Schlick, Schlick's Fresnel term:
// Karis, "Real Shading in Unreal Engine 4", 2013.
fn specular(
    normal: vec3<f32>,
    to_eye: vec3<f32>,
    to_light: vec3<f32>,
    roughness: f32,
    head_on: vec3<f32>,
) -> vec3<f32> {
    let halfway = normalize(to_eye + to_light);
    let n_h = max(dot(normal, halfway), 0.0);
    let n_v = max(dot(normal, to_eye), 1e-3);
    let n_l = max(dot(normal, to_light), 1e-3);
    let alpha = roughness * roughness;
    let spread = n_h * n_h * (alpha * alpha - 1.0) + 1.0;
    let distribution = alpha * alpha / (PI * spread * spread);
    let k = (roughness + 1.0) * (roughness + 1.0) / 8.0;
    let visibility = 1.0 / (4.0 * (n_l * (1.0 - k) + k) * (n_v * (1.0 - k) + k));
    let fresnel = head_on + (1.0 - head_on) * pow(1.0 - max(dot(to_eye, halfway), 0.0), 5.0);
    return distribution * visibility * fresnel;
}
