//! The buffers that a plan's processes share.

use super::{PlanError, PlannedProcess};
use crate::process::BufferLayout;

/// The buffers that the processes use, each once, in the order in which they are first declared.
///
/// # Errors
/// If two processes disagree about the size of a buffer.
pub(super) fn buffers_of(processes: &[PlannedProcess]) -> Result<Vec<BufferLayout>, PlanError> {
    let mut buffers: Vec<BufferLayout> = Vec::new();
    for planned in processes {
        for (declared, _) in &planned.declaration.buffers {
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
