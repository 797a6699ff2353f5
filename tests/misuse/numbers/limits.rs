//! Limits of backends, and what qualities say about errors.

use std::sync::Arc;

use drawloom::Renderer;
use drawloom::backend::{Backend, NullBackend, PipelineLibrary, SceneLimits, SoftwareBackend};
use drawloom::process::Deferred;
use drawloom::quality::{DepthCurve, DepthPrecision, RadianceSum, VertexFormat};
use drawloom::scene::Vertex;
use drawloom::task::Scheduler;
use drawloom::view::IssueReason;
use drawloom::view::internal::{GpuLight, GpuObject};
use drawloom_testing::adapter::noop_device;
use drawloom_testing::limited::LimitedBackend;
use libtest_mimic::Failed;

use super::NumberCase;
use crate::fixture::{COUNTS, FLOATS, Fixture, SIZES, ensure, same, scene, small_maps};

pub const CASES: &[NumberCase] = &[
    NumberCase {
        name: "backends_of_any_limits",
        numbers: &[
            "backend::SceneLimits::binding_bytes",
            "backend::SceneLimits::buffer_bytes",
            "backend::SceneLimits::max_objects",
            "backend::SceneLimits::texture_layers",
        ],
        check: limits,
    },
    NumberCase {
        name: "qualities_are_asked_for_any_error",
        numbers: &[
            "quality::DepthPrecision::quantize",
            "quality::DepthPrecision::step",
            "quality::RadianceSum::max_blended_error",
            "quality::RadianceSum::max_light_error",
            "quality::VertexFormat::max_uv_error",
        ],
        check: errors,
    },
];

/// Sizes around those of an object, of a light and of the box, and what overflows when it is added to or multiplied.
const BYTES: [u64; 13] = [0, 1, 63, 64, 255, 256, 767, 768, 4_096, u32::MAX as u64, 1 << 63, u64::MAX - 1, u64::MAX];

fn limits() -> Result<(), Failed> {
    let none = SceneLimits::NONE;
    let mut all = vec![SceneLimits { buffer_bytes: 0, binding_bytes: 0, texture_layers: 0 }];
    all.push(SceneLimits { buffer_bytes: u64::MAX, binding_bytes: u64::MAX, texture_layers: u32::MAX });
    for bytes in BYTES {
        all.push(SceneLimits { buffer_bytes: bytes, ..none });
        all.push(SceneLimits { binding_bytes: bytes, ..none });
        all.push(SceneLimits { buffer_bytes: bytes, binding_bytes: bytes, ..none });
        for stride in SIZES {
            let objects = u128::from(bytes) / stride.max(size_of::<GpuObject>()) as u128;
            let of_limits = SceneLimits { binding_bytes: bytes, ..none }.max_objects(stride);
            same(of_limits as u128, objects, format_args!("objects of {stride} bytes in {bytes}"))?;
        }
    }
    all.extend(COUNTS.into_iter().chain([5, 6]).map(|texture_layers| SceneLimits { texture_layers, ..none }));
    let (device, queue) = noop_device()?;
    let library = PipelineLibrary::new(device, queue);
    for limits in all {
        let scheduler = Arc::new(Scheduler::new(1)?);
        expect_within(NullBackend, limits, &scheduler)?;
        expect_within(library.backend()?, limits, &scheduler)?;
        expect_within(SoftwareBackend::new(Arc::clone(&scheduler)), limits, &scheduler)?;
    }
    Ok(())
}

