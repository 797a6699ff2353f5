@group(2) @binding(1) var<storage, read_write> arguments: vec4<u32>;

@compute @workgroup_size(1)
fn compute() {
    // Six vertices, and no instances yet.
    arguments = vec4<u32>(6u, 0u, 0u, 0u);
}
