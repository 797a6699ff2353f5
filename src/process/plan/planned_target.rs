//! The targets that a plan's processes use.

use super::{PlanError, PlannedProcess};
use crate::process::{Access, Format};
use crate::scene::ViewKind;

/// A target that each view of one kind has.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PlannedTarget {
    /// Its name.
    pub name: String,
    /// The kind of view.
    pub views: ViewKind,
    /// Its format.
    pub format: Format,
    /// Whether a raw pass may write it as a storage texture.
    pub stored: bool,
    /// Whether all views of the kind share it: one texture array, a layer for each view.
    pub layered: bool,
}

/// The targets of all processes, in the order in which they are first written.
///
/// # Errors
/// If processes disagree about a target's format or layers, or use depth as colour or colour as depth.
pub(super) fn targets_of(processes: &[PlannedProcess]) -> Result<Vec<PlannedTarget>, PlanError> {
    let mut targets: Vec<PlannedTarget> = Vec::new();
    for (planned, name, access) in accesses(processes) {
        let Some(format) = access.format() else { continue };
        let views = planned.declaration.views;
        let layered = matches!(access, Access::ClearDepthLayer(_));
        match targets.iter().find(|known| known.name == *name && known.views == views) {
            Some(known) if known.format != format => {
                return Err(PlanError::ConflictingFormats {
                    target: name.clone(),
                    first: known.format,
                    second: format,
                });
            }
            Some(known) if known.layered != layered => {
                return Err(PlanError::LayeringMismatch { process: planned.name.clone(), target: name.clone() });
            }
            Some(_) => {}
            None => targets.push(PlannedTarget { name: name.clone(), views, format, stored: false, layered }),
        }
    }
    for (planned, name, access) in accesses(processes) {
        let views = access.views(planned.declaration.views);
        let Some(known) = targets.iter_mut().find(|known| known.name == *name && known.views == views) else {
            continue;
        };
        let process = || planned.name.clone();
        known.stored |= matches!(access, Access::Write(_) | Access::Change) && known.format.can_be_stored();
        let draws_color = matches!(access, Access::ClearColor(..) | Access::DrawOver);
        if (access.is_depth() && !known.format.is_depth()) || (draws_color && known.format.is_depth()) {
            return Err(PlanError::WrongFormat { process: process(), target: name.clone(), format: known.format });
        }
        if matches!(access, Access::SampleLayers(_)) && !known.layered {
            return Err(PlanError::LayeringMismatch { process: process(), target: name.clone() });
        }
    }
    Ok(targets)
}

fn accesses(processes: &[PlannedProcess]) -> impl Iterator<Item = (&PlannedProcess, &String, Access)> {
    processes
        .iter()
        .flat_map(|planned| planned.declaration.accesses.iter().map(move |(target, access)| (planned, target, *access)))
}
