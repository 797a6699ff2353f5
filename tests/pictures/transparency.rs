//! Blended objects: sorting, lighting and blending.

use std::f64::consts::PI;
use std::io::{self, Cursor};

use drawloom::backend::Picture;
use drawloom::glam::{DVec3, Quat, Vec3};
use drawloom::process::Deferred;
use drawloom::scene::{Blend, Camera, Light, Material, RenderObject, Scene, Topology};
use drawloom::view::ShadowMaps;
use drawloom_testing::scenes::{cube, sized, square};
use half::f16;
use image::{GrayImage, ImageFormat, Luma};
use libtest_mimic::Failed;

use crate::Case;
use crate::fixture::{self, Fixture, pixel};
use crate::image_distance::{assert_color, tone_mapped};

pub const CASES: &[Case] = &[
    ("the_order_of_submission_does_not_change_the_picture", every_order),
    ("opaque_objects_hide_glass_behind_them", behind_a_wall),
    ("glass_of_opacity_one_equals_an_opaque_surface_in_every_light", lit_like_opaque),
    ("additive_and_subtractive_blending_scale_with_opacity", scales_with_opacity),
    ("panes_at_one_depth_keep_the_order_of_objects", equal_depths),
    ("subtractive_blending_leaves_at_least_black", at_least_black),
    ("a_double_sided_pane_is_lit_on_the_visible_side", lit_on_the_visible_side),
    ("more_panes_than_a_bundle_holds_stay_in_order", many_batches),
    ("what_the_mask_of_an_obj_file_hides_is_not_drawn", masked),
];

const BACKGROUND: Vec3 = Vec3::new(0.5, 0.3, 0.2);
const AMBIENT: Vec3 = Vec3::new(0.4, 0.6, 0.8);
const SIDE: u32 = 9;

/// Squares that face the camera at +Z and fill its picture, in the order in which they are submitted.
fn panes(panes: &[(f64, Material)]) -> Result<Scene, Failed> {
    let mut scene = Scene::new();
    scene.cameras = vec![sized(Camera::looking_at("main", DVec3::Z * 5.0, DVec3::ZERO), [SIDE; 2])];
    let mesh = scene.add(square(Topology::TriangleList))?;
    for (z, material) in panes {
        let material = scene.add(material.clone())?;
        scene.add_object(RenderObject::new(mesh, material, DVec3::Z * *z))?;
    }
    scene.background = BACKGROUND;
    scene.ambient = AMBIENT;
    Ok(scene)
}

fn glass(blend: Blend, diffuse: Vec3, opacity: f32) -> Material {
    Material { blend, diffuse, opacity, ..Material::default() }
}

/// The radiance of a pane in front of `radiance`, by the definition of its blend mode, in ambient light only.
fn behind(radiance: [f64; 3], pane: &Material) -> [f64; 3] {
    let opacity = f64::from(pane.opacity);
    let own = (pane.emission.as_dvec3() + pane.diffuse.as_dvec3() * AMBIENT.as_dvec3()).to_array();
    std::array::from_fn(|channel| match pane.blend {
        Blend::None => own[channel],
        Blend::Alpha => radiance[channel] * (1.0 - opacity) + own[channel] * opacity,
        Blend::Additive => radiance[channel] + own[channel] * opacity,
        Blend::Subtractive => radiance[channel] - own[channel] * opacity,
    })
}

/// A scene's radiance and picture.
fn drawn(fixture: &mut Fixture, scene: &Scene) -> Result<(Picture, Picture), Failed> {
    let recorded = fixture.record(scene)?;
    let submission = fixture.submit(recorded)?;
    Ok((submission.read(0, "radiance")?, submission.read(0, "picture")?))
}

