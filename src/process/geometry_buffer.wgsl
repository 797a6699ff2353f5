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

    // Whichever way the triangle is wound, its visible side is the one that faces the camera.
    let facing = unit_or(across * -sign(dot(across, in.relative)), -normalize(in.relative));
    var normal = unit_or(in.normal, facing);
    if material.double_sided == 1u && dot(normal, facing) < 0.0 {
        normal = -normal;
    }
    let diffuse = diffuse_at(material, in.uv, gradient_x, gradient_y);
    return Targets(
        octahedral_from_direction(normal),
        vec4<f32>(diffuse.rgb, 1.0),
        // Past this a half float would be infinite.
        vec4<f32>(min(material.emission, vec3<f32>(60000.0)), 1.0),
    );
}

// A vector brought to unit length, or another where it has no direction.
fn unit_or(vector: vec3<f32>, other: vec3<f32>) -> vec3<f32> {
    let length_squared = dot(vector, vector);
    let has_direction = length_squared > 0.0 && length_squared < 1e38;
    return select(other, vector * inverseSqrt(length_squared), has_direction);
}
