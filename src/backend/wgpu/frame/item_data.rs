//! The bytes of the engine's own that go with items, on the device.

use crate::backend::wgpu::resources::{CountedQueue, MirroredBuffer};
use crate::backend::{BackendError, FrameRequest};
use crate::process::{ItemBindGroups, ItemSetId};

/// The data of each set of items that the engine lends, by index.
#[derive(Default)]
pub(crate) struct ItemData(Vec<DataOfSet>);

/// The data of one set of items, and what the engine made of its buffer.
struct DataOfSet {
    id: Option<ItemSetId>,
    buffer: MirroredBuffer,
    is_empty: bool,
    bind_groups: ItemBindGroups,
}

impl ItemData {
    /// Uploads the bytes that changed.
    ///
    /// # Errors
    /// If the device allows no buffer of that size.
    pub(crate) fn update(
        &mut self,
        device: &wgpu::Device,
        uploads: &CountedQueue,
        request: &FrameRequest<'_>,
    ) -> Result<(), BackendError> {
        self.0.resize_with(request.items.len(), DataOfSet::new);
        for (index, (set, lent)) in self.0.iter_mut().zip(request.items).enumerate() {
            set.is_empty = true;
            let Some(pass) = request.items_of_passes.iter().position(|of_pass| *of_pass == Some(index)) else {
                continue;
            };
            let process = &request.plan.processes()[request.passes[pass].process_index];
            let before = set.buffer.on_device.buffer().cloned();
            if !lent.data.is_empty() {
                set.is_empty = false;
                set.buffer.set(device, uploads, lent.data)?;
            }
            if ItemSetId::replace(&mut set.id, process.id, lent.views)
                || before.as_ref() != set.buffer.on_device.buffer()
            {
                set.bind_groups = ItemBindGroups::default();
            }
        }
        Ok(())
    }

    /// The buffer of a set of items, by index; `None` if it has no data.
    pub(crate) fn of_set(&self, set: usize) -> Option<&wgpu::Buffer> {
        let DataOfSet { buffer, is_empty, .. } = self.0.get(set)?;
        buffer.on_device.buffer().filter(|_| !is_empty)
    }

    /// The engine's bind groups for a set of items, by index.
    pub(crate) fn bind_groups_of_set(&self, set: usize) -> Option<&ItemBindGroups> {
        self.0.get(set).map(|set| &set.bind_groups)
    }

    /// The sizes of the buffers in bytes.
    pub(crate) fn sizes(&self) -> impl Iterator<Item = u64> {
        self.0.iter().map(|set| set.buffer.on_device.size())
    }
}

impl DataOfSet {
    fn new() -> Self {
        use wgpu::BufferUsages;
        let usages = BufferUsages::UNIFORM | BufferUsages::STORAGE | BufferUsages::VERTEX | BufferUsages::INDEX;
        let buffer = MirroredBuffer::new("items", usages);
        Self { id: None, buffer, is_empty: true, bind_groups: ItemBindGroups::default() }
    }
}