/// Red, green and blue of the centre pixel of a target of half floats.
fn middle(radiance: &Picture) -> [f64; 3] {
    let pixel = (radiance.height / 2 * radiance.width + radiance.width / 2) as usize;
    let channel = |index: usize| {
        let start = pixel * 8 + index * 2;
        f16::from_le_bytes([radiance.bytes[start], radiance.bytes[start + 1]]).to_f64()
    };
    [channel(0), channel(1), channel(2)]
}

/// Fails if the picture's centre is not the tone-mapped radiance, computed in f64.
fn expect(context: &str, drawn: &(Picture, Picture), expected: [f64; 3]) -> Result<(), Failed> {
    // The relative error of a half float is at most 2⁻¹⁰, and those of the last few blends add up.
    expect_within(2e-3, context, drawn, expected)
}

/// The same with the greatest error of the radiance, as a fraction of the radiance or of one quarter.
fn expect_within(share: f64, context: &str, drawn: &(Picture, Picture), expected: [f64; 3]) -> Result<(), Failed> {
    let found = middle(&drawn.0);
    let close = |(found, expected): (&f64, f64)| (found - expected).abs() <= share * expected.abs().max(0.25);
    if !found.iter().zip(expected).all(close) {
        return Err(format!("{context}: radiance {found:?} should be {expected:?}").into());
    }
    let shown = expected.map(|radiance| radiance.max(0.0));
    assert_color(pixel(&drawn.1, SIDE / 2, SIDE / 2), tone_mapped(shown))
        .map_err(|failed| format!("{context}: {}", failed.message().unwrap_or_default()).into())
}

const ORDERS: [[usize; 3]; 6] = [[0, 1, 2], [0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]];

fn every_order() -> Result<(), Failed> {
    let glasses = [
        Material { emission: Vec3::new(0.1, 0.0, 0.5), ..glass(Blend::Alpha, Vec3::new(0.2, 0.9, 0.3), 0.4) },
        Material { emission: Vec3::new(0.0, 0.2, 0.0), ..glass(Blend::Additive, Vec3::new(0.6, 0.1, 0.2), 0.5) },
        Material { emission: Vec3::new(0.1, 0.0, 0.0), ..glass(Blend::Subtractive, Vec3::new(0.1, 0.2, 0.1), 0.7) },
    ];
    let mut fixture = Fixture::new()?;
    let mut colors = Vec::new();
    for far_to_near in ORDERS {
        let expected = far_to_near
            .iter()
            .fold(BACKGROUND.as_dvec3().to_array(), |radiance, &pane| behind(radiance, &glasses[pane]));
        let depth_of = |pane: usize| far_to_near.iter().position(|&other| other == pane).unwrap_or(0) as f64 - 1.0;
        let mut first = None;
        for submitted in ORDERS {
            let scene = panes(&submitted.map(|pane| (depth_of(pane), glasses[pane].clone())))?;
            let found = drawn(&mut fixture, &scene)?;
            expect(&format!("{far_to_near:?}, submitted as {submitted:?}"), &found, expected)?;
            if *first.get_or_insert_with(|| found.clone()) != found {
                return Err(format!("{far_to_near:?}, submitted as {submitted:?}: other bytes").into());
            }
        }
        colors.push(tone_mapped(expected));
    }
    colors.sort_unstable();
    colors.dedup();
    // Additive and subtractive blending commute, so only the position of the alpha-blended pane matters.
    if colors.len() >= 3 { Ok(()) } else { Err("the order of the panes should be visible".into()) }
}

fn behind_a_wall() -> Result<(), Failed> {
    let wall = Material { diffuse: Vec3::new(0.3, 0.7, 0.5), ..Material::default() };
    let of_wall = behind(BACKGROUND.as_dvec3().to_array(), &wall);
    let mut fixture = Fixture::new()?;
    for blend in [Blend::Alpha, Blend::Additive, Blend::Subtractive] {
        let pane = glass(blend, Vec3::new(0.4, 0.1, 0.2), 0.6);
        let alone = drawn(&mut fixture, &panes(&[(0.0, wall.clone())])?)?;
        expect("the wall", &alone, of_wall)?;
        if drawn(&mut fixture, &panes(&[(-1.0, pane.clone()), (0.0, wall.clone())])?)? != alone {
            return Err(format!("{blend:?} is visible through a wall").into());
        }
        let before = drawn(&mut fixture, &panes(&[(1.0, pane.clone()), (0.0, wall.clone())])?)?;
        expect(&format!("{blend:?} before a wall"), &before, behind(of_wall, &pane))?;
    }
    Ok(())
}