/// Fails unless two frames of the usual scene leave out what has no room, and nothing else.
fn expect_within<B: Backend>(backend: B, limits: SceneLimits, scheduler: &Arc<Scheduler>) -> Result<(), Failed> {
    let (maps, object, light) = (6, size_of::<GpuObject>() as u64, size_of::<GpuLight>() as u64);
    let has_maps = limits.texture_layers >= maps;
    let lights = if has_maps { 1 + u64::from(maps) } else { 1 };
    let expected: Vec<_> = [
        (limits.binding_bytes < object, IssueReason::ObjectLimit),
        // Nothing asks what no object of the frame has.
        (
            limits.buffer_bytes < 24 * size_of::<Vertex>() as u64 && limits.binding_bytes >= object,
            IssueReason::UndrawableMesh,
        ),
        (limits.binding_bytes.min(limits.buffer_bytes) < lights * light, IssueReason::LightLimit),
        (!has_maps, IssueReason::ShadowMapLimit),
    ]
    .into_iter()
    .filter_map(|(is_left_out, reason)| is_left_out.then_some(reason))
    .collect();
    let is_drawn =
        !expected.iter().any(|reason| [IssueReason::ObjectLimit, IssueReason::UndrawableMesh].contains(reason));
    let builder = Renderer::builder(LimitedBackend::new(backend, limits)).pipeline(Deferred::to_picture());
    let (renderer, submitter) = builder.shadow_maps(small_maps()).build(Arc::clone(scheduler))?;
    let mut fixture = Fixture { renderer, submitter };
    for _ in 0..2 {
        let statistics = fixture.draw(&scene()).map_err(|failed| format!("{limits:?}: {failed:?}"))?.statistics;
        let found: Vec<_> = statistics.scene_issues.iter().map(|issue| issue.reason).collect();
        let is_same = found.len() == expected.len() && expected.iter().all(|reason| found.contains(reason));
        ensure(is_same, format_args!("{limits:?}: {found:?} instead of {expected:?}"))?;
        same(statistics.views[0].visible, usize::from(is_drawn), format_args!("objects within {limits:?}"))?;
    }
    Ok(())
}

fn errors() -> Result<(), Failed> {
    for count in COUNTS {
        for sum in [RadianceSum::HalfFloat, RadianceSum::Float, RadianceSum::Shader] {
            for error in [sum.max_light_error(count), sum.max_blended_error(count)] {
                ensure(
                    (error == 0.0) == (count == 0) && error.is_finite(),
                    format_args!("{error} of {count}, {sum:?}"),
                )?;
            }
        }
    }
    let floats = FLOATS.map(f64::from);
    for repeats in floats.into_iter().chain([f64::MAX, f64::MIN]) {
        let error = VertexFormat::Packed.max_uv_error(repeats);
        // At least half a texture is off by a half float's last bit.
        ensure(error >= 0.5 / 2048.0 || repeats.is_nan(), format_args!("{error} of {repeats}"))?;
        same(VertexFormat::Full.max_uv_error(repeats), 0.0, "without packing")?;
    }
    for (near, far) in FLOATS.into_iter().flat_map(|near| FLOATS.map(|far| (near, far))) {
        for curve in [DepthCurve::Logarithmic, DepthCurve::Linear { far }] {
            for bits in [0, 1, 20, 31, 32, 33, u32::MAX] {
                let key = DepthPrecision { bits, curve };
                let mut depths = FLOATS.map(|depth| if depth.is_nan() { f32::NEG_INFINITY } else { depth });
                depths.sort_by(f32::total_cmp);
                let codes = depths.map(|depth| key.quantize(depth, near, far));
                let what = || format!("{key:?} from {near} to {far}: {codes:?}");
                // Builders refuse linear codes of no distance.
                let is_valid = curve == DepthCurve::Logarithmic || far > 0.0;
                ensure(codes.is_sorted() || !is_valid, what())?;
                let unused = 32_u32.saturating_sub(bits);
                ensure(codes.iter().all(|code| code.trailing_zeros() >= unused), what())?;
                key.quantize(f32::NAN, near, far);
                let steps = FLOATS.map(|distance| key.step(distance, near, far));
                ensure(steps.iter().all(|step| *step >= 0.0), format_args!("{key:?} from {near} to {far}: {steps:?}"))?;
            }
        }
    }
    Ok(())
}
