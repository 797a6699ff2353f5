//! The materials of the engine's own that a plan's processes read.

use super::{PlanError, PlannedProcess, ProcessError};
use crate::command::MaterialTypes;
use crate::process::Draws;
use crate::scene::MaterialLayout;

/// The types of materials that the processes read, each once, in the order in which they are first declared.
///
/// # Errors
/// If two processes disagree about the size of a type's values.
pub(super) fn materials_of(processes: &[PlannedProcess]) -> Result<Vec<MaterialLayout>, PlanError> {
    let mut materials: Vec<MaterialLayout> = Vec::new();
    for planned in processes {
        for declared in &planned.declaration.materials {
            match materials.iter().find(|known| known.name == declared.name) {
                Some(known) if known.bytes != declared.bytes => {
                    let (process, first, second) = (planned.name.clone(), known.bytes, declared.bytes);
                    return Err(PlanError::ConflictingMaterials { process, material: declared.name, first, second });
                }
                Some(_) => {}
                None => materials.push(*declared),
            }
        }
    }
    Ok(materials)
}

/// Checks that the types of a scene's materials are those that the processes read and select.
///
/// # Errors
/// If the values of a type have another size.
pub(super) fn check_materials(
    processes: &[PlannedProcess],
    draws: &[Draws<'_>],
    found: &[MaterialLayout],
) -> Result<(), ProcessError> {
    for (planned, draws) in processes.iter().zip(draws) {
        let selected = draws.selection().and_then(|selection| match selection.material_types {
            MaterialTypes::Only(selected) => Some(selected),
            MaterialTypes::Any | MaterialTypes::Shipped => None,
        });
        for declared in planned.declaration.materials.iter().chain(&selected) {
            let other = found.iter().find(|found| found.name == declared.name && found.bytes != declared.bytes);
            if let Some(other) = other {
                let (process, material) = (planned.name.clone(), declared.name);
                let (declared, found) = (declared.bytes, other.bytes);
                return Err(ProcessError::MaterialSize { process, material, declared, found });
            }
        }
    }
    Ok(())
}
