struct Grid {
    columns: u32,
    rows: u32,
    slices: u32,
    // Pixels.
    tile: f32,
    // Where the first slice begins, in metres.
    nearest: f32,
    // Slices per unit of the logarithm of the distance.
    slices_per_log: f32,
}

@group(2) @binding(0) var<uniform> grid: Grid;
// Where each cluster's lights begin; one more entry is the end of the last.
@group(2) @binding(1) var<storage, read> first_lights: array<u32>;
@group(2) @binding(2) var<storage, read> cluster_lights: array<u32>;

@fragment
fn fragment(in: Surface) -> @location(0) vec4<f32> {
    let material = materials[in.material];
    let diffuse = surface_diffuse(in, material).rgb;
    let normal = shading_normal(in, material);
    var illuminance = view.ambient * PI;
    let slice = floor(log(dot(in.relative, view.forward) / grid.nearest) * grid.slices_per_log);
    if slice >= 0.0 && slice < f32(grid.slices) {
        let tile = vec2<u32>(in.clip.xy / grid.tile);
        let cluster = (u32(slice) * grid.rows + tile.y) * grid.columns + tile.x;
        let end = first_lights[cluster + 1u];
        for (var index = first_lights[cluster]; index < end; index++) {
            illuminance += illuminance_from(lights[cluster_lights[index]], in.relative, normal);
        }
    }
    return vec4<f32>(material.emission + diffuse / PI * illuminance, 1.0);
}
