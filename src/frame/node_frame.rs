//! What a CPU node sees of the frame.

use std::ops::{Deref, DerefMut};
use std::sync::Arc;

use bytemuck::Pod;
use parking_lot::RwLockReadGuard;

use super::node_accesses::NodeAccess;
use super::tables::FrameTables;
use super::{FrameData, NodeResource};
use crate::backend::FrameRequest;
use crate::command::DrawList;
use crate::scene::{GeneratedBuffer, GeneratedContents};
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

    /// A chunk of a buffer to fill: what it holds before is anything that earlier frames have left. All chunks with elements that
    /// [count](Self::set_count) must be filled in each frame.
    ///
    /// # Errors
    /// If no node of the frame declares that it [fills](super::NodeAccesses::fills) the buffer, or there is no such chunk.
    pub fn fill<T: Pod>(
        &self,
        buffer: &GeneratedBuffer<T>,
        chunk: usize,
    ) -> Result<impl DerefMut<Target = [T]> + use<'a, T>, UndeclaredFill> {
        let resource = buffer.into();
        self.contents(buffer).and_then(|contents| contents.fill(chunk)).ok_or(UndeclaredFill { resource, chunk })
    }

    /// A chunk of a buffer that other nodes have filled in this frame.
    ///
    /// # Errors
    /// If no node of the frame declares that it fills the buffer, or there is no such chunk.
    pub fn filled<T: Pod>(
        &self,
        buffer: &GeneratedBuffer<T>,
        chunk: usize,
    ) -> Result<impl Deref<Target = [T]> + use<'a, T>, UndeclaredFill> {
        let resource = buffer.into();
        self.contents(buffer).and_then(|contents| contents.read(chunk)).ok_or(UndeclaredFill { resource, chunk })
    }

    /// Sets how many elements of a buffer count in this frame, from the first one on. Without it all do.
    ///
    /// # Errors
    /// If no node of the frame declares that it fills the buffer.
    pub fn set_count<T: Pod>(&self, buffer: &GeneratedBuffer<T>, count: usize) -> Result<(), UndeclaredFill> {
        let contents = self.contents(buffer).ok_or(UndeclaredFill { resource: buffer.into(), chunk: 0 })?;
        contents.set_count(count);
        Ok(())
    }

    fn contents<T: Pod>(&self, buffer: &GeneratedBuffer<T>) -> Option<&'a GeneratedContents> {
        let identity = buffer.source().layout.identity;
        let is_it = |contents: &&Arc<GeneratedContents>| contents.layout().identity == identity;
        self.request.generated.iter().find(is_it).map(|contents| &**contents)
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

/// No node of the frame declares that it fills a buffer, or the buffer has no such chunk.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("no node of the frame declares that it fills {resource:?}, or it has no chunk {chunk}")]
pub struct UndeclaredFill {
    /// The buffer.
    pub resource: NodeResource,
    /// The chunk.
    pub chunk: usize,
}
