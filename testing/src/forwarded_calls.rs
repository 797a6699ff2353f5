//! What backends that wrap another one have in common.

/// The methods of [`Backend`](drawloom::backend::Backend) that a wrapper of the backend `inner` forwards unchanged.
macro_rules! forward_unchanged_calls {
    () => {
        fn uploaded_bytes(&self) -> u64 {
            self.inner.uploaded_bytes()
        }

        fn discard_frame(&self) {
            self.inner.discard_frame();
        }

        fn forget_histories(&self) {
            self.inner.forget_histories();
        }

        fn imports_targets_of(&self, view: &str) -> bool {
            self.inner.imports_targets_of(view)
        }

        fn objects_epoch(&self, frame: &B::Frame) -> u64 {
            self.inner.objects_epoch(frame)
        }

        fn target_memory(&self, frame: &B::Frame) -> ::drawloom::backend::TargetMemory {
            self.inner.target_memory(frame)
        }

        fn has_background_work(&self) -> bool {
            self.inner.has_background_work()
        }

        fn work_in_background(&self) {
            self.inner.work_in_background();
        }

        fn counters(&self, count: &mut dyn FnMut(&'static str, f64)) {
            self.inner.counters(count);
        }

        fn read_back(
            &self,
            frame: &mut B::Frame,
            view: usize,
            target: &str,
        ) -> Result<Box<dyn ::drawloom::backend::ReadBack>, ::drawloom::backend::BackendError> {
            self.inner.read_back(frame, view, target)
        }

        fn part_count(&self, frame: &B::Frame, pass: &::drawloom::backend::PassRequest<'_>) -> usize {
            self.inner.part_count(frame, pass)
        }

        fn recording_choice(
            &self,
            frame: &B::Frame,
            pass: usize,
            labels: &::std::sync::Arc<::drawloom::timeline::Labels>,
        ) -> Option<::drawloom::timeline::TuningChoice> {
            self.inner.recording_choice(frame, pass, labels)
        }
    };
}

/// Those of them that say what the backend can hold and do.
macro_rules! forward_limits {
    () => {
        fn can_blend_floats(&self) -> bool {
            self.inner.can_blend_floats()
        }

        fn limits(&self) -> ::drawloom::backend::SceneLimits {
            self.inner.limits()
        }

        fn check_mesh(
            &self,
            mesh: &::drawloom::scene::Mesh,
            vertices: ::drawloom::quality::VertexFormat,
        ) -> Result<(), ::drawloom::backend::BackendError> {
            self.inner.check_mesh(mesh, vertices)
        }
    };
}

/// The methods that prepare, record and finish a frame, where a wrapper forwards them unchanged, too.
macro_rules! forward_recording_calls {
    () => {
        fn prepare_pipelines(
            &self,
            plan: &::drawloom::process::FramePlan,
            draws: &[::drawloom::process::Draws<'_>],
            states: &[Vec<::drawloom::command::DrawState>],
            quality: &::drawloom::quality::Quality,
        ) -> Result<(), ::drawloom::backend::BackendError> {
            self.inner.prepare_pipelines(plan, draws, states, quality)
        }

        fn begin(
            &self,
            request: &::drawloom::backend::FrameRequest<'_>,
        ) -> Result<B::Frame, ::drawloom::backend::BackendError> {
            self.inner.begin(request)
        }

        fn upload_objects(
            &self,
            worker: &::drawloom::task::Worker,
            frame: &B::Frame,
            request: &::drawloom::backend::FrameRequest<'_>,
            blocks: ::std::ops::Range<usize>,
        ) -> Result<(), ::drawloom::backend::BackendError> {
            self.inner.upload_objects(worker, frame, request, blocks)
        }

        fn prepare(
            &self,
            worker: &::drawloom::task::Worker,
            frame: &B::Frame,
            pass: &::drawloom::backend::PassRequest<'_>,
        ) -> Result<(), ::drawloom::backend::BackendError> {
            self.inner.prepare(worker, frame, pass)
        }

        fn record(
            &self,
            worker: &::drawloom::task::Worker,
            frame: &B::Frame,
            pass: &::drawloom::backend::PassRequest<'_>,
            parts: ::std::ops::Range<usize>,
            emit: &mut dyn FnMut(B::Part),
        ) -> Result<(), ::drawloom::backend::BackendError> {
            self.inner.record(worker, frame, pass, parts, emit)
        }

        fn finish(
            &self,
            worker: &::drawloom::task::Worker,
            frame: &B::Frame,
            pass: &::drawloom::backend::PassRequest<'_>,
            parts: &mut Vec<B::Part>,
        ) -> Result<B::Commands, ::drawloom::backend::BackendError> {
            self.inner.finish(worker, frame, pass, parts)
        }

        fn continues_previous_pass(&self, frame: &B::Frame, pass: usize) -> bool {
            self.inner.continues_previous_pass(frame, pass)
        }

        fn finish_together(
            &self,
            worker: &::drawloom::task::Worker,
            frame: &B::Frame,
            passes: &[::drawloom::backend::PassRequest<'_>],
            parts: &mut [Vec<B::Part>],
            emit: &mut dyn FnMut(B::Commands),
        ) -> Result<(), ::drawloom::backend::BackendError> {
            self.inner.finish_together(worker, frame, passes, parts, emit)
        }
    };
}

/// The implementation of [`UploadPicture`](drawloom_async_post::UploadPicture) for a wrapper of the backend `inner`.
macro_rules! forward_picture_uploads {
    ($wrapper:ident) => {
        impl<B: ::drawloom_async_post::UploadPicture> ::drawloom_async_post::UploadPicture for $wrapper<B> {
            fn upload_picture(
                &self,
                picture: &::drawloom::backend::Picture,
            ) -> Result<Option<::drawloom::process::ShaderResource<'static>>, ::drawloom::backend::BackendError> {
                ::drawloom_async_post::UploadPicture::upload_picture(&self.inner, picture)
            }
        }
    };
}

pub(crate) use {forward_limits, forward_picture_uploads, forward_recording_calls, forward_unchanged_calls};
