// A sum of light in batches of 32, and in batches of 32 of these: a term is rounded with those of its batch, not with
// all that follow it.
struct LightBatches {
    sum: vec3<f32>,
    batches: vec3<f32>,
    batch: vec3<f32>,
    count: u32,
}

fn add_light(batches: ptr<function, LightBatches>, light: vec3<f32>) {
    (*batches).batch += light;
    (*batches).count++;
    if (*batches).count % 32u == 0u {
        (*batches).batches += (*batches).batch;
        (*batches).batch = vec3<f32>(0.0);
    }
    if (*batches).count % 1024u == 0u {
        (*batches).sum += (*batches).batches;
        (*batches).batches = vec3<f32>(0.0);
    }
}

fn sum_of_light(batches: LightBatches) -> vec3<f32> {
    return batches.sum + (batches.batches + batches.batch);
}

