//! The meshes and materials of the colonnade.

use drawloom::glam::{Vec2, Vec3};
use drawloom::handle::Handle;
use drawloom::scene::{Material, Mesh, Scene, SceneError, Texture};

use super::layout::BAY;
use super::mesh_builder::{MeshBuilder, Revolution, banner};

/// The assets that several parts of the scene use. Meshes stand on their origin unless stated otherwise.
#[derive(Clone, Copy)]
pub(super) struct SharedAssets {
    /// A cube of side 1 around its origin.
    pub block: Handle<Mesh>,
    /// A square of side 1 around its origin, facing up.
    pub square: Handle<Mesh>,
    /// A square of side 1, with its upper side at height 0.
    pub slab: Handle<Mesh>,
    /// 0.5 high.
    pub base: Handle<Mesh>,
    /// 1 high.
    pub shaft: Handle<Mesh>,
    /// 0.6 high.
    pub capital: Handle<Mesh>,
    /// As wide as a bay, along the X axis; stands on the capitals.
    pub arch: Handle<Mesh>,
    /// Leans towards −X.
    pub buttress: Handle<Mesh>,
    pub urn: Handle<Mesh>,
    pub plant: Handle<Mesh>,
    /// A ball of radius 1 around its origin.
    pub ball: Handle<Mesh>,
    /// 1 high.
    pub cypress: Handle<Mesh>,
    /// Hangs from its origin.
    pub banner: Handle<Mesh>,
    pub stones: [Handle<Material>; 3],
    pub checker: Handle<Material>,
    pub lawn: Handle<Material>,
    pub wood: Handle<Material>,
    pub bronze: Handle<Material>,
    pub leaves: Handle<Material>,
    pub banners: [Handle<Material>; 4],
}

impl SharedAssets {
    /// Adds the assets to a scene.
    ///
    /// # Errors
    /// As [`colonnade`](super::colonnade).
    pub(super) fn new(scene: &mut Scene) -> Result<Self, SceneError> {
        let checker = scene.add(checker(256)?)?;
        let mut material = |name: &str, diffuse: [f32; 3]| {
            scene.add(Material { name: name.into(), diffuse: diffuse.into(), ..Material::default() })
        };
        let stones = [
            material("sandstone", [0.66, 0.56, 0.43])?,
            material("limestone", [0.72, 0.67, 0.58])?,
            material("slate", [0.42, 0.42, 0.45])?,
        ];
        let lawn = material("lawn", [0.10, 0.17, 0.06])?;
        let wood = material("wood", [0.30, 0.17, 0.09])?;
        let bronze = material("bronze", [0.48, 0.26, 0.11])?;
        let leaves = material("leaves", [0.09, 0.20, 0.07])?;
        let mut cloth = |name: &str, diffuse: [f32; 3]| {
            let diffuse = diffuse.into();
            scene.add(Material { name: name.into(), diffuse, double_sided: true, ..Material::default() })
        };
        let banners = [
            cloth("crimson", [0.62, 0.05, 0.07])?,
            cloth("ochre", [0.75, 0.44, 0.07])?,
            cloth("indigo", [0.10, 0.10, 0.45])?,
            cloth("teal", [0.03, 0.38, 0.36])?,
        ];
        let floor =
            Material { name: "floor".into(), diffuse: Vec3::ONE, texture: Some(checker), ..Material::default() };
        Ok(Self {
            block: MeshBuilder::default().cuboid(Vec3::splat(-0.5), Vec3::splat(0.5)).add_to(scene, "block")?,
            square: MeshBuilder::default()
                .quad([[-0.5, 0.5], [0.5, 0.5], [0.5, -0.5], [-0.5, -0.5]].map(|[x, z]| Vec3::new(x, 0.0, z)))
                .add_to(scene, "square")?,
            slab: MeshBuilder::default()
                .cuboid(Vec3::new(-0.5, -0.3, -0.5), Vec3::new(0.5, 0.0, 0.5))
                .add_to(scene, "slab")?,
            base: base().add_to(scene, "base")?,
            shaft: shaft().add_to(scene, "shaft")?,
            capital: capital().add_to(scene, "capital")?,
            arch: MeshBuilder::default().arch(BAY, 1.4, 1.87, 0.7).add_to(scene, "arch")?,
            buttress: buttress().add_to(scene, "buttress")?,
            urn: urn().add_to(scene, "urn")?,
            plant: ball(0.14, 13).add_to(scene, "plant")?,
            ball: ball(0.0, 0).add_to(scene, "ball")?,
            cypress: cypress().add_to(scene, "cypress")?,
            banner: scene.add(banner(2.6)?)?,
            checker: scene.add(floor)?,
            stones,
            lawn,
            wood,
            bronze,
            leaves,
            banners,
        })
    }
}

fn base() -> MeshBuilder {
    let profile = profile(&[
        [0.60, 0.18],
        [0.62, 0.22],
        [0.62, 0.28],
        [0.58, 0.32],
        [0.50, 0.34],
        [0.50, 0.38],
        [0.54, 0.40],
        [0.54, 0.45],
        [0.48, 0.50],
        [0.0, 0.50],
    ]);
    MeshBuilder::default()
        .cuboid(Vec3::new(-0.65, 0.0, -0.65), Vec3::new(0.65, 0.18, 0.65))
        .revolved(&profile, &Revolution::EDGES)
}

