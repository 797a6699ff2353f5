//! Formats of a quality: the geometry buffer's targets, vertices, and the tone curve.

use drawloom::backend::Picture;
use drawloom::glam::{DVec3, Vec2, Vec3};
use drawloom::process::{
    ClearColor, Declare, Deferred, Draws, Exposure, Format, FullScreen, RenderProcess, ToneMapping,
};
use drawloom::quality::{DiffuseFormat, NormalFormat, Quality, ToneCurve, VertexFormat};
use drawloom::scene::{Camera, Material, Mesh, Projection, RenderObject, Scene, Texture, Topology, Vertex};
use drawloom_testing::scenes::everything::everything;
use drawloom_testing::scenes::{field, sized};
use half::f16;
use libtest_mimic::Failed;

use crate::Case;
use crate::fixture::{Fixture, draw, pixel};
use crate::image_distance::{Distance, as_image, assert_color, tone_mapped};
use crate::references::{colonnade, small_colonnade};

pub const CASES: &[Case] = &[
    ("normals_read_back_are_within_their_bound", normals),
    ("packed_normals_read_back_are_within_their_bound", packed_normals),
    ("vertices_that_pack_losslessly_change_no_byte", packed_without_loss),
    ("packed_vertices_change_the_picture_within_their_bound", packed_within_bound),
    ("formats_of_normals_and_diffuse_colours_change_the_picture_within_their_bounds", targets_within_bound),
    ("frames_after_a_change_of_formats_are_those_of_a_new_renderer", changes),
    ("a_frame_in_flight_keeps_its_vertices", frame_in_flight),
    ("diffuse_colours_read_back_are_within_their_bound", diffuse),
    ("the_clipped_curve_clips_at_1", clipped),
    ("a_quality_changes_the_tone_curve_and_no_other_post_process", curve_of_quality),
];

const NORMALS: [NormalFormat; 4] =
    [NormalFormat::Octahedral8, NormalFormat::Octahedral10, NormalFormat::Octahedral16, NormalFormat::HalfFloat];

fn fixture(quality: Quality) -> Result<Fixture, Failed> {
    Fixture::with(2, |builder| builder.pipeline(Deferred::to_picture()).quality(quality))
}

/// The size of pictures in which each pixel shows one vertex.
const SIDE: usize = 128;

/// A scene with one quad per pixel, row by row. Each faces the camera and has one of these normals and texture
/// coordinates.
fn one_quad_per_pixel(quads: &[(Vec3, Vec2)], material: Material, textures: Vec<Texture>) -> Result<Scene, Failed> {
    let (mut vertices, mut indices) = (Vec::new(), Vec::new());
    for (number, (normal, uv)) in quads.iter().enumerate() {
        let left_top = [(number % SIDE) as f32 - SIDE as f32 / 2.0, SIDE as f32 / 2.0 - (number / SIDE) as f32];
        let first = vertices.len() as u32;
        for (right, down) in [(0.0, 1.0), (1.0, 1.0), (1.0, 0.0), (0.0, 0.0)] {
            let position = [left_top[0] + right, left_top[1] - down, 0.0];
            vertices.push(Vertex { position, normal: normal.to_array(), uv: uv.to_array() });
        }
        indices.extend([0, 1, 2, 0, 2, 3].map(|corner| first + corner));
    }
    let mut scene = Scene::new();
    let mesh = scene.add(Mesh::new("pixels", Topology::TriangleList, vertices, indices)?)?;
    let mut material = material;
    for texture in textures {
        material.texture = Some(scene.add(texture)?);
    }
    let material = scene.add(material)?;
    scene.add_object(RenderObject::new(mesh, material, DVec3::ZERO))?;
    let mut camera = sized(Camera::looking_at("main", DVec3::Z * 10.0, DVec3::ZERO), [SIDE as u32; 2]);
    (camera.projection, camera.far) = (Projection::Orthographic { height: SIDE as f32 }, 100.0);
    scene.cameras = vec![camera];
    Ok(scene)
}

