struct Lit {
    object: u32,
    light: u32,
}

struct LitSurface {
    @invariant @builtin(position) clip: vec4<f32>,
    @location(0) relative: vec3<f32>,
    @location(1) normal: vec3<f32>,
    @location(2) uv: vec2<f32>,
    @location(3) @interpolate(flat) material: u32,
    @location(4) @interpolate(flat) light: u32,
}

@group(2) @binding(0) var<storage, read> lit: array<Lit>;

@vertex
fn lit_vertex(in: VertexInput) -> LitSurface {
    let lit = lit[in.instance];
    let object = objects[lit.object];
    let relative = relative_position(object, in.position);
    let normal = world_normal(object, in.normal);
    return LitSurface(clip_position(relative), relative, normal, in.uv, object.material, lit.light);
}

@fragment
fn fragment(in: LitSurface) -> @location(0) vec4<f32> {
    // Taken before the flow parts.
    let gradient_x = dpdx(in.uv);
    let gradient_y = dpdy(in.uv);
    let material = materials[in.material];
    let normal = shading_normal(Surface(in.clip, in.relative, in.normal, in.uv, in.material, 0u), material);

    let illuminance = illuminance_from(lights[in.light], in.relative, normal);
    // As the deferred pipeline does.
    if all(illuminance == vec3<f32>(0.0)) {
        discard;
    }
    let diffuse = diffuse_at(material, in.uv, gradient_x, gradient_y).rgb;
    return vec4<f32>(diffuse / PI * illuminance, 0.0);
}
