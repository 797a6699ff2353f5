//! How often a view is drawn.

/// How often a view is drawn. In a frame that does not draw it, the view is *cached*: it has no passes and costs no
/// time of any stage, and its targets hold what it drew last, for other views to
/// [sample](crate::process::Declare::samples_view) and for whoever reads them.
///
/// A cached view is drawn early if its targets do not hold that: in its first frame, if the size of its picture or the
/// number of layers that it shares changes, if an array that it is a layer of loses a view or is sampled in another
/// shape, if the plan or the quality changes, after a frame that failed or was dropped, and in each frame that imports
/// one of its targets (`WgpuBackend::import_target`). The histories of its targets are those of the frame that drew it
/// last. A process that draws [once a frame](crate::process::Declare::once_a_frame) does so in the first view that is
/// drawn.
///
/// The targets of a view that may be cached are never transient (`WgpuBackend::transient_targets`).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Redraw {
    /// In every frame.
    #[default]
    EveryFrame,
    /// In every n-th frame, n at least 1. Views of one interval take turns, in the order of the cameras, so that frames
    /// cost the same: their first redraw may come early. If the view samples other views, their age adds to its own.
    ///
    /// The stages of frames are kept by which views these draw, for 16 combinations. Intervals that divide each other,
    /// such as 2, 4 and 8, make few of them.
    Interval(u32),
    /// If the camera is not equal to the one that it was drawn with: for pictures of something at rest, such as an
    /// impostor, whose engine moves the camera when the picture is wrong by too much.
    OnCameraChange,
}

impl Redraw {
    /// Whether no frame leaves the view out.
    pub fn is_every_frame(self) -> bool {
        matches!(self, Self::EveryFrame | Self::Interval(1))
    }
}