/// One normal per pixel: the axes, some beside the fold of the octahedron, some midway between the steps of each format
/// where the steps are largest, and the rest distributed evenly (a Fibonacci spiral).
fn directions() -> Vec<Vec3> {
    let mut all = vec![Vec3::X, Vec3::NEG_X, Vec3::Y, Vec3::NEG_Y, Vec3::Z, Vec3::NEG_Z];
    for index in 0..200 {
        let (sine, cosine) = (index as f32 * 0.0314).sin_cos();
        all.extend([-0.0, 0.0, 1e-30, -1e-30, 1e-7, -1e-7].map(|z| Vec3::new(cosine, sine, z)));
    }
    for steps in [127.0, 511.0, 32_767.0] {
        let near = |offset: i32| ((steps / 3.0_f32).floor() + offset as f32 + 0.5) / steps;
        for (x, y) in (-8..8).flat_map(|x| (-8..8).map(move |y| (near(x), near(y)))) {
            let signs = [(1.0, 1.0, 1.0), (-1.0, 1.0, 1.0), (1.0, 1.0, -1.0), (-1.0, -1.0, -1.0)];
            all.extend(signs.map(|(right, up, out)| Vec3::new(x * right, y * up, (1.0 - x - y) * out)));
        }
    }
    let rest = SIDE * SIDE - all.len();
    all.extend((0..rest).map(|index| {
        let z = 1.0 - (index as f64 + 0.5) * 2.0 / rest as f64;
        let (sine, cosine) = (index as f64 * 2.399_963_229_728_653).sin_cos();
        (DVec3::new(cosine, sine, 0.0) * (1.0 - z * z).sqrt() + DVec3::Z * z).as_vec3()
    }));
    all
}

/// The normals in a target, decoded in f64.
fn decoded(picture: &Picture) -> Result<Vec<DVec3>, Failed> {
    let from_point = |x: f64, y: f64| {
        let z = 1.0 - x.abs() - y.abs();
        let away = |other: f64, own: f64| (1.0 - other.abs()).copysign(own);
        if z < 0.0 { DVec3::new(away(y, x), away(x, y), z).normalize() } else { DVec3::new(x, y, z).normalize() }
    };
    let half = |bytes: &[u8]| f16::from_le_bytes([bytes[0], bytes[1]]).to_f64();
    let point = |pixel: &[u8]| match picture.format {
        Format::Rg8Unorm => Some((f64::from(pixel[0]) / 127.0 - 1.0, f64::from(pixel[1]) / 127.0 - 1.0)),
        Format::Rgb10a2Unorm => {
            let bits = u32::from_le_bytes([pixel[0], pixel[1], pixel[2], pixel[3]]);
            Some((f64::from(bits & 1023) / 511.0 - 1.0, f64::from(bits >> 10 & 1023) / 511.0 - 1.0))
        }
        Format::Rgba8Unorm => {
            let number = |high, low| f64::from(u16::from_be_bytes([high, low])) / 32_767.0 - 1.0;
            Some((number(pixel[0], pixel[2]), number(pixel[1], pixel[3])))
        }
        Format::Rg16Float => Some((half(pixel), half(&pixel[2..]))),
        _ => None,
    };
    let points: Option<Vec<_>> = picture.bytes.chunks_exact(picture.format.bytes()).map(point).collect();
    let points = points.ok_or_else(|| format!("{:?} is unexpected", picture.format))?;
    Ok(points.into_iter().map(|(x, y)| from_point(x, y)).collect())
}

/// The angle between two directions in degrees.
fn angle(one: DVec3, other: DVec3) -> f64 {
    one.cross(other).length().atan2(one.dot(other)).to_degrees()
}

/// The target `normal` of a scene of these normals.
fn normals_of(directions: &[Vec3], quality: Quality) -> Result<Vec<DVec3>, Failed> {
    let quads: Vec<_> = directions.iter().map(|&normal| (normal, Vec2::ZERO)).collect();
    let scene = one_quad_per_pixel(&quads, Material::default(), Vec::new())?;
    let mut fixture = fixture(quality)?;
    let recorded = fixture.record(&scene)?;
    decoded(&fixture.submit(recorded)?.read(0, "normal")?)
}

/// The largest error of the target's normals in degrees.
fn max_error(directions: &[Vec3], quality: Quality) -> Result<f64, Failed> {
    let found = normals_of(directions, quality)?;
    Ok(found.iter().zip(directions).map(|(found, expected)| angle(*found, expected.as_dvec3())).fold(0.0, f64::max))
}

fn normals() -> Result<(), Failed> {
    let directions = directions();
    for normals in NORMALS {
        let quality = Quality { normals, ..Quality::balanced() };
        let error = max_error(&directions, quality)?;
        println!("{normals:?}: an error of up to {error:.5} degrees, of {}", normals.max_error_degrees());
        // A much smaller error means that the directions do not include the worst cases.
        if !(normals.max_error_degrees() * 0.4..=normals.max_error_degrees()).contains(&error) {
            return Err(format!("{normals:?} has an error of {error}, of {}", normals.max_error_degrees()).into());
        }
        let axes = &directions[..6];
        for (found, axis) in normals_of(axes, quality)?.into_iter().zip(axes) {
            // The shader computes in f32.
            if angle(found, axis.as_dvec3()) > 1e-4 {
                return Err(format!("{normals:?}: {axis} is {found}").into());
            }
        }
        // A normal of 0 means the triangle's own, which the shader computes from the positions of neighbouring pixels.
        for found in &normals_of(&[Vec3::ZERO; SIDE], quality)?[..SIDE] {
            if angle(*found, DVec3::Z) > normals.max_error_degrees() + 0.002 {
                return Err(format!("{normals:?}: none is {found}").into());
            }
        }
    }
    Ok(())
}

