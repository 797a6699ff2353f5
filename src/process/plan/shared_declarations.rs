//! What processes declare by name (columns, material types, vertex attributes and buffers), and whether a scene has it.

use super::{PlanError, PlannedProcess};
use crate::command::MaterialTypes;
use crate::process::{BufferAccess, BufferLayout, Declaration, DeclaredAttribute, Draws};
use crate::scene::{ColumnLayout, MaterialLayout, PREVIOUS_OBJECTS, SceneRef};

/// What a plan's processes declare, each name once, in the order in which it is first declared.
pub(super) struct SharedDeclarations {
    pub(super) columns: Vec<ColumnLayout>,
    pub(super) material_types: Vec<MaterialLayout>,
    pub(super) attributes: Vec<DeclaredAttribute>,
    pub(super) buffers: Vec<BufferLayout>,
}

impl SharedDeclarations {
    /// # Errors
    /// If two processes disagree about something of the same name, or a process changes a buffer that it uses in
    /// another way too.
    pub(super) fn new(processes: &[PlannedProcess]) -> Result<Self, PlanError> {
        Ok(Self {
            columns: each_once(processes, |declaration| &declaration.columns)?,
            material_types: each_once(processes, |declaration| &declaration.material_types)?,
            attributes: each_once(processes, |declaration| &declaration.attributes)?,
            buffers: each_once(processes, |declaration| &declaration.buffers)?
                .into_iter()
                .map(|(buffer, _)| buffer)
                .collect(),
        })
    }
}

/// What processes declare under a name that means the same to all of them.
trait SharedByName: Clone {
    fn name(&self) -> &'static str;

    /// # Errors
    /// If a process that declares this cannot: another one has declared `known` under the same name.
    fn check(&self, known: Option<&Self>, planned: &PlannedProcess) -> Result<(), PlanError>;
}

/// What the processes declare, each name once.
///
/// # Errors
/// If a process [cannot](SharedByName::check) declare it.
fn each_once<T: SharedByName>(
    processes: &[PlannedProcess],
    declared_by: impl Fn(&Declaration) -> &Vec<T>,
) -> Result<Vec<T>, PlanError> {
    let mut all: Vec<T> = Vec::new();
    for planned in processes {
        for declared in declared_by(&planned.declaration) {
            let known = all.iter().find(|known| known.name() == declared.name());
            declared.check(known, planned)?;
            if known.is_none() {
                all.push(declared.clone());
            }
        }
    }
    Ok(all)
}

impl SharedByName for ColumnLayout {
    fn name(&self) -> &'static str {
        self.name
    }

    fn check(&self, known: Option<&Self>, planned: &PlannedProcess) -> Result<(), PlanError> {
        let Some(known) = known.filter(|known| known.stride != self.stride) else { return Ok(()) };
        let (process, first, second) = (planned.name.clone(), known.stride, self.stride);
        Err(PlanError::ConflictingColumns { process, column: self.name, first, second })
    }
}

impl SharedByName for MaterialLayout {
    fn name(&self) -> &'static str {
        self.name
    }

    fn check(&self, known: Option<&Self>, planned: &PlannedProcess) -> Result<(), PlanError> {
        let Some(known) = known.filter(|known| known.stride != self.stride) else { return Ok(()) };
        let (process, first, second) = (planned.name.clone(), known.stride, self.stride);
        Err(PlanError::ConflictingMaterialTypes { process, material_type: self.name, first, second })
    }
}

impl SharedByName for DeclaredAttribute {
    fn name(&self) -> &'static str {
        self.layout.name
    }

    fn check(&self, known: Option<&Self>, planned: &PlannedProcess) -> Result<(), PlanError> {
        if known.is_none_or(|known| known == self) {
            return Ok(());
        }
        Err(PlanError::ConflictingAttributes { process: planned.name.clone(), attribute: self.layout.name })
    }
}

