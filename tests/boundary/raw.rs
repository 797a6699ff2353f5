//! Raw passes, on wgpu's own backend that draws nothing.

use std::error::Error;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;

use drawloom::backend::WgpuBackend;
use drawloom::process::{Declare, Deferred, Draws, InjectionPoint, RawPass, RawPassResources, RenderProcess};
use drawloom::task::Scheduler;
use drawloom::{Renderer, wgpu};
use drawloom_testing::adapter::noop_device;

use crate::frames::worlds;
use crate::fuse::{self, Kind, Owned, PLANNED, call};
use crate::within_time;

struct OwnRawPass {
    _dropped: Owned<()>,
}

impl RenderProcess for OwnRawPass {
    fn name(&self) -> &str {
        "the engine's raw pass"
    }

    fn declare(&self, declare: &mut Declare) {
        declare.at(InjectionPoint::AfterPostProcessing);
        declare.changes("picture");
        declare.keep();
    }

    fn draws(&self) -> Draws<'_> {
        Draws::Raw(self)
    }
}

impl RawPass for OwnRawPass {
    fn encode(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        resources: &RawPassResources<'_>,
    ) -> Result<(), Box<dyn Error + Send + Sync>> {
        resources.target("picture")?;
        // A pass of the encoder is open when it panics.
        let pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default());
        call(Kind::Step, "encode");
        drop(pass);
        Ok(())
    }
}

#[test]
fn a_panic_of_a_raw_pass_is_an_error_that_names_its_process() {
    within_time(|| {
        let [scene, _] = worlds();
        for workers in [1, 2] {
            let (device, queue) = noop_device().unwrap();
            let backend = WgpuBackend::new(device, queue).unwrap();
            let raw = OwnRawPass { _dropped: Owned::new("raw pass", ()) };
            let builder = Renderer::builder(backend).pipeline(Deferred::to_picture()).process(raw);
            let (mut renderer, submitter) = builder.build(Arc::new(Scheduler::new(workers).unwrap())).unwrap();
            for index in 0..4 {
                // The frame has two views.
                let has_text = index % 4 < 2;
                fuse::arm(Kind::Step, index % 2, has_text);
                let recorded = catch_unwind(AssertUnwindSafe(|| renderer.record(scene.as_scene_ref()).map(drop)));
                assert_eq!(fuse::disarm(), Some("encode"));
                let error = recorded.expect("it unwinds").unwrap_err().to_string();
                assert!(error.contains("the engine's raw pass") && error.contains("panicked"), "{error}");
                assert_eq!(error.contains(PLANNED), has_text, "{error}");
                // The next frame draws both views.
                fuse::arm(Kind::Step, 2, has_text);
                let recorded = renderer.record(scene.as_scene_ref()).unwrap();
                assert!(submitter.submit(recorded).unwrap().statistics.views.iter().all(|view| view.visible > 0));
                assert_eq!((fuse::calls().as_slice(), fuse::disarm()), (&["encode"; 2][..], None));
            }
            fuse::arm_each(Kind::Destructor);
            assert!(catch_unwind(AssertUnwindSafe(|| drop((renderer, submitter)))).is_ok());
            assert_eq!(fuse::disarm(), Some("raw pass"));
        }
    });
}
