//! Every setting of the quality at and beyond its limits.

use drawloom::BuildError;
use drawloom::glam::{DVec3, Vec3};
use drawloom::quality::{
    CullingVolume, DepthCurve, DepthPrecision, DiffuseFormat, NormalFormat, Quality, QualityError, RadianceSum,
    ShadowQuality, ToneCurve, TransformPrecision, VertexFormat,
};
use drawloom::scene::{Camera, Material, Scene};
use drawloom_testing::scenes::everything::everything;
use libtest_mimic::Failed;

use crate::Case;
use crate::harness::{Harness, OpenError};
use crate::markers::{Marker, MarkerScene, RED, camera, with_context};

pub const CASES: &[Case] = &[
    ("presets_draw_every_scene", presets),
    ("every_setting_at_its_limits_draws_every_scene", limits),
    ("the_error_names_an_invalid_setting", invalid),
];

/// A scene with every feature, and with the largest finite brightness.
fn very_bright() -> Result<Scene, Failed> {
    let mut scene = everything();
    let bright = Vec3::splat(f32::MAX);
    for light in &mut scene.lights {
        *light.color_mut() = Vec3::new(f32::MAX, 0.0, 1.0);
    }
    let materials: Vec<_> = scene.assets().iter::<Material>().map(|(handle, one)| (handle, one.clone())).collect();
    for (handle, material) in materials {
        scene.replace(handle, Material { diffuse: bright, emission: bright, ..material })?;
    }
    (scene.ambient, scene.background) = (bright, bright);
    Ok(scene)
}

/// Draws scenes; some of them have an oracle for every pixel.
fn expect_all(harness: &mut Harness, context: &str) -> Result<(), Failed> {
    for position in [DVec3::ZERO, DVec3::new(1e3, -2e3, 5e2)] {
        let camera = Camera { position, ..camera([48, 32]) };
        let markers = [
            Marker::before(&camera, 5.0, 1.5).moved(&camera, 1.5, 1.0),
            Marker::before(&camera, 9.0, 3.0).moved(&camera, -1.0, 0.0).colored(RED),
        ];
        MarkerScene::new(camera, markers)?.expect(harness, context, 2)?;
    }
    MarkerScene::new(camera([48, 32]), [])?.expect(harness, context, 0)?;
    for (name, scene) in [("everything", everything()), ("very bright", very_bright()?)] {
        let drawn = harness.draw_whole(&scene).map_err(|failed| with_context(&format!("{context}: {name}"), failed))?;
        if drawn.capture.is_some_and(|capture| capture.covered() < 0.9) {
            return Err(format!("{context}: {name} is dark").into());
        }
    }
    Ok(())
}

fn presets(harness: &mut Harness) -> Result<(), Failed> {
    for (name, quality) in [("fast", Quality::fast()), ("balanced", Quality::balanced()), ("exact", Quality::exact())] {
        let quality = harness.name().affordable(quality);
        let mut harness = harness.with(quality).map_err(|error| error.to_string())?;
        // Twice, since caches persist from frame to frame.
        for _ in 0..2 {
            expect_all(&mut harness, name)?;
        }
    }
    Ok(())
}

