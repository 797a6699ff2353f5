//! The whole scene.

use drawloom::glam::DVec3;
use drawloom::scene::{Camera, Projection, Scene, SceneError};

use super::cornell_box;
use super::layout::PODIUM;
use super::shared_assets::SharedAssets;
use super::site::Site;

/// A Cornell box on a podium in a colonnade at dusk, some 1,040 objects of 27 meshes: slabs of checkered floor, fluted
/// columns with bases, capitals and arches, roof beams, banners, urns, candlesticks and cypresses. Its camera `main`
/// looks down the nave into the box.
///
/// It exercises every part of a frame:
///
/// - a lamp over the nave ([`Light::Hemispherical`]), surrounded by candlesticks that cast shadows across the floor,
///   and a second one in the box;
/// - some 60 small point lights with ranges of a few metres: coloured lanterns, candles, fires and glow-worms; 20
///   spotlights down columns and onto banners; a low sun and the sky;
/// - coloured glass ([`Blend::Alpha`]), panes one behind the other and a window; flames and hundreds of sparks
///   ([`Blend::Additive`]); smoke ([`Blend::Subtractive`]);
/// - instances that are rotated, scaled and mirrored, triangle lists and a strip, a texture, single- and double-sided
///   materials.
///
/// Every call returns the same scene.
///
/// [`Light::Hemispherical`]: drawloom::scene::Light::Hemispherical
/// [`Blend::Alpha`]: drawloom::scene::Blend::Alpha
/// [`Blend::Additive`]: drawloom::scene::Blend::Additive
/// [`Blend::Subtractive`]: drawloom::scene::Blend::Subtractive
///
/// ```
/// use drawloom_testing::demo;
///
/// let scene = demo::colonnade()?;
/// assert_eq!(scene.cameras[0].name, "main");
/// # Ok::<(), drawloom::scene::SceneError>(())
/// ```
///
/// # Errors
/// Returns the errors of [`Scene::add`] and [`Scene::add_object`]; none is expected.
pub fn colonnade() -> Result<Scene, SceneError> {
    let mut scene = Scene::new();
    let assets = SharedAssets::new(&mut scene)?;
    let mut site = Site { scene, assets };
    site.ground()?;
    site.rows()?;
    site.aisles()?;
    site.nave()?;
    site.shrine()?;
    site.cypresses()?;
    cornell_box::add(&mut site.scene, DVec3::new(0.0, f64::from(PODIUM), 0.0))?;
    site.sky();
    site.lamp()?;
    site.spotlights();
    site.glows()?;
    site.glass()?;
    site.fires()?;
    let mut scene = site.scene;
    let camera = Camera::looking_at("main", DVec3::new(1.5, 3.3, 12.4), DVec3::new(-0.2, 2.0, -3.0));
    scene.cameras.push(Camera { projection: Projection::Perspective { field_of_view: 58_f32.to_radians() }, ..camera });
    Ok(scene)
}