fn packed_normals() -> Result<(), Failed> {
    let normals = NormalFormat::Octahedral16;
    let directions = directions();
    let quality = Quality { normals, vertices: VertexFormat::Packed, ..Quality::balanced() };
    let (error, bound) = (
        max_error(&directions, quality)?,
        VertexFormat::Packed.max_normal_error_degrees() + normals.max_error_degrees(),
    );
    println!("packed: an error of up to {error:.5} degrees, of {bound}");
    if !(0.3..=bound).contains(&error) {
        return Err(format!("an error of {error} degrees, of {bound}").into());
    }
    // The shader's normal is that of the unpacked vertex.
    let unpacked = |normal: &Vec3| {
        let vertex = Vertex { normal: normal.to_array(), ..Vertex::default() };
        DVec3::from(
            drawloom::scene::internal::PackedVertex::new(&vertex, Default::default()).unpacked().normal.map(f64::from),
        )
    };
    for (found, normal) in normals_of(&directions, quality)?.into_iter().zip(&directions) {
        if angle(found, unpacked(normal)) > normals.max_error_degrees() {
            return Err(format!("{normal} is {found}, and should be {}", unpacked(normal)).into());
        }
    }
    Ok(())
}

fn diffuse() -> Result<(), Failed> {
    for diffuse in (0..=40).map(|step| Vec3::new(0.025, 0.02, 0.0247) * step as f32) {
        let material = Material { diffuse, ..Material::default() };
        let scene = one_quad_per_pixel(&[(Vec3::Z, Vec2::ZERO)], material, Vec::new())?;
        let read = |diffuse| -> Result<_, Failed> {
            let mut fixture = fixture(Quality { diffuse, ..Quality::balanced() })?;
            let recorded = fixture.record(&scene)?;
            Ok(fixture.submit(recorded)?.read(0, "diffuse")?)
        };
        let (bytes, halves) = (read(DiffuseFormat::Srgb8)?, read(DiffuseFormat::HalfFloat)?);
        if [bytes.format, halves.format] != [Format::Rgba8Srgb, Format::Rgba16Float] {
            return Err(format!("{:?} and {:?}", bytes.format, halves.format).into());
        }
        for channel in 0..3 {
            let expected = f64::from(diffuse[channel]);
            let byte = f64::from(bytes.bytes[channel]);
            let half = f16::from_le_bytes([halves.bytes[channel * 2], halves.bytes[channel * 2 + 1]]).to_f64();
            let errors =
                [(byte - srgb(expected) * 255.0).abs() / 0.6, (half - expected).abs() / (expected / 1024.0).max(1e-7)];
            if errors.iter().any(|error| *error > 1.0) {
                return Err(format!("{expected} became {byte} and {half}").into());
            }
        }
    }
    Ok(())
}

fn packed() -> Quality {
    Quality { vertices: VertexFormat::Packed, ..Quality::balanced() }
}

/// A scene with a texture. Each pixel shows a different texel, with texture coordinates that half floats hold exactly.
fn texels() -> Result<Scene, Failed> {
    let pixels = (0..=255_u8).flat_map(|row| (0..=255_u8).flat_map(move |column| [column, row, column ^ row, 255]));
    let texture = Texture::new("numbers", 256, 256, pixels.collect())?;
    let texel = |number: usize| {
        let (column, row) = (number % SIDE * 2, number / SIDE * 2 + 1);
        (Vec3::Z, Vec2::new(5.0 + (column as f32 + 0.5) / 256.0, -9.0 + (row as f32 + 0.5) / 256.0))
    };
    let quads: Vec<_> = (0..SIDE * SIDE).map(texel).collect();
    one_quad_per_pixel(&quads, Material { diffuse: Vec3::ONE, ..Material::default() }, vec![texture])
}

