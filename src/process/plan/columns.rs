//! The columns of objects that a plan's processes read.

use super::{PlanError, PlannedProcess, ProcessError};
use crate::process::Draws;
use crate::scene::{ColumnLayout, SceneRef};

/// The columns that the processes read, each once, in the order in which they are first declared.
///
/// # Errors
/// If two processes disagree about the size of an element.
pub(super) fn columns_of(processes: &[PlannedProcess]) -> Result<Vec<ColumnLayout>, PlanError> {
    let mut columns: Vec<ColumnLayout> = Vec::new();
    for (planned, column) in declared_columns(processes) {
        match columns.iter().find(|known| known.name == column.name) {
            Some(known) if known.stride != column.stride => {
                let (process, first, second) = (planned.name.clone(), known.stride, column.stride);
                return Err(PlanError::ConflictingColumns { process, column: column.name, first, second });
            }
            Some(_) => {}
            None => columns.push(column),
        }
    }
    Ok(columns)
}

/// Checks that a scene has the columns that the processes read, and those by which they order what they draw.
///
/// # Errors
/// If it lacks one, or its elements have another size.
pub(super) fn check_columns(
    processes: &[PlannedProcess],
    draws: &[Draws<'_>],
    scene: &SceneRef<'_>,
) -> Result<(), ProcessError> {
    let orders = processes.iter().zip(draws).filter_map(|(planned, draws)| Some((planned, draws.order_column()?)));
    for (planned, declared) in declared_columns(processes).chain(orders) {
        let (process, column) = (|| planned.name.clone(), declared.name);
        match scene.columns.iter().find(|values| values.name() == column) {
            None => return Err(ProcessError::MissingColumn { process: process(), column }),
            Some(values) if values.layout().stride != declared.stride => {
                let (declared, found) = (declared.stride, values.layout().stride);
                return Err(ProcessError::ColumnSize { process: process(), column, declared, found });
            }
            Some(_) => {}
        }
    }
    Ok(())
}

fn declared_columns(processes: &[PlannedProcess]) -> impl Iterator<Item = (&PlannedProcess, ColumnLayout)> {
    processes.iter().flat_map(|planned| planned.declaration.columns.iter().map(move |&column| (planned, column)))
}
