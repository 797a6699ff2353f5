//! Textures of the engine's own in the place of targets.

use drawloom::backend::{EncodingStrategy, Picture, RecordingStrategy, WgpuBackend};
use drawloom::process::{Deferred, Format, GeometryFormats, ToneMapping};
use drawloom::scene::{Scene, SceneRef};
use drawloom::{FrameError, RecordedFrame, wgpu};
use drawloom_testing::adapter;
use drawloom_testing::scenes::field;
use libtest_mimic::Failed;
use wgpu::{TextureFormat, TextureUsages};

use crate::Case;
use crate::fixture::{Fixture, backend, device};
use crate::strategies::{counts, expect, fixture_of};

pub const CASES: &[Case] = &[
    ("views_draw_into_imported_textures", into_textures),
    ("an_imported_texture_is_sampled_like_the_target", sampled),
    ("a_texture_without_srgb_is_drawn_into_as_srgb", srgb),
    ("frames_keep_their_bundles_while_imported_textures_alternate", alternating),
    ("an_imported_texture_that_does_not_fit_is_named", misfits),
    ("a_depth_target_with_a_stencil_can_be_imported", depth_with_stencil),
    ("of_cameras_of_one_name_the_first_draws_into_the_import", same_name),
    ("an_import_is_dropped_when_its_frame_fails", failed_frame),
    ("an_import_that_cannot_be_read_back_is_named", unreadable),
    ("an_imported_texture_of_another_device_is_an_error", another_device),
];

pub const USAGE: TextureUsages =
    TextureUsages::RENDER_ATTACHMENT.union(TextureUsages::TEXTURE_BINDING).union(TextureUsages::COPY_SRC);

pub fn texture(
    device: &wgpu::Device,
    [width, height]: [u32; 2],
    format: TextureFormat,
    usage: TextureUsages,
) -> wgpu::Texture {
    device.create_texture(&wgpu::TextureDescriptor {
        label: Some("imported"),
        size: wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage,
        view_formats: &[format.add_srgb_suffix()],
    })
}

fn fixture() -> Result<Fixture, Failed> {
    fixture_of(backend()?)
}

fn draw(fixture: &mut Fixture, scene: &Scene) -> Result<Vec<Picture>, Failed> {
    let recorded = fixture.record(scene)?;
    pictures(fixture, recorded, scene.cameras.len())
}

fn pictures(fixture: &Fixture, recorded: RecordedFrame<WgpuBackend>, views: usize) -> Result<Vec<Picture>, Failed> {
    let submission = fixture.submit(recorded)?;
    (0..views).map(|view| Ok(submission.read(view, "picture")?)).collect()
}

fn into_textures() -> Result<(), Failed> {
    let (device, _) = device()?;
    let (mut scene, mut fixture) = (field(120), fixture()?);
    let expected = draw(&mut fixture, &scene)?;
    // Each of the views alone, then both; the first texture is imported twice, and the second import counts.
    for imported in [vec![0], vec![1], vec![1, 0]] {
        let mut textures = Vec::new();
        for &view in &imported {
            let camera = &scene.cameras[view];
            for _ in 0..2 {
                let texture = texture(&device, camera.size, TextureFormat::Rgba8UnormSrgb, USAGE);
                fixture.renderer.backend().import_target(camera.name.clone(), "picture", texture.clone());
                textures.push((view, texture));
            }
        }
        let recorded = fixture.record(&scene)?;
        let submission = fixture.submit(recorded)?;
        for (view, expected) in expected.iter().enumerate() {
            let last = textures.iter().rfind(|(other, _)| *other == view).map(|(_, texture)| texture);
            let drawn = submission.texture(view, "picture").ok().map(|(texture, _)| texture);
            if last.is_some_and(|texture| drawn != Some(texture)) || submission.read(view, "picture")? != *expected {
                return Err(format!("view {view} of the imports {imported:?} differs").into());
            }
        }
        // The next frame draws into the crate's own targets, and leaves the textures as they are.
        scene.cameras[0].position.x += 1.0;
        let recorded = fixture.record(&scene)?;
        let next = fixture.submit(recorded)?;
        for view in 0..2 {
            let is_own = textures.iter().all(|(_, texture)| next.texture(view, "picture").ok() != Some((texture, 0)));
            expect(is_own, || format!("view {view} is drawn into a texture of the frame before"))?;
        }
        scene.cameras[0].position.x -= 1.0;
        for &view in &imported {
            expect(submission.read(view, "picture")? == expected[view], || "a texture is drawn into again".into())?;
        }
    }
    Ok(())
}

