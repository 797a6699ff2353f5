//! Textures that are larger than the device allows, or have a format that it lacks.

use drawloom::glam::DVec3;
use drawloom::scene::{Material, RenderObject, Scene, Texture, TextureFormat, Topology};
use drawloom::view::IssueReason;
use drawloom_testing::scenes::{field, square};
use libtest_mimic::Failed;

use crate::Case;
use crate::fixture::{Device, Options, expect_scene_issues, renderer, small};

/// The null backend has no textures.
pub const CASES: &[Case] = &[
    ("textures_that_are_larger_than_the_device_allows_are_named", &[Device::Noop, Device::Streamed], too_large),
    ("textures_of_a_format_that_the_device_lacks_are_named", &[Device::Software], unknown_format),
];

/// A scene with an object for each texture.
fn with_textures(textures: impl IntoIterator<Item = Texture>) -> Result<Scene, Failed> {
    let mut scene = small(field(0));
    let mesh = scene.add(square(Topology::TriangleList))?;
    for texture in textures {
        let texture = scene.add(texture)?;
        let material = scene.add(Material { texture: Some(texture), ..Material::default() })?;
        scene.add_object(RenderObject::new(mesh, material, DVec3::ZERO))?;
    }
    Ok(scene)
}

/// Expects that two frames count this number of textures, and name the first of them.
fn expect(device: Device, scene: &Scene, (count, first, name): (usize, usize, &str)) -> Result<(), Failed> {
    let mut frames = renderer(device, Options::default())?;
    for _ in 0..8 {
        frames.frame(scene.as_scene_ref())?;
    }
    for _ in 0..2 {
        let found = frames.frame(scene.as_scene_ref())?.scene_issues;
        let found: Vec<_> = found.into_iter().filter(|known| known.reason == IssueReason::TextureLimit).collect();
        let expected = [(IssueReason::TextureLimit, count, first, Some(name))];
        expect_scene_issues(&found, &expected[..usize::from(count > 0)])?;
    }
    Ok(())
}

/// noop devices allow 8,192 texels to a side.
fn too_large(device: Device) -> Result<(), Failed> {
    let plain = |(width, height): (u32, u32)| {
        Texture::new(format!("{width} by {height}"), width, height, vec![200; (width * height * 4) as usize])
    };
    let sizes = [(300, 7), (8193, 1), (7, 500), (1, 8192), (1, 16_384)];
    let mut scene = with_textures(sizes.into_iter().map(plain).collect::<Result<Vec<_>, _>>()?)?;
    expect(device, &scene, (2, 1, "8193 by 1"))?;
    let handles: Vec<_> = scene.assets().iter::<Texture>().map(|(handle, _)| handle).collect();
    scene.replace(handles[1], plain((1, 1))?)?;
    expect(device, &scene, (1, 4, "1 by 16384"))?;
    scene.remove(handles[4])?;
    expect(device, &scene, (0, 0, ""))
}

fn unknown_format(device: Device) -> Result<(), Failed> {
    let blocks = Texture::with_levels("blocks", TextureFormat::Bc7Srgb, [8, 8], vec![vec![0; 64]])?;
    let scene = with_textures([Texture::new("plain", 1, 1, vec![255; 4])?, blocks])?;
    expect(device, &scene, (1, 1, "blocks"))
}
