//! What a CPU node sees of the frame.

use parking_lot::RwLockReadGuard;

use super::node_accesses::NodeAccess;
use super::tables::FrameTables;
use super::{FrameData, NodeResource};
use crate::backend::FrameRequest;
use crate::command::DrawList;
use crate::view::{RenderView, set_bits};

/// What a [`CpuNode`](super::CpuNode) sees of the frame while it runs: what it declares to read of it.
#[derive(Clone, Copy)]
pub struct NodeFrame<'a> {
    pub(super) request: &'a FrameRequest<'a>,
    pub(super) tables: &'a FrameTables,
    /// What the node declares.
    pub(super) accesses: &'a [NodeAccess],
}

impl<'a> NodeFrame<'a> {
    /// The views of the frame: those of cameras, in their order, and then shadow maps.
    pub fn views(&self) -> &'a [RenderView] {
        self.request.views
    }

    /// The objects that a view sees, by its index, in ascending order; none of a view in which no object is drawn.
    ///
    /// # Errors
    /// If the node does not declare that it reads [`FrameData::VisibleObjects`].
    ///
    /// # Panics
    /// If there is no such view.
    pub fn visible_objects(&self, view: usize) -> Result<impl Iterator<Item = usize> + use<'a>, UndeclaredRead> {
        self.check(FrameData::VisibleObjects)?;
        let set = &self.tables.visibility[view].set;
        let words = (0..set.word_count()).map(|word| (word, set.word(word)));
        Ok(words.flat_map(|(word, mask)| set_bits(mask).map(move |bit| word * u64::BITS as usize + bit)))
    }

    /// What a process draws in a view, by its index; `None` where it draws no commands.
    ///
    /// # Errors
    /// If the node does not declare that it reads [`FrameData::DrawLists`].
    pub fn draw_list(
        &self,
        process: &str,
        view: usize,
    ) -> Result<Option<RwLockReadGuard<'a, DrawList>>, UndeclaredRead> {
        self.check(FrameData::DrawLists)?;
        let FrameRequest { plan, passes, .. } = self.request;
        let name = |index: usize| plan.processes()[index].name.as_str();
        let pass = passes.iter().position(|pass| pass.view_index == view && name(pass.process_index) == process);
        let table = pass.map(|pass| &self.tables.passes[pass]);
        Ok(table.filter(|table| table.selection.is_some()).map(|table| table.list.read()))
    }

    fn check(&self, data: FrameData) -> Result<(), UndeclaredRead> {
        let resource = NodeResource::Frame(data);
        let is_declared = self.accesses.contains(&NodeAccess::Reads(resource));
        is_declared.then_some(()).ok_or(UndeclaredRead { resource })
    }
}

/// A node asks for something that it does not declare to read, so that it may not be there yet.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("the node does not declare that it reads {resource:?}")]
pub struct UndeclaredRead {
    /// What it asks for.
    pub resource: NodeResource,
}
