fn light_visibility(light: Light, position: vec3<f32>, normal: vec3<f32>) -> f32 {
    return 1.0;
}