fn packed_without_loss() -> Result<(), Failed> {
    for (name, scene) in [("everything", everything()), ("field", field(400)), ("texels", texels()?)] {
        let read = |quality| -> Result<_, Failed> {
            let mut fixture = fixture(quality)?;
            let recorded = fixture.record(&scene)?;
            let uploaded = recorded.statistics().uploaded;
            let submission = fixture.submit(recorded)?;
            let targets = ["picture", "depth", "normal", "diffuse"].map(|target| submission.read(0, target));
            Ok((targets.into_iter().collect::<Result<Vec<_>, _>>()?, uploaded))
        };
        let (full, full_bytes) = read(Quality::balanced())?;
        let (small, small_bytes) = read(packed())?;
        if full != small {
            return Err(format!("{name} differs").into());
        }
        if name == "texels" {
            let mut colors: Vec<_> = full[3].bytes.chunks_exact(4).collect();
            colors.sort_unstable();
            colors.dedup();
            if colors.len() != SIDE * SIDE {
                return Err(format!("{} texels are visible", colors.len()).into());
            }
            let saved = (SIDE * SIDE * 4 * 12) as u64;
            if full_bytes - small_bytes != saved {
                return Err(format!("{full_bytes} bytes became {small_bytes}").into());
            }
        }
    }
    Ok(())
}

/// Fails if the distance between the scene's picture in this quality and `balanced`, its picture in the balanced one,
/// exceeds `max`.
fn expect_within(
    name: &str,
    (scene, balanced): (&Scene, &Picture),
    quality: Quality,
    max: Distance,
) -> Result<(), Failed> {
    let distance = Distance::between(&as_image(&fixture(quality)?.draw(scene)?)?, &as_image(balanced)?)?;
    println!("{name}: {distance:?}");
    if distance.root_mean_square > max.root_mean_square || distance.worst_tile > max.worst_tile {
        return Err(format!("{name}: {distance:?}").into());
    }
    Ok(())
}

/// The error of a cosine is at most the angle, 0.0068. The error of a picture is at most as much, because the tone
/// curve is flatter than sRGB's inverse where it matters, plus half a step of 255. One tile may also differ in a few
/// pixels of a texture.
fn packed_within_bound() -> Result<(), Failed> {
    let max = Distance { root_mean_square: 0.0068 + 0.002, worst_tile: 0.03 };
    let scene = colonnade()?;
    expect_within("colonnade", (&scene, &draw(&scene)?), packed(), max)
}

fn targets_within_bound() -> Result<(), Failed> {
    let balanced = Quality::balanced();
    for (name, scene) in [("everything", everything()), ("colonnade", small_colonnade()?)] {
        let drawn = (&scene, &draw(&scene)?);
        for normals in NORMALS {
            // As above, for the sum of both errors.
            let angle = (normals.max_error_degrees() + NormalFormat::HalfFloat.max_error_degrees()).to_radians();
            let max = Distance { root_mean_square: angle + 0.002, worst_tile: 2.0 * angle + 0.004 };
            expect_within(&format!("{name}, {normals:?}"), drawn, Quality { normals, ..balanced }, max)?;
        }
        let quality = Quality { diffuse: DiffuseFormat::HalfFloat, ..balanced };
        let max = Distance { root_mean_square: 0.003, worst_tile: 0.005 };
        expect_within(&format!("{name}, diffuse as half floats"), drawn, quality, max)?;
    }
    Ok(())
}

fn qualities() -> Vec<Quality> {
    let balanced = Quality::balanced();
    vec![
        packed(),
        balanced,
        Quality { normals: NormalFormat::Octahedral8, ..packed() },
        Quality { normals: NormalFormat::Octahedral16, diffuse: DiffuseFormat::HalfFloat, ..packed() },
        Quality { tone_curve: ToneCurve::Clipped, ..balanced },
        Quality { normals: NormalFormat::Octahedral10, ..balanced },
        balanced,
    ]
}

fn changes() -> Result<(), Failed> {
    for (name, scene) in [("everything", everything()), ("colonnade", small_colonnade()?)] {
        let mut changing = Fixture::new()?;
        changing.draw(&scene)?;
        for quality in qualities() {
            changing.renderer.set_quality(quality)?;
            let expected = fixture(quality)?.draw(&scene)?;
            for frame in 0..3 {
                if changing.draw(&scene)? != expected {
                    return Err(format!("{name}, frame {frame} of {quality:?}").into());
                }
            }
        }
    }
    Ok(())
}

