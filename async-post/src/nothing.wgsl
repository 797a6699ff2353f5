@fragment
fn fragment(in: FullScreenPixel) -> @location(0) vec4<f32> {
    return vec4<f32>(0.0);
}
