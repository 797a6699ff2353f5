struct Character {
    first_joint: u32,
    stoutness: f32,
}

@group(3) @binding(0) var<storage, read> characters: array<Character>;
@group(3) @binding(FIRST_RESOURCE) var<storage, read> joints: array<mat4x4<f32>>;

// The morph target, then both joints.
fn deform(in: VertexInput, object: Object) -> VertexInput {
    let character = characters[object.index];
    let morphed = in.position + character.stoutness * in.stout;
    let first = joints[character.first_joint + in.joints.x];
    let second = joints[character.first_joint + in.joints.y];
    let blended = first * (1.0 - in.weight) + second * in.weight;
    var out = in;
    out.position = (blended * vec4<f32>(morphed, 1.0)).xyz;
    out.normal = (blended * vec4<f32>(in.normal, 0.0)).xyz;
    return out;
}
