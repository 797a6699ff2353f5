// Position in the world, and how much of its life is left.
@group(2) @binding(1) var<storage, read> sparks: array<vec4<f32>>;

struct Corner {
    @builtin(position) clip: vec4<f32>,
    @location(0) across: vec2<f32>,
    @location(1) color: vec3<f32>,
}

const RADIUS: f32 = 0.035;

@vertex
fn vertex(@builtin(vertex_index) vertex: u32, @builtin(instance_index) instance: u32) -> Corner {
    let spark = sparks[instance];
    let corner = vec2<f32>(f32((0x32u >> vertex) & 1u), f32((0x2cu >> vertex) & 1u)) * 2.0 - 1.0;
    let camera = metres_from_origin(view.position_low, view.position_high);
    let offset = (normalize(view.right) * corner.x + normalize(view.up) * corner.y) * RADIUS;
    let color = mix(vec3<f32>(0.9, 0.15, 0.02), vec3<f32>(1.0, 0.7, 0.25), spark.w) * spark.w;
    return Corner(clip_position(spark.xyz - camera + offset), corner, color);
}

@fragment
fn fragment(in: Corner) -> @location(0) vec4<f32> {
    let fade = max(1.0 - dot(in.across, in.across), 0.0);
    return vec4<f32>(in.color * fade * fade, 0.0);
}
