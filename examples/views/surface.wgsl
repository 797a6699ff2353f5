// Objects that show another view's picture. `const SHOW: u32` goes before it: 0 is a pool, 1 a portal, 2 a screen.

@group(2) @binding(1) var shown: texture_2d<f32>;

struct Corner {
    @invariant @builtin(position) position: vec4<f32>,
    @location(0) relative: vec3<f32>,
    @location(1) normal: vec3<f32>,
    @location(2) uv: vec2<f32>,
}

@vertex
fn vertex(in: VertexInput) -> Corner {
    let object = drawn_object(in.instance);
    let relative = relative_position(object, in.position);
    return Corner(clip_position(relative), relative, world_normal(object, in.normal), in.uv);
}

@fragment
fn fragment(in: Corner) -> @location(0) vec4<f32> {
    var share = in.position.xy / vec2<f32>(view.width, view.height);
    if SHOW == 0u {
        // A mirrored camera sees left and right swapped.
        share.x = 1.0 - share.x;
    } else if SHOW == 2u {
        share = in.uv;
    }
    let other = textureSampleLevel(shown, target_sampler, share, 0.0);
    // Where there is no such view, even alpha is 0.
    let color = select(vec3<f32>(0.02, 0.01, 0.05), other.rgb, other.a > 0.0);
    if SHOW != 0u {
        return vec4<f32>(color, 1.0);
    }
    let grazing = 1.0 - max(dot(direction_to_eye(in.relative), in.normal), 0.0);
    let reflected = 0.25 + 0.75 * grazing * grazing * grazing;
    return vec4<f32>(mix(vec3<f32>(0.01, 0.03, 0.035), color, reflected), 1.0);
}
