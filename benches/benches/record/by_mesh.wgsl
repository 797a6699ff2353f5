// Follows draw_only.wgsl: a camera's list says which object an instance is.

@group(0) @binding(3) var<storage, read> instances: array<u32>;

fn object_index(instance: u32) -> u32 {
    return instances[instance];
}
