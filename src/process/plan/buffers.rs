//! The buffers that a plan's processes share.

use super::{PlanError, PlannedProcess};
use crate::process::{BufferAccess, BufferLayout};

/// The buffers that the processes use, each once, in the order in which they are first declared.
///
/// # Errors
/// If two processes disagree about the size of a buffer, or a process changes a buffer that it uses in another way too.
pub(super) fn buffers_of(processes: &[PlannedProcess]) -> Result<Vec<BufferLayout>, PlanError> {
    let mut buffers: Vec<BufferLayout> = Vec::new();
    for planned in processes {
        for (declared, access) in &planned.declaration.buffers {
            let uses = planned.declaration.buffers.iter().filter(|(used, _)| used.name == declared.name).count();
            if *access == BufferAccess::Change && uses > 1 {
                return Err(PlanError::BufferInUse { process: planned.name.clone(), buffer: declared.name });
            }
            match buffers.iter().find(|known| known.name == declared.name) {
                Some(known) if known != declared => {
                    let (process, buffer) = (planned.name.clone(), declared.name);
                    let (first, second) = (known.bytes, declared.bytes);
                    return Err(PlanError::ConflictingBuffers { process, buffer, first, second });
                }
                Some(_) => {}
                None => buffers.push(*declared),
            }
        }
    }
    Ok(buffers)
}
