//! Whether a device allows as many bindings in a shader as a process has.

use crate::backend::BackendError;

/// The bindings of a bind group, and what they are in messages.
pub(super) struct GroupBindings<'a> {
    pub(super) what: &'static str,
    pub(super) entries: &'a [wgpu::BindGroupLayoutEntry],
}

/// The limit of a kind of bindings: its name, which bindings it counts, and what a device allows.
type Kind = (&'static str, fn(&wgpu::BindingType) -> bool, fn(&wgpu::Limits) -> u32);

const KINDS: [Kind; 4] = [
    (
        "max_sampled_textures_per_shader_stage",
        |ty| matches!(ty, wgpu::BindingType::Texture { .. }),
        |limits| limits.max_sampled_textures_per_shader_stage,
    ),
    (
        "max_samplers_per_shader_stage",
        |ty| matches!(ty, wgpu::BindingType::Sampler(_)),
        |limits| limits.max_samplers_per_shader_stage,
    ),
    (
        "max_storage_buffers_per_shader_stage",
        |ty| is_buffer(ty, |ty| matches!(ty, wgpu::BufferBindingType::Storage { .. })),
        |limits| limits.max_storage_buffers_per_shader_stage,
    ),
    (
        "max_uniform_buffers_per_shader_stage",
        |ty| is_buffer(ty, |ty| ty == wgpu::BufferBindingType::Uniform),
        |limits| limits.max_uniform_buffers_per_shader_stage,
    ),
];

fn is_buffer(binding: &wgpu::BindingType, is_kind: impl FnOnce(wgpu::BufferBindingType) -> bool) -> bool {
    matches!(binding, wgpu::BindingType::Buffer { ty, .. } if is_kind(*ty))
}

const STAGES: [(&str, wgpu::ShaderStages); 3] = [
    ("vertex", wgpu::ShaderStages::VERTEX),
    ("fragment", wgpu::ShaderStages::FRAGMENT),
    ("compute", wgpu::ShaderStages::COMPUTE),
];

/// # Errors
/// If a shader of the process has more bindings of a kind than the device allows.
pub(super) fn check_binding_limits(
    limits: &wgpu::Limits,
    process: &str,
    groups: &[GroupBindings<'_>],
    is_compute: bool,
) -> Result<(), BackendError> {
    for (stage, visibility) in STAGES.into_iter().filter(|(stage, _)| (*stage == "compute") == is_compute) {
        for (limit, is_kind, allowed) in KINDS {
            let is_counted =
                |entry: &&wgpu::BindGroupLayoutEntry| entry.visibility.contains(visibility) && is_kind(&entry.ty);
            let count = |group: &GroupBindings<'_>| group.entries.iter().filter(is_counted).count();
            let (needed, allowed) = (groups.iter().map(count).sum::<usize>() as u64, u64::from(allowed(limits)));
            if needed > allowed {
                let shares = groups.iter().map(|group| (count(group), group.what)).filter(|(count, _)| *count > 0);
                let shares: Vec<_> = shares.map(|(count, what)| format!("{count} {what}")).collect();
                let (process, shares) = (process.to_owned(), shares.join(", "));
                return Err(BackendError::BindingLimit { process, stage, needed, shares, limit, allowed });
            }
        }
    }
    Ok(())
}
