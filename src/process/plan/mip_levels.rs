//! Which targets can have mip levels.

use std::borrow::Cow;

use super::{PlanError, PlannedProcess};
use crate::process::{Access, Declaration, list_names};

/// # Errors
/// If a process gives mip levels to a target that it does not create, or whose pixels have no mean.
pub(super) fn check_mip_levels(planned: &PlannedProcess) -> Result<(), PlanError> {
    let Declaration { accesses, multisampled, mipmapped, .. } = &planned.declaration;
    for target in mipmapped {
        let created = accesses.iter().find_map(|(name, access)| (name == target).then_some((access, access.format()?)));
        let problem = match created {
            None => {
                let problem = format!("it does not create it, only: {}", created_targets(&planned.declaration));
                return Err(mip_levels_error(planned, target, problem));
            }
            Some((Access::ClearDepthLayer(_), _)) => "it draws it in layers",
            Some(_) if multisampled.contains(target) => "it is multisampled",
            Some((_, format)) if format.is_depth_stencil() => "it holds depth or a stencil",
            Some((_, format)) if format.is_integer() => "it holds whole numbers",
            Some((_, format)) if !format.is_filterable() => "not every device filters its format",
            Some(_) => continue,
        };
        return Err(mip_levels_error(planned, target, problem));
    }
    Ok(())
}

pub(super) fn mip_levels_error(
    planned: &PlannedProcess,
    target: &str,
    problem: impl Into<Cow<'static, str>>,
) -> PlanError {
    PlanError::MipLevels { process: planned.name.clone(), target: target.to_owned(), problem: problem.into() }
}

/// The names of the targets that a process creates.
pub(super) fn created_targets(declaration: &Declaration) -> String {
    let created = declaration.accesses.iter().filter(|(_, access)| access.format().is_some());
    list_names(created.map(|(name, _)| name.as_str()))
}
