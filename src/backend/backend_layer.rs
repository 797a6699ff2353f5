//! A backend around another one.

use std::ops::Range;
use std::sync::Arc;

use super::backend_trait::{Backend, BackendExtras, FrameRecorder, ReadBack};
use super::error::BackendError;
use super::requests::{FrameFence, FrameRequest, PassRequest, SceneLimits, TargetMemory, ViewQueue};
use crate::command::DrawState;
use crate::process::{Draws, FramePlan};
use crate::quality::{Quality, VertexFormat};
use crate::scene::Mesh;
use crate::timeline::{Labels, TuningChoice};

type FrameOf<L> = <<L as BackendLayer>::Inner as FrameRecorder>::Frame;
type PartOf<L> = <<L as BackendLayer>::Inner as FrameRecorder>::Part;
type CommandsOf<L> = <<L as BackendLayer>::Inner as FrameRecorder>::Commands;
type SubmissionOf<L> = <<L as BackendLayer>::Inner as Backend>::Submission;

/// Declares the layer with the methods of these traits, and implements the traits for every layer. What is missing from
/// a list does not compile, because the traits have no default bodies.
macro_rules! backend_layer {
    (
        $(#[$attribute:meta])*
        trait BackendLayer;
        $(
            impl $trait:ident {
                $(type $associated:ident;)*
                $(fn $method:ident(&self $(, $argument:ident: $type:ty)*) -> $returned:ty;)*
            }
        )*
    ) => {
        $(#[$attribute])*
        pub trait BackendLayer: Send + Sync + 'static {
            /// The backend that it wraps.
            type Inner: Backend;

            /// The backend that it wraps.
            fn inner(&self) -> &Self::Inner;

            /// Forwards a call of this method. It surrounds all calls that have no implementation of their own: a layer
            /// that logs or times all calls implements this.
            #[inline]
            fn forward<R>(&self, method: &'static str, call: impl FnOnce() -> R) -> R {
                let _ = method;
                call()
            }

            $($(
                #[doc = concat!("Forwards [`", stringify!($trait), "::", stringify!($method), "`], with its errors.")]
                #[inline]
                fn $method(&self $(, $argument: $type)*) -> $returned {
                    self.forward(stringify!($method), || self.inner().$method($($argument),*))
                }
            )*)*
        }

        $(
            impl<L: BackendLayer> $trait for L {
                $(type $associated = <L::Inner as $trait>::$associated;)*

                $(
                    #[inline]
                    fn $method(&self $(, $argument: $type)*) -> $returned {
                        BackendLayer::$method(self $(, $argument)*)
                    }
                )*
            }
        )*
    };
}

backend_layer! {
    /// A backend that wraps another one, and forwards each call that it does not implement itself: every layer is a
    /// [`Backend`] with the frames of its inner backend. It needs only these two lines:
    ///
    /// ```
    /// use drawloom::backend::{Backend, BackendLayer};
    ///
    /// struct Unchanged<B>(B);
    ///
    /// impl<B: Backend> BackendLayer for Unchanged<B> {
    ///     type Inner = B;
    ///
    ///     fn inner(&self) -> &B {
    ///         &self.0
    ///     }
    /// }
    /// ```
    ///
    /// [`Backend::extras`] is forwarded as a whole. To change one of them, a layer implements [`BackendExtras`] with
    /// the [inner ones](BackendExtras::inner_extras), and returns itself from `extras`. `examples/logging_backend.rs`
    /// does both.
    ///
    /// An inner backend belongs to one renderer: what it keeps of views, it keeps by that renderer's identities.
    ///
    /// A backend whose frames, parts or commands are types of its own implements [`Backend`] and [`FrameRecorder`].
    trait BackendLayer;

    impl FrameRecorder {
        type Frame;
        type Part;
        type Commands;

        fn objects_epoch(&self, frame: &FrameOf<Self>) -> u64;
        fn upload_objects(
            &self,
            frame: &FrameOf<Self>,
            request: &FrameRequest<'_>,
            blocks: Range<usize>
        ) -> Result<(), BackendError>;
        fn prepare(&self, frame: &FrameOf<Self>, pass: &PassRequest<'_>) -> Result<(), BackendError>;
        fn part_count(&self, frame: &FrameOf<Self>, pass: &PassRequest<'_>) -> usize;
        fn record(
            &self,
            frame: &FrameOf<Self>,
            pass: &PassRequest<'_>,
            parts: Range<usize>,
            emit: &mut dyn FnMut(PartOf<Self>)
        ) -> Result<(), BackendError>;
        fn shares_encoder(&self, frame: &FrameOf<Self>, pass: usize) -> bool;
        fn finish(
            &self,
            frame: &FrameOf<Self>,
            passes: &[PassRequest<'_>],
            parts: &mut [Vec<PartOf<Self>>],
            emit: &mut dyn FnMut(CommandsOf<Self>)
        ) -> Result<(), BackendError>;
    }

    impl Backend {
        type Submission;

        fn adapter_name(&self) -> String;
        fn limits(&self) -> SceneLimits;
        fn check_mesh(&self, mesh: &Mesh, vertices: VertexFormat) -> Result<(), BackendError>;
        fn prepare_pipelines(
            &self,
            plan: &FramePlan,
            draws: &[Draws<'_>],
            states: &[Vec<DrawState>],
            quality: &Quality
        ) -> Result<(), BackendError>;
        fn begin(&self, request: &FrameRequest<'_>) -> Result<FrameOf<Self>, BackendError>;
        fn target_memory(&self, frame: &FrameOf<Self>) -> TargetMemory;
        fn recording_choice(
            &self,
            frame: &FrameOf<Self>,
            pass: usize,
            labels: &Arc<Labels>
        ) -> Option<TuningChoice>;
        fn read_back(
            &self,
            frame: &mut FrameOf<Self>,
            view: usize,
            target: &str
        ) -> Result<Box<dyn ReadBack>, BackendError>;
        fn submit(
            &self,
            frame: FrameOf<Self>,
            queues: Vec<ViewQueue<CommandsOf<Self>>>,
            fences: Vec<FrameFence>
        ) -> Result<SubmissionOf<Self>, BackendError>;
        fn extras(&self) -> &dyn BackendExtras;
    }
}
