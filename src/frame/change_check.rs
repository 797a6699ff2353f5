//! Finds objects, columns and layers that changed although the engine did not report it.

use crate::backend::FrameRequest;
use crate::process::Draws;
use crate::scene::{ColumnLayout, LayerMask, ObjectColumn, SceneError, SceneRef};
use crate::view::ObjectTable;

/// Copies of the columns that the latest frame read, and of the objects' layers. Only builds with debug assertions have
/// any.
#[derive(Debug, Default)]
pub(super) struct ChangeCheck {
    copies: Vec<(ColumnLayout, Vec<u8>)>,
}

/// The layers of objects are compared as a column is.
const LAYERS: ObjectColumn<LayerMask> = ObjectColumn::new("layers of objects");

impl ChangeCheck {
    /// Compares what a frame read of its objects with the frame before.
    ///
    /// # Errors
    /// If something changed, and the scene does not report its object.
    pub(super) fn check(&mut self, request: &FrameRequest<'_>) -> Result<(), SceneError> {
        let FrameRequest { plan, draws, scene, objects, .. } = *request;
        let mut columns = plan.columns().to_vec();
        columns.extend(draws.iter().filter_map(Draws::order_column));
        let unreported = objects.unreported_change(scene).map(|object| SceneError::UnreportedChange { object });
        let in_columns = self.check_columns(scene, &columns, objects);
        unreported.map_or(in_columns, Err)
    }

    /// Compares the columns that a frame read with those of the frame before, and copies them.
    ///
    /// # Errors
    /// If a value changed, and the scene does not report its object.
    fn check_columns(
        &mut self,
        scene: &SceneRef<'_>,
        columns: &[ColumnLayout],
        objects: &ObjectTable,
    ) -> Result<(), SceneError> {
        let layers = (!scene.layers.is_empty()).then(|| LAYERS.values(scene.layers));
        let checked: Vec<_> = columns.iter().filter_map(|layout| scene.column(*layout)).chain(layers).collect();
        self.copies.retain(|(layout, _)| checked.iter().any(|values| values.layout() == *layout));
        let mut outcome = Ok(());
        for values in checked {
            let (layout, bytes) = (values.layout(), values.bytes());
            let Some((_, copy)) = self.copies.iter_mut().find(|(known, _)| *known == layout) else {
                self.copies.push((layout, bytes.to_vec()));
                continue;
            };
            let elements = copy.chunks_exact(layout.stride).zip(bytes.chunks_exact(layout.stride));
            let changed = elements.enumerate().filter(|(_, (before, now))| before != now).map(|(object, _)| object);
            if let Some(object) =
                changed.take_while(|object| *object < objects.len()).find(|object| !objects.is_reported(*object))
            {
                outcome = outcome.and(Err(match layout == LAYERS.layout() {
                    true => SceneError::UnreportedChange { object },
                    false => SceneError::UnreportedColumnChange { column: layout.name, object },
                }));
            }
            copy.clear();
            copy.extend_from_slice(bytes);
        }
        outcome
    }
}
