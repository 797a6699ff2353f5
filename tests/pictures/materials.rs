//! Materials that change.

use drawloom::backend::{Backend, EncodingStrategy, RecordingStrategy, WgpuBackend};
use drawloom::glam::Vec3;
use drawloom::scene::{Material, Scene, Texture};
use drawloom_testing::adapter;
use drawloom_testing::scenes::field;
use libtest_mimic::Failed;

use crate::Case;
use crate::strategies::{counts, drawn_by_a_new_renderer, expect, fixture_of, pictures};

pub const CASES: &[Case] = &[("a_material_that_changes_uploads_its_bytes_and_nothing_else", changing)];

/// A field with many materials, of which its objects use the first few.
fn many_materials() -> Result<Scene, Failed> {
    let mut scene = field(200);
    for _ in 0..1000 {
        scene.add(Material::default())?;
    }
    Ok(scene)
}

fn changing() -> Result<(), Failed> {
    // A device alone: the device is done with a frame when its picture is read, so all frames have the same buffers.
    let (device, queue) = adapter::device()?;
    let backend = WgpuBackend::new(device, queue)?.recording_strategy(RecordingStrategy::CachedBundles)?;
    let mut fixture = fixture_of(backend.encoding_strategy(EncodingStrategy::PerPass))?;
    let mut scene = many_materials()?;
    let texture = scene.add(Texture::new("red", 1, 1, vec![255, 0, 0, 255])?)?;
    let handles: Vec<_> = scene.assets().iter::<Material>().map(|(handle, _)| handle).collect();
    let mut uploaded = |scene: &Scene| -> Result<_, Failed> {
        let before = fixture.renderer.backend().uploaded_bytes();
        let recorded = fixture.record(scene)?;
        let drawn = pictures(&fixture, recorded, scene)?;
        let (recorded, _) = counts(&fixture, |_| true);
        Ok((drawn, fixture.renderer.backend().uploaded_bytes() - before, recorded))
    };
    uploaded(&scene)?;
    let (mut before, nothing, _) = uploaded(&scene)?;
    let changes: [fn(&mut Material); 3] = [
        |material| material.diffuse = Vec3::new(1.0, 0.2, 0.0),
        |material| material.emission = Vec3::new(0.0, 0.3, 0.0),
        |material| material.opacity = 0.25,
    ];
    for (change, material) in changes.into_iter().zip([handles[0], handles[1], handles[2]]) {
        let mut changed = scene.assets().get(material)?.clone();
        change(&mut changed);
        scene.replace(material, changed)?;
        let (found, bytes, recorded) = uploaded(&scene)?;
        expect(found != before, || "the change is not seen".into())?;
        expect(found == drawn_by_a_new_renderer(&scene)?, || "it differs from a new renderer".into())?;
        expect(bytes <= nothing + 1024, || format!("{bytes} bytes are uploaded, without a change {nothing}"))?;
        expect(recorded == 0, || format!("{recorded} bundles are recorded anew"))?;
        before = found;
    }
    // A texture that is there already is a change of the material alone.
    let textured = Material { texture: Some(texture), ..scene.assets().get(handles[0])?.clone() };
    scene.replace(handles[0], textured)?;
    let (found, bytes, recorded) = uploaded(&scene)?;
    expect(found != before && found == drawn_by_a_new_renderer(&scene)?, || "the texture is not seen".into())?;
    expect(bytes <= nothing + 1024 && recorded == 0, || format!("{bytes} bytes, {recorded} bundles"))?;
    // Other states need other draws.
    let double_sided = Material { double_sided: true, ..scene.assets().get(handles[1])?.clone() };
    scene.replace(handles[1], double_sided)?;
    let (found, ..) = uploaded(&scene)?;
    expect(found == drawn_by_a_new_renderer(&scene)?, || "it differs from a new renderer".into())
}
