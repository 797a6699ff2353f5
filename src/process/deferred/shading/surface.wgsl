// A pixel of an object, as its vertices say: what shaders that draw objects have in common.
struct Surface {
    @invariant @builtin(position) clip: vec4<f32>,
    @location(0) relative: vec3<f32>,
    @location(1) normal: vec3<f32>,
    @location(2) uv: vec2<f32>,
    @location(3) @interpolate(flat) material: u32,
}

@vertex
fn vertex(in: VertexInput) -> Surface {
    let object = drawn_object(in.instance);
    let relative = relative_position(object, in.position);
    let uv = clamp(in.uv, vec2<f32>(-MAX_UV), vec2<f32>(MAX_UV));
    return Surface(clip_position(relative), relative, world_normal(object, in.normal), uv, object.material);
}

// From here on all f32 are whole numbers, and the texture is at its beginning. At the end of f32, interpolated and filtered, they
// would be no numbers any more.
const MAX_UV: f32 = 0x1p23;

// The normal of the side that is seen. To be called before the flow parts.
fn shading_normal(in: Surface, material: Material) -> vec3<f32> {
    // The triangle's own, of either sign.
    let across = cross(dpdx(in.relative), dpdy(in.relative));
    // Whichever way the triangle is wound, its visible side is the one that faces the camera.
    let to_eye = direction_to_eye(in.relative);
    let facing = unit_or(across * sign(dot(across, to_eye)), to_eye);
    let normal = unit_or(in.normal, facing);
    return select(normal, -normal, material.double_sided == 1u && dot(normal, facing) < 0.0);
}

// The diffuse colour and opacity of what is seen. To be called before the flow parts.
fn surface_diffuse(in: Surface, material: Material) -> vec4<f32> {
    return diffuse_at(material, in.uv, dpdx(in.uv), dpdy(in.uv));
}

// A vector brought to unit length, or another where it has no direction.
fn unit_or(vector: vec3<f32>, other: vec3<f32>) -> vec3<f32> {
    let length_squared = dot(vector, vector);
    let has_direction = length_squared > 0.0 && length_squared < 1e38;
    return select(other, vector * inverseSqrt(length_squared), has_direction);
}