fn sampled() -> Result<(), Failed> {
    let (device, _) = device()?;
    let (scene, mut fixture) = (field(60), fixture()?);
    let expected = draw(&mut fixture, &scene)?;
    for frame in 0..3 {
        let radiance = texture(&device, scene.cameras[0].size, TextureFormat::Rgba16Float, USAGE);
        fixture.renderer.backend().import_target("front", "radiance", radiance);
        expect(draw(&mut fixture, &scene)? == expected, || format!("frame {frame} differs"))?;
    }
    Ok(())
}

fn srgb() -> Result<(), Failed> {
    let (device, _) = device()?;
    let tone_mapping = ToneMapping { format: Format::Bgra8Srgb, ..ToneMapping::default() };
    let deferred = Deferred::new().post(tone_mapping);
    let mut fixture = Fixture::with(2, |builder| builder.pipeline(deferred))?;
    let scene = field(60);
    let expected = draw(&mut fixture, &scene)?;
    let surface = texture(&device, scene.cameras[0].size, TextureFormat::Bgra8Unorm, USAGE);
    fixture.renderer.backend().import_target("front", "picture", surface.clone());
    let recorded = fixture.record(&scene)?;
    let submission = fixture.submit(recorded)?;
    expect(submission.texture(0, "picture").ok() == Some((&surface, 0)), || "it is not drawn into".into())?;
    expect(submission.read(0, "picture")?.bytes == expected[0].bytes, || "its bytes differ".into())
}

/// As a window's surface does.
fn alternating() -> Result<(), Failed> {
    let (device, queue) = adapter::device()?;
    let backend = WgpuBackend::new(device.clone(), queue)?.recording_strategy(RecordingStrategy::CachedBundles);
    let mut fixture = fixture_of(backend.encoding_strategy(EncodingStrategy::PerPass))?;
    let mut scene = field(60);
    scene.cameras.truncate(1);
    let textures = [0, 1, 2].map(|_| texture(&device, scene.cameras[0].size, TextureFormat::Rgba8UnormSrgb, USAGE));
    let mut expected = None;
    for frame in 0..7 {
        fixture.renderer.backend().import_target("front", "picture", textures[frame % 3].clone());
        let found = draw(&mut fixture, &scene)?;
        expect(*expected.get_or_insert_with(|| found.clone()) == found, || format!("frame {frame} differs"))?;
        let (recorded, replayed) = counts(&fixture, |_| true);
        expect(frame < 2 || recorded == 0 && replayed > 0, || format!("frame {frame}: {recorded} and {replayed}"))?;
    }
    Ok(())
}

fn misfits() -> Result<(), Failed> {
    let (device, _) = device()?;
    let (scene, mut fixture) = (field(30), fixture()?);
    let expected = draw(&mut fixture, &scene)?;
    let size = scene.cameras[0].size;
    let make = |size, format, usage| texture(&device, size, format, usage);
    let rgba = TextureFormat::Rgba8UnormSrgb;
    let array = device.create_texture(&wgpu::TextureDescriptor {
        label: None,
        size: wgpu::Extent3d { width: size[0], height: size[1], depth_or_array_layers: 2 },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format: rgba,
        usage: USAGE,
        view_formats: &[],
    });
    let shadow = TextureFormat::Depth32Float;
    for (view, target, texture, part) in [
        ("back", "picture", make(size, rgba, USAGE), "no such view"),
        ("front", "image", make(size, rgba, USAGE), "no such target"),
        ("front", "picture", make([size[1], size[0]], rgba, USAGE), "320x180 in 1"),
        ("front", "picture", array, "2 layers"),
        ("front", "picture", make(size, TextureFormat::Rgba16Float, USAGE), "Rgba16Float"),
        ("front", "picture", make(size, TextureFormat::Bgra8UnormSrgb, USAGE), "Bgra8UnormSrgb"),
        ("front", "picture", make(size, rgba, TextureUsages::COPY_SRC), "RENDER_ATTACHMENT"),
        (
            "front",
            "radiance",
            make(size, TextureFormat::Rgba16Float, TextureUsages::RENDER_ATTACHMENT),
            "TEXTURE_BINDING",
        ),
        ("front", "shadow map", make(size, shadow, USAGE), "no such target"),
    ] {
        fixture.renderer.backend().import_target(view, target, texture);
        let message = fixture.renderer.record(scene.as_scene_ref()).err().map(|error| error.to_string());
        let message = message.unwrap_or_default();
        let is_named = [view, target].iter().all(|name| message.contains(&format!("{name:?}")));
        expect(is_named && message.contains(part), || format!("{message:?} lacks {part:?}"))?;
        expect(draw(&mut fixture, &scene)? == expected, || format!("the frame after {part:?} differs"))?;
    }
    Ok(())
}