fn limits(harness: &mut Harness) -> Result<(), Failed> {
    let usual = harness.name().affordable(Quality::balanced());
    let shadows = usual.shadows;
    let key = |bits, curve| DepthPrecision { bits, curve };
    let linear = |far| DepthCurve::Linear { far };
    for quality in [
        Quality { opaque_order: DepthPrecision::UNORDERED, ..usual },
        Quality { opaque_order: key(1, DepthCurve::Logarithmic), ..usual },
        Quality { opaque_order: key(DepthPrecision::MAX_OPAQUE_BITS, linear(f32::MAX)), ..usual },
        Quality { opaque_order: key(1, linear(f32::MIN_POSITIVE)), ..usual },
        Quality { blended_order: key(1, linear(f32::from_bits(1))), ..usual },
        Quality { blended_order: key(31, linear(f32::MAX)), ..usual },
        Quality { culling: CullingVolume::None, ..usual },
        Quality { culling: CullingVolume::Box, ..usual },
        Quality { culling: CullingVolume::OrientedBox, ..usual },
        Quality { occlusion: Some(1), ..usual },
        Quality { occlusion: Some(16), culling: CullingVolume::OrientedBox, ..usual },
        Quality { normals: NormalFormat::Octahedral8, ..usual },
        Quality { normals: NormalFormat::Octahedral10, ..usual },
        Quality { normals: NormalFormat::Octahedral16, ..usual },
        Quality { diffuse: DiffuseFormat::HalfFloat, ..usual },
        Quality { vertices: VertexFormat::Packed, ..usual },
        Quality { level_of_detail: f32::MAX, ..usual },
        Quality { level_of_detail: f32::from_bits(1), ..usual },
        Quality { depth_pre_pass: true, ..usual },
        Quality { shadows: ShadowQuality { side: 1, ..shadows }, ..usual },
        Quality { shadows: ShadowQuality { side: 1, filter: 4, ..shadows }, ..usual },
        Quality { shadows: ShadowQuality { filter: 4, side: 64, ..shadows }, ..usual },
        Quality { shadows: ShadowQuality { bias: 0.0, ..shadows }, ..usual },
        Quality { shadows: ShadowQuality { bias: f32::MAX, ..shadows }, ..usual },
        Quality { shadows: ShadowQuality { interval: u32::MAX, ..shadows }, ..usual },
        Quality { shadows: ShadowQuality { widest_edge: 90.0, ..shadows }, ..usual },
        Quality { light_cut_off: f32::MAX, ..usual },
        Quality { light_cut_off: f32::from_bits(1), ..usual },
        Quality { radiance_sum: RadianceSum::Float, ..usual },
        Quality { radiance_sum: RadianceSum::Shader, ..usual },
        Quality { tone_curve: ToneCurve::Clipped, ..usual },
        Quality { transforms: TransformPrecision::Absolute, ..usual },
    ] {
        let changed = format!("{quality:?}");
        let mut harness = harness.with(quality).map_err(|error| error.to_string())?;
        expect_all(&mut harness, &changed)?;
    }
    Ok(())
}

fn invalid(harness: &mut Harness) -> Result<(), Failed> {
    let usual = Quality::exact();
    let shadows = usual.shadows;
    let key = |bits, curve| DepthPrecision { bits, curve };
    for (wrong, setting) in [
        (Quality { occlusion: Some(32), ..usual }, "occlusion"),
        (Quality { level_of_detail: f32::INFINITY, ..usual }, "level_of_detail"),
        (Quality { light_cut_off: f32::NAN, ..usual }, "light_cut_off"),
        (Quality { light_cut_off: -f32::from_bits(1), ..usual }, "light_cut_off"),
        (Quality { blended_order: key(0, DepthCurve::Logarithmic), ..usual }, "blended_order"),
        (Quality { opaque_order: key(u32::MAX, DepthCurve::Logarithmic), ..usual }, "opaque_order"),
        (Quality { blended_order: key(32, DepthCurve::Linear { far: f32::NAN }), ..usual }, "blended_order"),
        (Quality { blended_order: key(32, DepthCurve::Linear { far: -1.0 }), ..usual }, "blended_order"),
        (Quality { shadows: ShadowQuality { side: 0, ..shadows }, ..usual }, "shadows.side"),
        (Quality { shadows: ShadowQuality { filter: u32::MAX, ..shadows }, ..usual }, "shadows.filter"),
        (Quality { shadows: ShadowQuality { bias: f32::INFINITY, ..shadows }, ..usual }, "shadows.bias"),
        (Quality { shadows: ShadowQuality { interval: 0, ..shadows }, ..usual }, "shadows.interval"),
        (Quality { shadows: ShadowQuality { widest_edge: f32::NAN, ..shadows }, ..usual }, "shadows.widest_edge"),
    ] {
        match harness.with(wrong).err() {
            Some(OpenError::Build(BuildError::Quality(QualityError::OutOfRange { setting: named, .. })))
                if named == setting => {}
            Some(error) => return Err(format!("{setting}: {error}").into()),
            None => return Err(format!("{setting}: it was accepted").into()),
        }
    }
    let without_volume = Quality { occlusion: Some(8), culling: CullingVolume::None, ..usual };
    match harness.with(without_volume).err() {
        Some(OpenError::Build(BuildError::Quality(QualityError::OcclusionWithoutVolume))) => Ok(()),
        Some(error) => Err(error.to_string().into()),
        None => Err("occlusion without a volume was accepted".into()),
    }
}
