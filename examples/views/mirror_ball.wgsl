@group(2) @binding(1) var surroundings: texture_cube<f32>;

struct Corner {
    @invariant @builtin(position) position: vec4<f32>,
    @location(0) relative: vec3<f32>,
    @location(1) normal: vec3<f32>,
}

@vertex
fn vertex(in: VertexInput) -> Corner {
    let object = drawn_object(in.instance);
    let relative = relative_position(object, in.position);
    return Corner(clip_position(relative), relative, world_normal(object, in.normal));
}

@fragment
fn fragment(in: Corner) -> @location(0) vec4<f32> {
    let reflected = reflect(-direction_to_eye(in.relative), normalize(in.normal));
    let color = textureSampleLevel(surroundings, target_sampler, cube_direction(reflected), 0.0).rgb;
    return vec4<f32>(color * vec3<f32>(0.9, 0.85, 0.75), 1.0);
}
