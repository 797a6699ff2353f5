@group(2) @binding(1) var environment: texture_cube<f32>;

@fragment
fn fragment(in: FullScreenPixel) -> @location(0) vec4<f32> {
    let ray = in.clip.x * view.right + in.clip.y * view.up + view.forward;
    return textureSampleLevel(environment, target_sampler, cube_direction(ray), 0.0);
}