/// A light of every class in front of the pane, from slightly above.
fn lights() -> Vec<Light> {
    let (position, intensity, range) = (DVec3::new(0.5, 1.5, 4.0), Vec3::new(9.0, 7.0, 5.0), 12.0);
    let direction = -position.as_vec3().normalize();
    let mut lights = vec![Light::Point { position, intensity, range, casts_shadow: false }];
    for casts_shadow in [false, true] {
        let (inner_angle, outer_angle) = (0.3, 0.5);
        lights.extend([
            Light::Directional { direction, illuminance: intensity * 0.1, casts_shadow },
            Light::Spot { position, direction, intensity, range, inner_angle, outer_angle, casts_shadow },
            Light::Hemispherical { position, direction, intensity, range, casts_shadow },
        ]);
    }
    lights
}

fn lit_like_opaque() -> Result<(), Failed> {
    let maps = ShadowMaps { side: 256, max_distance: 12.0, ..ShadowMaps::default() };
    let picture = |light: Light, blend| -> Result<Picture, Failed> {
        let mut scene = panes(&[])?;
        scene.cameras[0].size = [48; 2];
        scene.lights = vec![light];
        scene.ambient = Vec3::splat(0.02);
        let (plane, block) = (scene.add(square(Topology::TriangleList))?, scene.add(cube())?);
        // 188 of 255 sRGB encoded, which the diffuse target holds exactly.
        let diffuse = Vec3::splat(((188.0 / 255.0 + 0.055) / 1.055_f32).powf(2.4));
        let pane = scene.add(Material { blend, diffuse, ..Material::default() })?;
        let stone = scene.add(Material::default())?;
        let orientation = Quat::from_rotation_y(0.3);
        scene.add_object(RenderObject {
            orientation,
            scale: Vec3::splat(6.0),
            ..RenderObject::new(plane, pane, DVec3::ZERO)
        })?;
        let position = DVec3::new(0.0, 0.4, 1.0);
        scene.add_object(RenderObject { scale: Vec3::splat(0.3), ..RenderObject::new(block, stone, position) })?;
        Fixture::with(2, |builder| builder.pipeline(Deferred::to_picture().shadow_maps(Some(maps))))?.draw(&scene)
    };
    let mut before = Vec::new();
    for light in lights() {
        let (opaque, glass) = (picture(light, Blend::None)?, picture(light, Blend::Alpha)?);
        let farthest = opaque.bytes.iter().zip(&glass.bytes).map(|(one, other)| one.abs_diff(*other)).max();
        // The geometry buffer rounds normals and depth, which shows most where a shadow fades.
        if farthest > Some(4) {
            return Err(format!("{light:?}: glass is off by {farthest:?}").into());
        }
        if before.contains(&opaque.bytes) {
            return Err(format!("{light:?}: it equals another light's picture, or has no shadow").into());
        }
        before.push(opaque.bytes);
    }
    Ok(())
}

fn scales_with_opacity() -> Result<(), Failed> {
    let mut fixture = Fixture::new()?;
    for blend in [Blend::Alpha, Blend::Additive, Blend::Subtractive] {
        for opacity in [0.0, 0.25, 0.5, 1.0] {
            let pane = glass(blend, Vec3::new(0.5, 0.2, 0.1), opacity);
            let pane = Material { emission: Vec3::new(0.1, 0.0, 0.05), ..pane };
            let expected = behind(BACKGROUND.as_dvec3().to_array(), &pane);
            expect(&format!("{blend:?} at {opacity}"), &drawn(&mut fixture, &panes(&[(0.0, pane)])?)?, expected)?;
        }
    }
    Ok(())
}