fn frame_in_flight() -> Result<(), Failed> {
    let scene = small_colonnade()?;
    let (full, small) = (draw(&scene)?, fixture(packed())?.draw(&scene)?);
    let mut fixture = Fixture::new()?;
    let mut previous = fixture.record(&scene)?;
    for (index, (quality, expected)) in [(packed(), &full), (Quality::balanced(), &small)].into_iter().enumerate() {
        fixture.renderer.set_quality(quality)?;
        let next = fixture.record(&scene)?;
        if fixture.submit(previous)?.read(0, "picture")? != *expected {
            return Err(format!("frame {index} shows a later frame's vertices").into());
        }
        previous = next;
    }
    if fixture.submit(previous)?.read(0, "picture")? == full { Ok(()) } else { Err("the last frame differs".into()) }
}

/// A pixel of the picture of an empty scene with this background.
fn background(deferred: Deferred, quality: Option<Quality>, radiance: Vec3) -> Result<[u8; 3], Failed> {
    let mut scene = Scene::new();
    scene.background = radiance;
    scene.cameras = vec![sized(Camera::looking_at("main", DVec3::Z, DVec3::ZERO), [4, 4])];
    let mut fixture = Fixture::with(1, |builder| {
        let builder = builder.pipeline(deferred);
        if let Some(quality) = quality { builder.quality(quality) } else { builder }
    })?;
    Ok(pixel(&fixture.draw(&scene)?, 1, 2))
}

/// sRGB of a radiance clipped at 1, computed in f64.
fn clipped_srgb(radiance: Vec3) -> [u8; 3] {
    radiance.to_array().map(|radiance| (srgb(f64::from(radiance).clamp(0.0, 1.0)) * 255.0).round() as u8)
}

fn srgb(linear: f64) -> f64 {
    if linear <= 0.003_130_8 { linear * 12.92 } else { 1.055 * linear.powf(1.0 / 2.4) - 0.055 }
}

fn clipped() -> Result<(), Failed> {
    let tone_mapping = |exposure: f32| ToneMapping { curve: ToneCurve::Clipped, ..ToneMapping::new(exposure) };
    for (radiance, exposure) in [
        (Vec3::new(0.0, 0.25, 0.5), 1.0),
        (Vec3::new(0.9, 1.0, 1.1), 1.0),
        (Vec3::new(0.1, 60_000.0, 1.0), 0.5),
        (Vec3::splat(0.001), 100.0),
        (Vec3::new(0.0, 1.0, 5.0), f32::INFINITY),
        (Vec3::ONE, f32::NAN),
    ] {
        let times = if exposure > 0.0 { exposure.min(1e30) } else { 0.0 };
        let found = background(Deferred::new().post(tone_mapping(exposure)), None, radiance)?;
        assert_color(found, clipped_srgb(radiance * times))?;
    }
    Ok(())
}

/// A post-processing step that removes red.
struct WithoutRed(String, String);

impl RenderProcess for WithoutRed {
    fn name(&self) -> &str {
        "without red"
    }

    fn declare(&self, declare: &mut Declare) {
        declare.samples(&self.0);
        declare.clears_color(&self.1, Format::Rgba16Float, ClearColor::Value([0.0; 4]));
    }

    fn draws(&self) -> Draws<'_> {
        Draws::FullScreen(FullScreen {
            shader: "
                @group(2) @binding(1) var source: texture_2d<f32>;

                @fragment
                fn fragment(in: FullScreenPixel) -> @location(0) vec4<f32> {
                    return textureLoad(source, vec2<i32>(in.position.xy), 0) * vec4<f32>(0.0, 1.0, 1.0, 1.0);
                }
            ",
            ..FullScreen::default()
        })
    }
}

fn curve_of_quality() -> Result<(), Failed> {
    let radiance = Vec3::new(0.4, 0.6, 0.8);
    let exposure = Exposure::new(0.5);
    let without_red = |source: &str, target: &str| WithoutRed(source.to_owned(), target.to_owned());
    let deferred = || Deferred::new().post(without_red).post(ToneMapping::new(exposure.clone()));
    let with = |tone_curve| Some(Quality { tone_curve, ..Quality::balanced() });
    let without_red_radiance = Vec3::new(0.0, 0.6, 0.8);
    let filmic = |exposure: f32| tone_mapped((without_red_radiance * exposure).to_array().map(f64::from));
    assert_color(background(deferred(), None, radiance)?, filmic(0.5))?;
    assert_color(background(deferred(), with(ToneCurve::Filmic), radiance)?, filmic(0.5))?;
    assert_color(
        background(deferred(), with(ToneCurve::Clipped), radiance)?,
        clipped_srgb(without_red_radiance * 0.5),
    )?;
    // The quality leaves the engine's exposure.
    exposure.set(1.0);
    assert_color(background(deferred(), with(ToneCurve::Clipped), radiance)?, clipped_srgb(without_red_radiance))
}