/// A shaft with twenty flutes, slightly thicker below its middle (entasis).
fn shaft() -> MeshBuilder {
    let rings = 8;
    let profile: Vec<_> = (0..=rings)
        .map(|ring| {
            let height = ring as f32 / rings as f32;
            Vec2::new(0.45 - 0.08 * height * height, height)
        })
        .collect();
    MeshBuilder::default().revolved(&profile, &Revolution { segments: 120, grooves: Some((20, 0.09)), smooth: true })
}

fn capital() -> MeshBuilder {
    let profile =
        profile(&[[0.37, 0.0], [0.42, 0.03], [0.42, 0.09], [0.38, 0.12], [0.40, 0.22], [0.52, 0.36], [0.60, 0.40]]);
    MeshBuilder::default()
        .revolved(&profile, &Revolution::EDGES)
        .cuboid(Vec3::new(-0.64, 0.40, -0.64), Vec3::new(0.64, 0.60, 0.64))
}

fn buttress() -> MeshBuilder {
    let [inner, outer] = [0.0, 0.45];
    let [foot, head] = [0.0, 3.9];
    let [front, back] = [0.22, -0.22];
    let at = Vec3::new;
    let waist = 1.2;
    MeshBuilder::default()
        .cuboid(at(inner, foot, back), at(outer, waist, front))
        .quad([at(outer, waist, front), at(outer, waist, back), at(inner, head, back), at(inner, head, front)])
        .quad([at(inner, waist, front), at(outer, waist, front), at(inner + 0.01, head, front), at(inner, head, front)])
        .quad([at(outer, waist, back), at(inner, waist, back), at(inner, head, back), at(inner + 0.01, head, back)])
}

fn urn() -> MeshBuilder {
    let profile = profile(&[
        [0.26, 0.00],
        [0.25, 0.06],
        [0.12, 0.12],
        [0.09, 0.20],
        [0.14, 0.27],
        [0.30, 0.38],
        [0.40, 0.52],
        [0.42, 0.66],
        [0.36, 0.78],
        [0.26, 0.86],
        [0.27, 0.92],
        [0.36, 0.97],
        [0.38, 0.985],
        [0.38, 1.00],
        [0.36, 1.01],
        [0.33, 1.00],
        [0.24, 0.94],
        [0.0, 0.92],
    ]);
    MeshBuilder::default().revolved(&profile, &Revolution::CURVE)
}

fn ball(groove_depth: f32, grooves: usize) -> MeshBuilder {
    let rings = 12;
    let profile: Vec<_> = (0..=rings)
        .map(|ring| {
            let (sine, cosine) = (std::f32::consts::PI * ring as f32 / rings as f32).sin_cos();
            // Exactly 0 at the poles, on the axis.
            Vec2::new(if ring % rings == 0 { 0.0 } else { sine }, -cosine)
        })
        .collect();
    let grooves = (grooves > 0).then_some((grooves, groove_depth));
    MeshBuilder::default().revolved(&profile, &Revolution { segments: 36, grooves, smooth: true })
}

fn cypress() -> MeshBuilder {
    let profile = profile(&[
        [0.12, 0.0],
        [0.12, 0.08],
        [0.55, 0.14],
        [0.80, 0.28],
        [0.78, 0.45],
        [0.58, 0.68],
        [0.28, 0.88],
        [0.0, 1.0],
    ]);
    MeshBuilder::default().revolved(&profile, &Revolution { segments: 42, grooves: Some((7, 0.22)), smooth: true })
}

fn profile(points: &[[f32; 2]]) -> Vec<Vec2> {
    points.iter().map(|&point| Vec2::from(point)).collect()
}

/// Four by four tiles of light and dark marble; the veins are domain-warped sines.
fn checker(size: u32) -> Result<Texture, SceneError> {
    let pixels = (0..size * size).flat_map(|pixel| {
        let [x, y] = [pixel % size, pixel / size].map(|position| (position as f32 + 0.5) / size as f32);
        let [column, row] = [x, y].map(|position| (position * 4.0) as u32);
        let tile = (column * 7 + row * 13) as f32;
        let bend = (x * 23.0 + tile).sin() * 1.1 + (y * 31.0 - tile).sin() * 0.9;
        let vein = ((x + y) * 40.0 + tile * 1.7 + bend * 2.0).sin().abs().powf(0.35);
        let edge = [x, y].into_iter().any(|position| !(0.02..0.98).contains(&(position * 4.0).fract()));
        let light = (column + row) % 2 == 0;
        let shade = if edge { 0.6 } else { 0.82 + 0.18 * vein };
        let color = if light { [214.0, 204.0, 186.0] } else { [92.0, 84.0, 82.0] };
        let [red, green, blue] = color.map(|channel| (channel * shade) as u8);
        [red, green, blue, 255]
    });
    Texture::new("checker", size, size, pixels.collect())
}