fn equal_depths() -> Result<(), Failed> {
    let mut fixture = Fixture::new()?;
    let (red, green) = (glass(Blend::Alpha, Vec3::X, 0.7), glass(Blend::Alpha, Vec3::Y, 0.6));
    let added = glass(Blend::Additive, Vec3::Z, 1.0);
    for order in [[&red, &green, &added], [&green, &red, &added], [&added, &green, &red], [&red, &added, &green]] {
        let expected = order.iter().fold(BACKGROUND.as_dvec3().to_array(), |radiance, pane| behind(radiance, pane));
        let scene = panes(&order.map(|pane| (0.5, pane.clone())))?;
        expect(&format!("{order:?}"), &drawn(&mut fixture, &scene)?, expected)?;
    }
    Ok(())
}

fn at_least_black() -> Result<(), Failed> {
    let mut fixture = Fixture::new()?;
    for taken in [0.6, 3.0, 60_000.0, 1e30] {
        let pane = Material { emission: Vec3::splat(taken), ..glass(Blend::Subtractive, Vec3::ONE, 1.0) };
        let found = drawn(&mut fixture, &panes(&[(0.0, pane.clone()), (1.0, pane.clone())])?)?;
        if middle(&found.0).iter().any(|channel| channel.is_nan() || *channel >= 0.0) {
            return Err(format!("{taken} twice leaves {:?}", middle(&found.0)).into());
        }
        assert_color(pixel(&found.1, SIDE / 2, SIDE / 2), [0; 3])?;
    }
    // Negative radiance reduces what is drawn over it.
    let taken = glass(Blend::Subtractive, Vec3::ONE, 1.0);
    let added = Material { emission: Vec3::ONE, ..glass(Blend::Additive, Vec3::ZERO, 1.0) };
    let expected = behind(behind(BACKGROUND.as_dvec3().to_array(), &taken), &added);
    expect("added to negative radiance", &drawn(&mut fixture, &panes(&[(0.0, taken), (1.0, added)])?)?, expected)
}

fn lit_on_the_visible_side() -> Result<(), Failed> {
    let mut fixture = Fixture::new()?;
    // The diffuse colour is not stored anywhere, so it is exact.
    let lit = 4.0 * (1.0 - (2.0_f64 / 8.0).powi(4)).powi(2) / 4.0 * 0.5 / PI;
    for (eye, lamp, double_sided, expected) in [
        (1.0, 1.0, false, Some(lit)),
        (1.0, -1.0, false, Some(0.0)),
        (-1.0, -1.0, false, None),
        (1.0, 1.0, true, Some(lit)),
        (1.0, -1.0, true, Some(0.0)),
        (-1.0, -1.0, true, Some(lit)),
        (-1.0, 1.0, true, Some(0.0)),
    ] {
        let mut scene = panes(&[(0.0, Material { double_sided, ..glass(Blend::Alpha, Vec3::splat(0.5), 1.0) })])?;
        scene.ambient = Vec3::ZERO;
        scene.cameras = vec![sized(Camera::looking_at("main", DVec3::Z * 5.0 * eye, DVec3::ZERO), [SIDE; 2])];
        scene.lights = vec![Light::Point {
            position: DVec3::Z * 2.0 * lamp,
            intensity: Vec3::splat(4.0),
            range: 8.0,
            casts_shadow: false,
        }];
        let expected = expected.map_or(BACKGROUND.as_dvec3().to_array(), |radiance| [radiance; 3]);
        let context = format!("viewed from {eye}, lit from {lamp}, double-sided: {double_sided}");
        expect(&context, &drawn(&mut fixture, &scene)?, expected)?;
    }
    Ok(())
}

