//! Draws of an engine's own: items that a process draws with the engine's own pipelines, bind groups and draw calls.

#[cfg(feature = "wgpu")]
use std::error::Error;
#[cfg(feature = "wgpu")]
use std::sync::OnceLock;

#[cfg(feature = "wgpu")]
use wgpu::util::RenderEncoder;

#[cfg(feature = "wgpu")]
use super::RawPassResources;
use crate::scene::{Changes, LayerMask, ViewKind};
use crate::view::{BoundingSphere, ItemColumns, RenderView};

/// Items that the engine lends with each frame, and records itself.
///
/// In each view of the process the frame finds the items that the view sees, brings them into order, divides them into
/// ranges, and has the engine's [`ItemRecorder`] record these on all workers.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ItemDraws {
    /// The order in which items are drawn.
    pub order: ItemOrder,
}

/// The order in which items are drawn: in the whole pass, whatever the number of workers.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ItemOrder {
    /// By key, ascending; items of equal keys as they are lent.
    #[default]
    ByKey,
    /// As they are lent.
    AsLent,
}

/// The items of a process in one frame: slices with one entry for each item, and the code that records them. They are
/// lent until [`Renderer::record_with`](crate::Renderer::record_with) returns, as the scene is.
///
/// An item is what the engine decides to draw as one: an object, one of its materials, a chunk of terrain.
///
/// ```
/// # #[cfg(feature = "wgpu")] {
/// use std::error::Error;
///
/// use drawloom::process::{
///     ClearColor, Declare, Draws, Format, ItemContext, ItemDraws, ItemRange, ItemRecorder, Items, RecordItems,
///     RenderProcess,
/// };
/// use drawloom::scene::SceneRef;
/// use drawloom::view::BoundingSphere;
/// use drawloom::wgpu::util::RenderEncoder;
/// use drawloom::{FrameInputs, wgpu};
///
/// /// Where the engine's draws go among the processes of a frame.
/// struct Trees;
///
/// impl RenderProcess for Trees {
///     fn name(&self) -> &str {
///         "trees"
///     }
///
///     fn declare(&self, declare: &mut Declare) {
///         declare.clears_color("picture", Format::Rgba8Unorm, ClearColor::Background);
///         declare.clears_depth("depth", Format::Depth32Float);
///     }
///
///     fn draws(&self) -> Draws<'_> {
///         Draws::Items(ItemDraws::default())
///     }
/// }
///
/// /// What the engine has of its trees.
/// struct Forest {
///     bounds: Vec<BoundingSphere>,
///     /// Of each tree: the index of its material. It is the key, so trees of one material follow each other.
///     materials: Vec<u64>,
///     pipeline: wgpu::RenderPipeline,
///     bind_groups: Vec<wgpu::BindGroup>,
///     vertex_count: u32,
/// }
///
/// impl RecordItems for Forest {
///     fn record<'e>(
///         &'e self,
///         encoder: &mut dyn RenderEncoder<'e>,
///         trees: ItemRange<'e>,
///         _: &'e ItemContext<'_>,
///     ) -> Result<(), Box<dyn Error + Send + Sync>> {
///         encoder.set_pipeline(&self.pipeline);
///         for (material, trees) in trees.runs() {
///             encoder.set_bind_group(0, Some(&self.bind_groups[material as usize]), &[]);
///             for &tree in trees {
///                 encoder.draw(0..self.vertex_count, tree..tree + 1);
///             }
///         }
///         Ok(())
///     }
/// }
///
/// impl Forest {
///     /// What the renderer gets for a frame: `renderer.record_with(FrameInputs { scene, nodes: &[], items: &[trees] })`.
///     fn lend(&self) -> Items<'_> {
///         Items { bounds: &self.bounds, ..Items::new("trees", &self.materials, ItemRecorder::Any(self)) }
///     }
/// }
/// # }
/// ```
#[derive(Clone, Copy)]
pub struct Items<'a> {
    /// The name of the process that draws them.
    pub process: &'a str,
    /// The views in which it draws them. Each view of the process has the items of one set.
    pub views: ItemViews<'a>,
    /// A key for each item, whose meaning is the engine's own: [`ItemOrder::ByKey`] orders by it, and [runs](ItemRange::runs)
    /// have one key. An engine puts into its high bits what is dearest to change, such as the pipeline.
    pub keys: &'a [u64],
    /// The bounding sphere of each item in the world, in metres; one with an infinite radius is seen by every view.
    /// Empty if all items are.
    pub bounds: &'a [BoundingSphere],
    /// The layers of each item: a view draws those that are in one of its
    /// [layers](crate::scene::Camera::layers). Empty if every item belongs to all.
    pub layers: &'a [LayerMask],
    /// A version of each item: items with the version that they had in an earlier frame are recorded to the same
    /// commands, with the same buffers, bind groups and pipelines; these, and [`Items::data`], may have other contents.
    /// The engine promises that, and builds with debug assertions check it. An item has another version if another
    /// object takes its index, or one of its bind groups is made anew: a number of the object and of its bind groups.
    /// Bundles of such items are kept. Empty if nothing is known about that: then all are recorded in every frame.
    pub versions: &'a [u64],
    /// Which items have another entry in one of these slices than in the [`Items`] that the same renderer was given for
    /// this process last, as for the [objects of a scene](crate::scene::SceneRef::changes). If it is
    /// [`Changes::Unknown`], or the number of items changes, all are compared. Builds with debug assertions check it.
    pub changes: Changes<'a>,
    /// Bytes of the engine's own for this frame, which its shaders read from [`ItemContext::data`]: transforms, instances
    /// of each item, uniforms. A multiple of 4; where shaders bind parts of it, these begin where the device's limits
    /// allow. What changed since an earlier frame is uploaded.
    pub data: &'a [u8],
    /// The code that records them.
    #[cfg(feature = "wgpu")]
    pub recorder: ItemRecorder<'a>,
}