impl SharedByName for (BufferLayout, BufferAccess) {
    fn name(&self) -> &'static str {
        self.0.name
    }

    fn check(&self, known: Option<&Self>, planned: &PlannedProcess) -> Result<(), PlanError> {
        let (process, &(BufferLayout { name: buffer, bytes, .. }, access)) = (|| planned.name.clone(), self);
        let uses = planned.declaration.buffers.iter().filter(|(used, _)| used.name == buffer).count();
        if access == BufferAccess::Change && uses > 1 {
            return Err(PlanError::BufferInUse { process: process(), buffer });
        }
        let Some((known, _)) = known.filter(|(known, _)| *known != self.0) else { return Ok(()) };
        Err(PlanError::ConflictingBuffers { process: process(), buffer, first: known.bytes, second: bytes })
    }
}

/// Checks that a scene has the columns that the processes read, and those by which they order what they draw, but for
/// the one that backends have.
///
/// # Errors
/// If it lacks one, or its elements have another size.
pub(super) fn check_columns(
    processes: &[PlannedProcess],
    draws: &[Draws<'_>],
    scene: &SceneRef<'_>,
) -> Result<(), PlanError> {
    let read =
        processes.iter().flat_map(|planned| planned.declaration.columns.iter().map(move |&column| (planned, column)));
    let orders = processes.iter().zip(draws).filter_map(|(planned, draws)| Some((planned, draws.order_column()?)));
    for (planned, declared) in read.chain(orders).filter(|(_, column)| *column != PREVIOUS_OBJECTS.layout()) {
        let (process, column) = (|| planned.name.clone(), declared.name);
        match scene.columns.iter().find(|values| values.name() == column) {
            None => return Err(PlanError::MissingColumn { process: process(), column }),
            Some(values) if values.layout().stride != declared.stride => {
                let (declared, found) = (declared.stride, values.layout().stride);
                return Err(PlanError::ColumnSize { process: process(), column, declared, found });
            }
            Some(_) => {}
        }
    }
    Ok(())
}

/// Checks that the types of a scene's materials are those that the processes read and select.
///
/// # Errors
/// If the values of a type have another size.
pub(super) fn check_material_types(
    processes: &[PlannedProcess],
    draws: &[Draws<'_>],
    found: &[MaterialLayout],
) -> Result<(), PlanError> {
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
                return Err(PlanError::MaterialTypeSize { process, material_type, declared, found });
            }
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::super::FramePlan;
    use super::super::test_process::TestProcess;
    use crate::process::{Declare, RenderProcess, StorageBuffer};
    use crate::scene::{MaterialType, ObjectColumn, VertexAttribute};

    #[test]
    fn what_processes_read_alike_is_planned_once() {
        const COLUMN: ObjectColumn<u32> = ObjectColumn::new("number");
        const METAL: MaterialType<[f32; 4]> = MaterialType::new("metal");
        const WEIGHT: VertexAttribute<f32> = VertexAttribute::new("weight");
        const COUNTS: StorageBuffer<u32> = StorageBuffer::new("counts", 16);
        let process = |name, declare: fn(&mut Declare)| Arc::new(TestProcess(name, declare)) as Arc<dyn RenderProcess>;
        let reads = |declare: &mut Declare| {
            declare.reads_column(COLUMN);
            declare.reads_materials(METAL);
            declare.reads_attribute(WEIGHT, 1.0);
            // A buffer may be used in several ways, as long as none changes it.
            declare.reads_buffer(COUNTS);
            declare.reads_arguments(COUNTS);
            declare.keep();
        };
        let counts = process("counts", |declare| declare.changes_buffer(COUNTS));
        let plan = FramePlan::new(vec![counts, process("first", reads), process("second", reads)], &[]).unwrap();
        assert_eq!(plan.processes().len(), 3);
        assert_eq!(plan.columns().iter().map(|column| column.name).collect::<Vec<_>>(), ["number"]);
        assert_eq!(plan.material_types().iter().map(|found| found.name).collect::<Vec<_>>(), ["metal"]);
        assert_eq!(plan.attributes().iter().map(|found| found.layout.name).collect::<Vec<_>>(), ["weight"]);
        assert_eq!(plan.buffers().iter().map(|buffer| buffer.name).collect::<Vec<_>>(), ["counts"]);
    }
}
