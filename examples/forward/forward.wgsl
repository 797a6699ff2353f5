@fragment
fn fragment(in: Surface) -> @location(0) vec4<f32> {
    return lit(in);
}

@fragment
fn masked_fragment(in: Surface) -> @location(0) vec4<f32> {
    let color = lit(in);
    if is_cut_out(materials[in.material], in.uv) {
        discard;
    }
    return color;
}

// Needs uniform control flow.
fn lit(in: Surface) -> vec4<f32> {
    let material = materials[in.material];
    let normal = shading_normal(in, material);
    let diffuse = surface_diffuse(in, material);
    var illuminance = view.ambient * PI;
    for (var lamp = 0u; lamp < min(view.light_count, LAMPS); lamp++) {
        illuminance += illuminance_from(lights[lamp], in.relative, normal);
    }
    // A half float ends at 65,504.
    let radiance = min(material.emission + diffuse.rgb / PI * illuminance, vec3<f32>(60000.0));
    // Alpha blending multiplies by the opacity; what is added or subtracted does not.
    let covers = material.blend == 0u || material.blend == ALPHA;
    return vec4<f32>(select(radiance * diffuse.a, radiance, covers), diffuse.a);
}
