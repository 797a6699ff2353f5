fn bright(radiance: vec3<f32>) -> vec3<f32> {
    return max(radiance - 1.0, vec3<f32>(0.0));
}