fn many_batches() -> Result<(), Failed> {
    // Bundles end at 256, 512 and 699, each after another colour, so that the last drawn one shows.
    const COUNT: usize = 699;
    let mut fixture = Fixture::new()?;
    let colors = [Vec3::X, Vec3::Y, Vec3::Z].map(|diffuse| glass(Blend::Alpha, diffuse, 0.1));
    let mut pictures = Vec::new();
    for meshes in [1, 2] {
        let mut scene = panes(&[])?;
        let meshes: Vec<_> =
            (0..meshes).map(|_| scene.add(square(Topology::TriangleList))).collect::<Result<_, _>>()?;
        let materials = colors.each_ref().map(|color| scene.add(color.clone()));
        for submitted in 0..COUNT {
            // 699 and 251 have no divisor in common, so each depth occurs once.
            let pane = submitted * 251 % COUNT;
            let material = materials[pane % 3].clone()?;
            let position = DVec3::Z * (-2.0 + pane as f64 * 0.004);
            scene.add_object(RenderObject::new(meshes[pane % meshes.len()], material, position))?;
        }
        let recorded = fixture.record(&scene)?;
        let (batches, bundles) = (recorded.statistics().views[0].batches, recorded.statistics().views[0].bundles);
        if (batches, bundles) != if meshes.len() == 1 { (1, 1) } else { (COUNT, 3) } {
            return Err(format!("{} meshes make {batches} batches in {bundles} bundles", meshes.len()).into());
        }
        let submission = fixture.submit(recorded)?;
        pictures.push((submission.read(0, "radiance")?, submission.read(0, "picture")?));
    }
    let expected =
        (0..COUNT).fold(BACKGROUND.as_dvec3().to_array(), |radiance, pane| behind(radiance, &colors[pane % 3]));
    // Each pane removes a tenth of the accumulated rounding error, so the error is at most ten times 2⁻¹⁰.
    expect_within(0.01, "two meshes", &pictures[1], expected)?;
    if pictures[0] == pictures[1] { Ok(()) } else { Err("one mesh gives another picture than two".into()) }
}

/// A white square that fills the picture. Its `map_d` is black on the left. On the right it is white in one file and
/// grey in another.
fn masked() -> Result<(), Failed> {
    let square = "v -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nf 1/1 2/2 3/3 4/4\n";
    let file = format!("mtllib a.mtl\nusemtl a\n{square}");
    for (grey, share) in [(255, 1.0), (51, 0.2)] {
        let mask = GrayImage::from_fn(8, 8, |column, _| Luma([if column < 4 { 0 } else { grey }]));
        let mut png = Vec::new();
        mask.write_to(&mut Cursor::new(&mut png), ImageFormat::Png)?;
        let fetch = |name: &str| match name {
            "a.mtl" => Ok(b"newmtl a\nKd 1 1 1\nmap_d mask.png\n".to_vec()),
            "mask.png" => Ok(png.clone()),
            _ => Err(io::ErrorKind::NotFound.into()),
        };
        let imported = drawloom_obj::read("a.obj", file.as_bytes(), fetch)?;
        if !imported.warnings.is_empty() {
            return Err(format!("{:?}", imported.warnings).into());
        }
        let mut scene = imported.scene;
        scene.cameras = vec![sized(Camera::looking_at("main", DVec3::Z * 1.2, DVec3::ZERO), [SIDE; 2])];
        (scene.background, scene.ambient) = (BACKGROUND, AMBIENT);
        let picture = fixture::draw(&scene)?;
        let visible = BACKGROUND.lerp(AMBIENT, share);
        for (column, expected) in [(0, BACKGROUND), (SIDE - 1, visible)] {
            assert_color(pixel(&picture, column, SIDE / 2), tone_mapped(expected.as_dvec3().to_array()))
                .map_err(|failed| format!("a mask of {grey}, column {column}: {failed:?}"))?;
        }
    }
    Ok(())
}