/// The views for which a set of [`Items`] is lent.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum ItemViews<'a> {
    /// All views of the process.
    #[default]
    All,
    /// Those of a kind.
    OfKind(ViewKind),
    /// The view of this name, which is its [camera's](crate::scene::Camera::name).
    Named(&'a str),
}

impl ItemViews<'_> {
    pub(crate) fn contains(self, view: &RenderView) -> bool {
        match self {
            Self::All => true,
            Self::OfKind(kind) => view.kind() == kind,
            Self::Named(name) => view.name() == name,
        }
    }
}

impl<'a> Items<'a> {
    /// Items with these keys, which every view of the process sees, in all layers, and of which nothing else is known.
    pub fn new(process: &'a str, keys: &'a [u64], #[cfg(feature = "wgpu")] recorder: ItemRecorder<'a>) -> Self {
        Self {
            process,
            views: ItemViews::All,
            keys,
            bounds: &[],
            layers: &[],
            versions: &[],
            changes: Changes::Unknown,
            data: &[],
            #[cfg(feature = "wgpu")]
            recorder,
        }
    }

    pub(crate) fn columns(&self) -> ItemColumns<'a> {
        let Self { keys, bounds, layers, versions, changes, .. } = *self;
        ItemColumns { keys, bounds, layers, versions, changes }
    }
}

/// The engine's code that records items.
#[cfg(feature = "wgpu")]
#[derive(Clone, Copy)]
pub enum ItemRecorder<'a> {
    /// It records into whatever the frame chooses by measurement: passes, bundles, or bundles that are kept.
    Any(&'a dyn RecordItems),
    /// It sets what bundles have no commands for: viewport, scissor, stencil reference, blend constant. It records into
    /// passes only.
    Pass(&'a dyn RecordItemsInPass),
}

/// Code that records items into a pass or a bundle.
#[cfg(feature = "wgpu")]
pub trait RecordItems: Sync {
    /// Records a range of items, on any worker. Ranges of one pass are recorded in any order and at the same time, and
    /// executed in draw order.
    ///
    /// A range begins without pipeline, bind groups and buffers. The attachments are those that the process declares,
    /// in order. Memory that the code works with may be in a `thread_local!`: workers live as long as the scheduler.
    ///
    /// # Errors
    /// Any error of the engine. The frame fails, with an error that names process, view and range.
    fn record<'e>(
        &'e self,
        encoder: &mut dyn RenderEncoder<'e>,
        items: ItemRange<'e>,
        context: &'e ItemContext<'_>,
    ) -> Result<(), Box<dyn Error + Send + Sync>>;
}

/// Code that records items into a pass.
#[cfg(feature = "wgpu")]
pub trait RecordItemsInPass: Sync {
    /// Records a range of items, on any worker, as [`RecordItems::record`] does. A later range may find the state that an
    /// earlier one has left, so it sets all that it needs.
    ///
    /// # Errors
    /// Any error of the engine. The frame fails, with an error that names process, view and range.
    fn record<'e>(
        &'e self,
        pass: &mut wgpu::RenderPass<'e>,
        items: ItemRange<'e>,
        context: &'e ItemContext<'_>,
    ) -> Result<(), Box<dyn Error + Send + Sync>>;
}

