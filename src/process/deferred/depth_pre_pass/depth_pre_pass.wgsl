@vertex
fn vertex(in: VertexInput) -> @invariant @builtin(position) vec4<f32> {
    let object = drawn_object(in.instance);
    return clip_position(relative_position(object, deform(in, object).position));
}

struct MaskedCorner {
    @invariant @builtin(position) clip: vec4<f32>,
    @location(0) uv: vec2<f32>,
    @location(1) @interpolate(flat) material: u32,
}

@vertex
fn masked_vertex(in: VertexInput) -> MaskedCorner {
    let object = drawn_object(in.instance);
    let deformed = deform(in, object);
    let clip = clip_position(relative_position(object, deformed.position));
    return MaskedCorner(clip, bounded_uv(deformed.uv), object.material);
}

@fragment
fn masked_fragment(in: MaskedCorner) {
    if is_cut_out(materials[in.material], in.uv) {
        discard;
    }
}
