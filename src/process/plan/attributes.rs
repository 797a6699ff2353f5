//! The attributes of vertices that a plan's processes read.

use super::{PlanError, PlannedProcess};
use crate::process::DeclaredAttribute;

/// The attributes that the processes read, each once, in the order in which they are first declared.
///
/// # Errors
/// If two processes disagree about the format or the default of an attribute.
pub(super) fn attributes_of(processes: &[PlannedProcess]) -> Result<Vec<DeclaredAttribute>, PlanError> {
    let mut attributes: Vec<DeclaredAttribute> = Vec::new();
    for planned in processes {
        for declared in &planned.declaration.attributes {
            match attributes.iter().find(|known| known.layout.name == declared.layout.name) {
                Some(known) if known != declared => {
                    let (process, attribute) = (planned.name.clone(), declared.layout.name);
                    return Err(PlanError::ConflictingAttributes { process, attribute });
                }
                Some(_) => {}
                None => attributes.push(declared.clone()),
            }
        }
    }
    Ok(attributes)
}
