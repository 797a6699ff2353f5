//! What a process declares, and its shader has no variable for.

use wgpu::naga::ResourceBinding;
use wgpu::naga::front::wgsl;

use crate::process::Declaration;
use crate::unwind::emit_unlocked;

/// Warns of the targets, buffers, columns and material types that a process declares and its shader, which compiles,
/// has no variable for. A declaration that has no use still orders processes, and keeps or uploads what it names.
pub(super) fn warn_of_unused_bindings(process: &str, declaration: &Declaration, before: &str, own: &[(&str, &str)]) {
    for (resource, ResourceBinding { group, binding }) in unused_bindings(declaration, before, own) {
        let process = process.to_owned();
        emit_unlocked(move || {
            tracing::warn!(
                target: "drawloom", %process,
                "declares {resource}, and its shader has no variable with @group({group}) @binding({binding})"
            );
        });
    }
}

/// The unused resources of a shader: a process's own texts of WGSL, each with what it is, behind what the crate puts
/// before them.
fn unused_bindings(declaration: &Declaration, before: &str, own: &[(&str, &str)]) -> Vec<(String, ResourceBinding)> {
    let mut unused: Vec<_> =
        declared_bindings(declaration).filter(|(_, binding)| !begins_a_line(own, *binding)).collect();
    // Parsing takes about as long as wgpu needs to make the module. Few shaders write their variables in another way.
    if !unused.is_empty() {
        let texts: Vec<_> = std::iter::once(before).chain(own.iter().map(|(_, text)| *text)).collect();
        match wgsl::parse_str(&texts.join("\n")) {
            Ok(module) => {
                let is_used = |binding| module.global_variables.iter().any(|(_, known)| known.binding == Some(binding));
                unused.retain(|(_, binding)| !is_used(*binding));
            }
            // It uses extensions of the language that only the device knows.
            Err(_) => unused.clear(),
        }
    }
    unused
}

/// What a process declares for its shader, each with its kind and name.
fn declared_bindings(declaration: &Declaration) -> impl Iterator<Item = (String, ResourceBinding)> {
    let targets = declaration.samples().map(|(_, target)| format!("target {target:?}"));
    let buffers = declaration.bound_buffers().map(|(buffer, _)| format!("the buffer {:?}", buffer.name));
    let columns = declaration.columns.iter().map(|column| format!("the column {:?}", column.name));
    let material_types = declaration.material_types.iter().map(|layout| format!("the material type {:?}", layout.name));
    let of_group = |group| move |(binding, resource)| (resource, ResourceBinding { group, binding });
    // Binding 0 of the process's group has its parameters.
    let in_process_group = (1..).zip(targets.chain(buffers)).map(of_group(2));
    in_process_group.chain((0..).zip(columns.chain(material_types)).map(of_group(3)))
}

/// Whether a line of a text begins with these attributes in their usual spelling.
fn begins_a_line(texts: &[(&str, &str)], ResourceBinding { group, binding }: ResourceBinding) -> bool {
    let attributes = format!("@group({group}) @binding({binding})");
    texts.iter().flat_map(|(_, text)| text.lines()).any(|line| line.trim_start().starts_with(&attributes))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::process::{Declare, StorageBuffer};
    use crate::scene::{MaterialType, ObjectColumn};

    #[test]
    fn resources_without_a_variable_are_found() {
        let mut declare = Declare::default();
        ["first", "second"].into_iter().for_each(|target| declare.samples(target));
        declare.samples_previous("first");
        declare.reads_buffer(StorageBuffer::<u32>::new("read", 1));
        declare.reads_arguments(StorageBuffer::<u32>::new("arguments", 1));
        declare.changes_buffer(StorageBuffer::<u32>::new("changed", 1));
        declare.reads_column(ObjectColumn::<f32>::new("tint"));
        declare.reads_materials(MaterialType::<f32>::new("metal"));
        let declaration = declare.finish();
        let before = "@group(0) @binding(1) var<storage, read> objects: array<u32>;";
        let found = |deformation: &str, shader: &str| -> Vec<_> {
            let unused = unused_bindings(&declaration, before, &[("deformation", deformation), ("shader", shader)]);
            unused
                .into_iter()
                .map(|(resource, ResourceBinding { group, binding })| (resource, group, binding))
                .collect()
        };
        let [first, second, previous] =
            [1, 2, 3].map(|binding| format!("@group(2) @binding({binding}) var t{binding}: texture_2d<f32>;\n"));
        let buffers = "@group(2) @binding(4) var<storage, read> counts: u32;
            @group(2) @binding(5) var<storage, read_write> changed: u32;\n";
        let tint = "@group(3) @binding(0) var<storage, read> tints: array<f32>;\n";
        let metal = "@group(3) @binding(1) var<storage, read> metals: array<f32>;\n";
        let all = format!("{first}{second}{previous}{buffers}{tint}");
        assert_eq!(found(metal, &all), []);
        // Written in other ways.
        let other = "@binding(4)\n@group(2) var<storage, read> counts: u32; const B = 4 + 1;
            /* */ @group(2) @binding(B) var<storage, read_write> changed: u32;\n";
        assert_eq!(found(metal, &all.replace(buffers, other)), []);
        let unused = [
            ("target \"second\"", 2, 2),
            ("target \"first of the frame before\"", 2, 3),
            ("the buffer \"changed\"", 2, 5),
            ("the column \"tint\"", 3, 0),
            ("the material type \"metal\"", 3, 1),
        ];
        let read = "@group(2) @binding(4) var<storage, read> counts: u32;\n";
        let fewer = format!("{first}// {second}{read}");
        assert_eq!(found("", &fewer), unused.map(|(resource, group, binding)| (resource.to_owned(), group, binding)));
    }
}
