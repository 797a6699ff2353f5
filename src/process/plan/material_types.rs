//! The material types that a plan's processes read.

use super::{PlanError, PlannedProcess, ProcessError};
use crate::command::MaterialTypes;
use crate::process::Draws;
use crate::scene::MaterialLayout;

/// The material types that the processes read, each once, in the order in which they are first declared.
///
/// # Errors
/// If two processes disagree about the size of a type's values.
pub(super) fn material_types_of(processes: &[PlannedProcess]) -> Result<Vec<MaterialLayout>, PlanError> {
    let mut types: Vec<MaterialLayout> = Vec::new();
    for planned in processes {
        for declared in &planned.declaration.material_types {
            match types.iter().find(|known| known.name == declared.name) {
                Some(known) if known.stride != declared.stride => {
                    let (process, first, second) = (planned.name.clone(), known.stride, declared.stride);
                    return Err(PlanError::ConflictingMaterialTypes {
                        process,
                        material_type: declared.name,
                        first,
                        second,
                    });
                }
                Some(_) => {}
                None => types.push(*declared),
            }
        }
    }
    Ok(types)
}

/// Checks that the types of a scene's materials are those that the processes read and select.
///
/// # Errors
/// If the values of a type have another size.
pub(super) fn check_material_types(
    processes: &[PlannedProcess],
    draws: &[Draws<'_>],
    found: &[MaterialLayout],
) -> Result<(), ProcessError> {
    for (planned, draws) in processes.iter().zip(draws) {
        let selected = draws.selection().and_then(|selection| match selection.material_types {
            MaterialTypes::Only(selected) => Some(selected),
            MaterialTypes::Any | MaterialTypes::Shipped => None,
        });
        for declared in planned.declaration.material_types.iter().chain(&selected) {
            let other = found.iter().find(|found| found.name == declared.name && found.stride != declared.stride);
            if let Some(other) = other {
                let (process, material_type) = (planned.name.clone(), declared.name);
                let (declared, found) = (declared.stride, other.stride);
                return Err(ProcessError::MaterialTypeSize { process, material_type, declared, found });
            }
        }
    }
    Ok(())
}