/// What code that records items needs to know of the frame.
#[cfg(feature = "wgpu")]
pub struct ItemContext<'a> {
    /// The view: its camera, matrices and size.
    pub view: &'a RenderView,
    /// The device, the view's index, and what the process declares: its targets, buffers and columns. The bind groups are
    /// those of the [prelude](super::SHADER_PRELUDE), for shaders that use it.
    pub resources: RawPassResources<'a>,
    /// The formats of the colour attachments, in the order in which the process declares them, for the engine's
    /// pipelines.
    pub color_formats: &'a [Option<wgpu::TextureFormat>],
    /// The format of the attachment of depth and stencil, if the process declares one.
    pub depth_format: Option<wgpu::TextureFormat>,
    /// The number of samples of all attachments.
    pub sample_count: u32,
    /// The buffer with [`Items::data`] and the usages `UNIFORM`, `STORAGE`, `VERTEX` and `INDEX`, which may be longer;
    /// `None` if there are no data. Frames in flight have buffers of their own.
    pub data: Option<&'a wgpu::Buffer>,
    pub(crate) bind_groups: &'a ItemBindGroups,
}

/// Bind groups of the engine's that refer to a buffer of [`Items::data`].
#[cfg(feature = "wgpu")]
pub(crate) type ItemBindGroups = [OnceLock<wgpu::BindGroup>; ItemContext::MAX_BIND_GROUPS];

#[cfg(feature = "wgpu")]
impl ItemContext<'_> {
    /// The number of bind groups that a set of items can have for its [data](Self::data).
    pub const MAX_BIND_GROUPS: usize = 8;

    /// A bind group of the engine's with [`ItemContext::data`]. `make` makes it when it is asked for first, and again
    /// when the data has another buffer: in each frame in flight, and when it grows. Everything else that the bind group
    /// refers to stays the same, or has another index.
    ///
    /// ```
    /// use drawloom::process::ItemContext;
    /// use drawloom::wgpu;
    ///
    /// /// The bind group of shaders that read `Items::data`; `None` if there are no data.
    /// fn bind_data<'c>(
    ///     context: &'c ItemContext<'_>,
    ///     layout: &wgpu::BindGroupLayout,
    /// ) -> Option<&'c wgpu::BindGroup> {
    ///     let data = context.data?;
    ///     Some(context.bind_group(0, || {
    ///         context.resources.device.create_bind_group(&wgpu::BindGroupDescriptor {
    ///             label: Some("transforms"),
    ///             layout,
    ///             entries: &[wgpu::BindGroupEntry { binding: 0, resource: data.as_entire_binding() }],
    ///         })
    ///     }))
    /// }
    /// ```
    ///
    /// # Panics
    /// If the index is not less than [`Self::MAX_BIND_GROUPS`].
    pub fn bind_group(&self, index: usize, make: impl FnOnce() -> wgpu::BindGroup) -> &wgpu::BindGroup {
        self.bind_groups[index].get_or_init(make)
    }
}

/// A range of the items that a pass draws, in draw order.
#[derive(Clone, Copy, Debug)]
pub struct ItemRange<'a> {
    pub(crate) items: &'a [u32],
    pub(crate) keys: &'a [u64],
}

impl<'a> ItemRange<'a> {
    /// The items, by index among those that are lent.
    pub fn items(self) -> &'a [u32] {
        self.items
    }

    /// The items of each key: those that follow each other, to be drawn by one instanced draw, for example. A range may
    /// begin and end in the middle of a run.
    pub fn runs(self) -> impl Iterator<Item = (u64, &'a [u32])> {
        let Self { items, keys } = self;
        let runs = items.chunk_by(|one, next| keys[*one as usize] == keys[*next as usize]);
        runs.map(|run| (keys[run[0] as usize], run))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_run_has_the_items_of_one_key_that_follow_each_other() {
        let range = ItemRange { items: &[3, 1, 0, 2, 4], keys: &[7, 5, 7, 5, 5] };
        let runs: Vec<_> = range.runs().collect();
        assert_eq!(runs, [(5, &[3, 1][..]), (7, &[0, 2][..]), (5, &[4][..])]);
        assert_eq!(ItemRange { items: &[], ..range }.runs().count(), 0);
    }
}