fn depth_with_stencil() -> Result<(), Failed> {
    let (device, _) = device()?;
    let format = Format::Depth32FloatStencil8;
    let deferred = Deferred::to_picture().formats(GeometryFormats { depth: format, ..GeometryFormats::default() });
    let mut fixture = Fixture::with(2, |builder| builder.pipeline(deferred))?;
    let scene = field(60);
    let expected = draw(&mut fixture, &scene)?;
    let depth = texture(&device, scene.cameras[0].size, TextureFormat::Depth32FloatStencil8, USAGE);
    fixture.renderer.backend().import_target("front", "depth", depth.clone());
    let recorded = fixture.record(&scene)?;
    let submission = fixture.submit(recorded)?;
    expect(submission.texture(0, "depth").ok() == Some((&depth, 0)), || "it is not drawn into".into())?;
    expect(submission.read(0, "picture")? == expected[0], || "the picture differs".into())
}

fn same_name() -> Result<(), Failed> {
    let (device, _) = device()?;
    let (mut scene, mut fixture) = (field(60), fixture()?);
    let expected = draw(&mut fixture, &scene)?;
    let name = scene.cameras[0].name.clone();
    scene.cameras[1].name = name.clone();
    let surface = texture(&device, scene.cameras[0].size, TextureFormat::Rgba8UnormSrgb, USAGE);
    fixture.renderer.backend().import_target(name, "picture", surface.clone());
    let recorded = fixture.record(&scene)?;
    let submission = fixture.submit(recorded)?;
    expect(submission.texture(0, "picture").ok() == Some((&surface, 0)), || "the first does not draw into it".into())?;
    for (view, expected) in expected.iter().enumerate() {
        expect(submission.read(view, "picture")? == *expected, || format!("view {view} differs"))?;
    }
    Ok(())
}

/// A frame without cameras fails before the device is asked for anything.
fn failed_frame() -> Result<(), Failed> {
    let (device, _) = device()?;
    let (scene, mut fixture) = (field(60), fixture()?);
    let expected = draw(&mut fixture, &scene)?;
    let surface = texture(&device, scene.cameras[0].size, TextureFormat::Rgba8UnormSrgb, USAGE);
    fixture.renderer.backend().import_target("front", "picture", surface.clone());
    let without_cameras = SceneRef { cameras: &[], ..scene.as_scene_ref() };
    expect(fixture.renderer.record(without_cameras).is_err(), || "a frame without cameras is recorded".into())?;
    let recorded = fixture.record(&scene)?;
    let submission = fixture.submit(recorded)?;
    expect(submission.texture(0, "picture").ok() != Some((&surface, 0)), || "the next frame draws into it".into())?;
    expect(submission.read(0, "picture")? == expected[0], || "the next frame differs".into())
}

fn unreadable() -> Result<(), Failed> {
    let (device, _) = device()?;
    let (scene, mut fixture) = (field(60), fixture()?);
    let expected = draw(&mut fixture, &scene)?;
    let usage = TextureUsages::RENDER_ATTACHMENT;
    let surface = texture(&device, scene.cameras[0].size, TextureFormat::Rgba8UnormSrgb, usage);
    fixture.renderer.backend().import_target("front", "picture", surface);
    let mut recorded = fixture.record(&scene)?;
    let refused = recorded.read_back(0, "picture", [0, 0], [1, 1]).err().map(|error| error.to_string());
    expect(refused.is_some_and(|error| error.contains("without the usage COPY_SRC")), || "it is read back".into())?;
    let submission = fixture.submit(recorded)?;
    let refused = submission.read(0, "picture").err().map(|error| error.to_string()).unwrap_or_default();
    expect(refused.contains("without the usage COPY_SRC"), || format!("{refused:?}"))?;
    expect(submission.read(1, "picture")? == expected[1], || "the other view differs".into())
}

fn another_device() -> Result<(), Failed> {
    let [(device, queue), (other, _)] = adapter::two_devices()?;
    let (scene, mut fixture) = (field(30), fixture_of(WgpuBackend::new(device, queue)?)?);
    let expected = draw(&mut fixture, &scene)?;
    let foreign = texture(&other, scene.cameras[0].size, TextureFormat::Rgba8UnormSrgb, USAGE);
    fixture.renderer.backend().import_target("front", "picture", foreign);
    let refused = match fixture.renderer.record(scene.as_scene_ref()) {
        Ok(recorded) => fixture.submitter.submit(recorded).err().map(|error| error.to_string()),
        Err(FrameError::Failed { source, .. }) => Some(source.to_string()),
        Err(other) => Some(other.to_string()),
    };
    let message = refused.unwrap_or_default();
    expect(message.contains("doesn't match Device"), || format!("{message:?}"))?;
    expect(draw(&mut fixture, &scene)? == expected, || "the next frame differs".into())
}
