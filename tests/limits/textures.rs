//! Textures with more pixels than are drawn.

use drawloom::glam::DVec3;
use drawloom::scene::{Material, RenderObject, Texture, Topology};
use drawloom::view::IssueReason;
use drawloom_testing::scenes::{field, square};
use libtest_mimic::Failed;

use crate::Case;
use crate::fixture::{Device, Options, expect_scene_issues, renderer, small};

/// The null backend has no textures.
pub const CASES: &[Case] = &[(
    "textures_with_more_pixels_than_are_drawn_are_named",
    &[Device::Adapter, Device::Software, Device::Streamed],
    reduced,
)];

fn reduced(device: Device) -> Result<(), Failed> {
    const MAX: u32 = Texture::MAX_DETAIL;
    // One direction is enough. Sides that are no powers of two are scaled up, and keep their detail.
    let sizes = [(300, 7), (MAX + 1, 1), (7, 500), (1, Texture::MAX_SIZE)];
    let mut scene = small(field(0));
    let mesh = scene.add(square(Topology::TriangleList))?;
    let mut textures = Vec::new();
    for (width, height) in sizes {
        let pixels = vec![200; width as usize * height as usize * 4];
        let texture = scene.add(Texture::new(format!("{width} by {height}"), width, height, pixels)?)?;
        textures.push(texture);
        let material = scene.add(Material { texture: Some(texture), ..Material::default() })?;
        scene.add_object(RenderObject::new(mesh, material, DVec3::ZERO))?;
    }
    let mut frames = renderer(device, Options::default())?;
    let mut expect = |scene: &drawloom::scene::Scene, count, first, name: Option<&str>| {
        for _ in 0..2 {
            let found = frames.frame(scene.as_scene_ref())?.scene_issues;
            let expected = [(IssueReason::ReducedTexture, count, first, name)];
            expect_scene_issues(&found, &expected[..usize::from(count > 0)])?;
        }
        Ok::<_, Failed>(())
    };
    expect(&scene, 2, 1, Some("2049 by 1"))?;
    let small = Texture::new("small", 1, 1, vec![9; 4])?;
    scene.replace(textures[1], small)?;
    expect(&scene, 1, 3, Some("1 by 8192"))?;
    scene.remove(textures[3])?;
    let stale = frames.frame(scene.as_scene_ref())?.scene_issues;
    let is_reduced = stale.iter().any(|known| known.reason == IssueReason::ReducedTexture);
    if is_reduced { Err(format!("{stale:?}").into()) } else { Ok(()) }
}
