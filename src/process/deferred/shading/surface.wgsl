@vertex
fn vertex(in: VertexInput) -> Surface {
    let object = drawn_object(in.instance);
    let deformed = deform(in, object);
    var surface: Surface;
    surface.relative = relative_position(object, deformed.position);
    surface.clip = clip_position(surface.relative);
    surface.normal = world_normal(object, deformed.normal);
    surface.uv = bounded_uv(deformed.uv);
    surface.material = object.material;
    surface.object = object.index;
    set_color(&surface, deformed);
    return surface;
}

// The normal of the visible side. Needs uniform control flow.
fn shading_normal(in: Surface, material: Material) -> vec3<f32> {
    // The triangle's geometric normal, of either sign.
    let geometric = cross(dpdx(in.relative), dpdy(in.relative));
    // The visible side faces the camera, whatever the triangle's winding.
    let to_eye = direction_to_eye(in.relative);
    let facing = normalize_or(geometric * sign(dot(geometric, to_eye)), to_eye);
    let normal = normalize_or(in.normal, facing);
    return select(normal, -normal, material.double_sided == 1u && dot(normal, facing) < 0.0);
}

// The surface's diffuse colour and opacity. Needs uniform control flow.
fn surface_diffuse(in: Surface, material: Material) -> vec4<f32> {
    let diffuse = diffuse_at(material, in.uv, dpdx(in.uv), dpdy(in.uv));
    return vec4<f32>(diffuse.rgb * vertex_color(in), diffuse.a);
}

// A vector scaled to unit length, or another if it has no direction.
fn normalize_or(vector: vec3<f32>, other: vec3<f32>) -> vec3<f32> {
    let length_squared = dot(vector, vector);
    let has_direction = length_squared > 0.0 && length_squared < 1e38;
    return select(other, vector * inverseSqrt(length_squared), has_direction);
}
