fn bright(radiance: vec3<f32>) -> vec3<f32> {
    return radiance;
}
