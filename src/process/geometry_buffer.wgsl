struct Surface {
    @builtin(position) clip: vec4<f32>,
    @location(0) relative: vec3<f32>,
    @location(1) normal: vec3<f32>,
    @location(2) uv: vec2<f32>,
    @location(3) @interpolate(flat) material: u32,
}

struct Targets {
    @location(0) normal: vec2<f32>,
    @location(1) diffuse: vec4<f32>,
    @location(2) radiance: vec4<f32>,
}

@vertex
fn vertex(in: VertexInput) -> Surface {
    let object = drawn_object(in.instance);
    let relative = relative_position(object, in.position);
    return Surface(clip_position(relative), relative, world_normal(object, in.normal), in.uv, object.material);
}

@fragment
fn fragment(in: Surface) -> Targets {
    // Taken before the flow parts.
    let gradient_x = dpdx(in.uv);
    let gradient_y = dpdy(in.uv);
    let across = cross(dpdx(in.relative), dpdy(in.relative));
    let material = materials[in.material];

    var normal = normalize(in.normal);
    if material.double_sided == 1u {
        // Whichever way the triangle is wound, its visible side is the one that faces the camera; the normal goes with it.
        let facing = across * -sign(dot(across, in.relative));
        normal *= select(1.0, -1.0, dot(normal, facing) < 0.0);
    }
    let diffuse = diffuse_at(material, in.uv, gradient_x, gradient_y);
    return Targets(
        octahedral_from_direction(normal),
        vec4<f32>(diffuse.rgb, 1.0),
        vec4<f32>(material.emission, 1.0),
    );
}
