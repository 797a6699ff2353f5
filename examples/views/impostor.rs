//! A tree that is far away: one square with the tree's picture in the place of all its leaves.

use drawloom::command::Selection;
use drawloom::glam::{DVec3, Quat, Vec3};
use drawloom::handle::Handle;
use drawloom::process::{
    CommandDraws, CpuShader, Declare, Draws, InjectionPoint, ObjectCpuShader, ObjectPixel, PassInputs, RenderProcess,
    ShaderObject, VARYINGS, VertexInput, VertexOutput, targets,
};
use drawloom::raster::{Real, Vector4};
use drawloom::scene::{
    Camera, LayerMask, Material, MaterialType, Mesh, Redraw, RenderObject, Scene, SceneError, ViewKind,
};

use crate::surface::Surface;

/// The camera that sees the impostor.
const VIEWER: &str = "main";

/// The view of the tree.
pub const VIEW: &str = "impostor";

/// Where the tree is, and its radius in metres.
pub const TREE: (DVec3, f64) = (DVec3::new(3.5, 1.0, 8.2), 1.0);

/// The layer of what the impostor stands for.
pub const TREE_LAYER: LayerMask = LayerMask::layer(6);

/// The layer of the impostor.
pub const LAYER: LayerMask = LayerMask::layer(7);

/// By how much the tree may have turned, in radians, before its picture is drawn again: 5°.
pub const MAX_ANGLE: f64 = 0.087;

/// The material type of the square, so that the pipeline does not draw it.
const IMPOSTOR: MaterialType<u32> = MaterialType::new("impostor");

/// The camera of the tree's picture, for what `viewer` sees.
pub fn camera(viewer: &Camera, before: Option<&Camera>) -> Option<Camera> {
    let camera = viewer.impostor(VIEW, TREE, 192, before, MAX_ANGLE)?;
    Some(Camera { layers: TREE_LAYER, redraw: Redraw::OnCameraChange, ..camera })
}

/// Lets the main camera see the impostor, and all others the tree: the impostor looks right from one position only.
pub fn choose_layers(camera: &mut Camera) {
    let hidden = if camera.name == VIEWER { TREE_LAYER } else { LAYER };
    camera.layers = LayerMask(camera.layers.0 & !hidden.0);
}

/// Adds the tree's leaves and the square, which faces `camera`.
///
/// # Errors
/// If the scene has no room for them.
pub fn add_tree(
    scene: &mut Scene,
    leaf: Handle<Mesh>,
    square: Handle<Mesh>,
    camera: &Camera,
) -> Result<(), SceneError> {
    let colors = [Vec3::new(0.1, 0.32, 0.06), Vec3::new(0.22, 0.4, 0.05), Vec3::new(0.4, 0.34, 0.04)];
    let mut leaves = Vec::new();
    for diffuse in colors {
        leaves.push(scene.add(Material { diffuse, ..Material::default() })?);
    }
    for index in 0..160_u16 {
        // Around the tree, a golden angle apart.
        let share = f32::from(index) / 160.0;
        let (height, turn) = (1.0 - 2.0 * share, f32::from(index) * 2.399_963);
        let across = (1.0 - height * height).sqrt();
        let offset = Vec3::new(across * turn.cos(), height, across * turn.sin()) * (0.55 + 0.2 * (turn * 3.7).sin());
        let material = leaves[usize::from(index) % leaves.len()];
        let mut object = RenderObject::new(leaf, material, TREE.0 + offset.as_dvec3());
        object.orientation = Quat::from_rotation_y(turn) * Quat::from_rotation_x(height);
        (object.scale, object.layers) = (Vec3::new(0.25, 0.06, 0.17), TREE_LAYER);
        scene.add_object(object)?;
    }
    let material = scene.add(Material { values: Some(IMPOSTOR.values(0)), ..Material::default() })?;
    let mut object = RenderObject::new(square, material, TREE.0);
    object.orientation = camera.orientation;
    object.scale = Vec3::new(1.0, 1.0, 0.0) * camera.impostor_half_width(TREE.0) as f32 + Vec3::Z;
    object.layers = LAYER;
    scene.add_object(object)?;
    Ok(())
}

/// Draws the square with the tree's picture, where that shows the tree.
#[derive(Clone, Copy)]
pub struct Impostor;

impl RenderProcess for Impostor {
    fn name(&self) -> &str {
        "impostor"
    }

    fn declare(&self, declare: &mut Declare) {
        declare.at(InjectionPoint::AfterLighting);
        // What stands in front of it is drawn over it only where depth says so.
        declare.before(Surface::pool().name());
        declare.samples_view(ViewKind::Reflection, VIEW, targets::RADIANCE);
        declare.samples_view(ViewKind::Reflection, VIEW, targets::DEPTH);
        declare.draws_over(targets::RADIANCE);
        declare.draws_depth(targets::DEPTH);
    }

    fn draws(&self) -> Draws<'_> {
        let (shader, selection) = (include_str!("impostor.wgsl"), Selection::OPAQUE.of_material_type(IMPOSTOR));
        Draws::Commands(CommandDraws { shader, selection, discards: true, ..CommandDraws::default() })
    }

    fn cpu_shader(&self) -> Option<CpuShader> {
        Some(CpuShader::objects(*self))
    }
}

impl<R: Real> ObjectCpuShader<R> for Impostor {
    fn vertex(&self, pass: &PassInputs<'_, R>, object: &ShaderObject<R>, vertex: &VertexInput<R>) -> VertexOutput<R> {
        let relative = object.relative_position(vertex.position);
        let mut varyings = [R::zero(); VARYINGS];
        varyings[..2].copy_from_slice(&vertex.uv.0);
        VertexOutput { clip: pass.view.clip_position(relative), varyings }
    }

    fn fragment(&self, pass: &PassInputs<'_, R>, pixel: &ObjectPixel<R>, targets: &mut [Vector4<R>]) -> bool {
        let [u, v, ..] = pixel.varyings;
        let [width, height] = pass.sampled[0].size();
        let nearest = |share: R, size: usize| ((share.as_f64().max(0.0) * size as f64) as usize).min(size - 1);
        let coordinates = [nearest(u, width), nearest(v, height)];
        targets[0] = pass.sampled[0].load(coordinates, 0);
        pass.sampled[1].load(coordinates, 0)[0] > R::zero()
    }
}
