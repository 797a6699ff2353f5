struct Pose {
    first_joint: u32,
    first_weight: u32,
    first_target: u32,
    target_count: u32,
    vertex_count: u32,
}

@group(3) @binding(0) var<storage, read> poses: array<Pose>;
@group(3) @binding(FIRST_RESOURCE) var<storage, read> palette: array<mat4x4<f32>>;
// Nine numbers for each vertex of each morph target, and weights.
@group(3) @binding(FIRST_RESOURCE + 1u) var<storage, read> morphs: array<f32>;

// The morph targets, then the joints.
fn deform(in: VertexInput, object: Object) -> VertexInput {
    let pose = poses[object.index];
    var out = in;
    for (var target_index = 0u; target_index < pose.target_count; target_index++) {
        let weight = morphs[pose.first_weight + target_index];
        if weight != 0.0 {
            let first = pose.first_target + (target_index * pose.vertex_count + in.vertex_index) * 9u;
            out.position += weight * morph(first);
            out.normal += weight * morph(first + 3u);
            out.tangent += vec4<f32>(weight * morph(first + 6u), 0.0);
        }
    }
    var blended = mat4x4<f32>();
    for (var index = 0u; index < 4u; index++) {
        // Joints without weight need not exist.
        if in.weights[index] > 0.0 {
            blended += in.weights[index] * palette[pose.first_joint + in.joints[index]];
        }
    }
    out.position = (blended * vec4<f32>(out.position, 1.0)).xyz;
    out.tangent = vec4<f32>((blended * vec4<f32>(out.tangent.xyz, 0.0)).xyz, out.tangent.w);
    // The cofactors keep normals at right angles to surfaces, whatever the scale.
    let x = blended[0].xyz;
    let y = blended[1].xyz;
    let z = blended[2].xyz;
    let cofactors = mat3x3<f32>(cross(y, z), cross(z, x), cross(x, y));
    let normal = cofactors * out.normal * select(1.0, -1.0, dot(x, cofactors[0]) < 0.0);
    // Its length may leave the range of f32.
    let size = max(max(abs(normal.x), abs(normal.y)), abs(normal.z));
    out.normal = select(vec3<f32>(0.0), normal / size, size > 0.0);
    return out;
}

fn morph(first: u32) -> vec3<f32> {
    return vec3<f32>(morphs[first], morphs[first + 1u], morphs[first + 2u]);
}
