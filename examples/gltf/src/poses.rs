//! The shapes of deformed objects: a palette of joints, morph targets, and how much each of them counts.

use drawloom::glam::{DAffine3, DMat3, DMat4, DQuat, DVec3, Mat4, Quat, Vec3};
use drawloom::scene::Bounds;

use crate::attributes::Pose;
use crate::error::Problem;
use crate::primitives::Primitive;
use crate::skins::Skin;
use crate::transforms::decompose;

/// The palettes and morph data of all objects.
#[derive(Debug, Default)]
pub(crate) struct Poses {
    /// From the shape of a mesh to that of an object, for each joint of each object.
    pub(crate) palette: Vec<Mat4>,
    /// The morph targets of all primitives, and the weights of all objects.
    pub(crate) morphs: Vec<f32>,
}

/// An object in its pose.
pub(crate) struct Posed {
    pub(crate) position: DVec3,
    pub(crate) orientation: Quat,
    pub(crate) scale: Vec3,
    pub(crate) bounds: Bounds,
    /// `None` if the mesh has the object's shape.
    pub(crate) pose: Option<Pose>,
}

impl Poses {
    /// Adds the morph targets of a primitive. Returns where they begin.
    pub(crate) fn add_targets(&mut self, primitive: &Primitive) -> u32 {
        let first = self.morphs.len();
        self.morphs.extend_from_slice(&primitive.targets.numbers);
        first as u32
    }

    /// Poses a primitive of a node: by its skin, its morph weights and the node's transform.
    ///
    /// # Errors
    /// If a vertex has a joint that the skin lacks, there are too many joints, or a pose is not finite.
    pub(crate) fn pose(
        &mut self,
        primitive: &Primitive,
        first_target: u32,
        node: usize,
        world: &[DAffine3],
        skin: Option<&Skin>,
        weights: &[f32],
    ) -> Result<Posed, Problem> {
        let skin = skin.zip(primitive.joints.as_ref());
        let placed = decompose(&world[node]);
        let (position, matrices, is_mirrored) = match skin {
            Some((skin, joints)) => {
                let count = skin.joints.len();
                if joints.greatest as usize >= count {
                    let element = primitive.mesh.name().to_owned();
                    let index = joints.greatest.into();
                    return Err(Problem::IndexOutOfRange { element, index, count, what: "joints of its skin" });
                }
                let origin = world[skin.joints[0].0].translation;
                let to_origin = DAffine3::from_translation(-origin);
                let matrices: Vec<_> =
                    skin.joints.iter().map(|(joint, bind)| to_origin * world[*joint] * *bind).collect();
                let is_mirrored = matrices[0].matrix3.determinant() < 0.0;
                (origin, matrices, is_mirrored)
            }
            None if placed.is_skewed => {
                let linear = DAffine3::from_mat3(world[node].matrix3);
                (placed.translation, vec![linear; joint_count(primitive)], placed.scale.x < 0.0)
            }
            None if !primitive.targets.reach.is_empty() => {
                let unchanged = vec![DAffine3::IDENTITY; joint_count(primitive)];
                let mut posed = self.posed(primitive, first_target, node, &unchanged, weights)?;
                (posed.position, posed.orientation) = (placed.translation, placed.rotation.as_quat().normalize());
                posed.scale = placed.scale.as_vec3();
                return Ok(posed);
            }
            None => {
                return Ok(Posed {
                    position: placed.translation,
                    orientation: placed.rotation.as_quat().normalize(),
                    scale: placed.scale.as_vec3(),
                    bounds: primitive.mesh.bounds(),
                    pose: None,
                });
            }
        };
        // Which side of a triangle is its front depends on the object's scale.
        let mirror = DVec3::new(if is_mirrored { -1.0 } else { 1.0 }, 1.0, 1.0);
        let to_object = DAffine3::from_mat3(DMat3::from_diagonal(mirror));
        let matrices: Vec<_> = matrices.into_iter().map(|matrix| to_object * matrix).collect();
        let posed = self.posed(primitive, first_target, node, &matrices, weights)?;
        Ok(Posed { position, orientation: DQuat::IDENTITY.as_quat(), scale: mirror.as_vec3(), ..posed })
    }

    /// An object at the world's origin.
    fn posed(
        &mut self,
        primitive: &Primitive,
        first_target: u32,
        node: usize,
        matrices: &[DAffine3],
        weights: &[f32],
    ) -> Result<Posed, Problem> {
        let (targets, mesh) = (&primitive.targets, &primitive.mesh);
        let pose = Pose {
            first_joint: self.palette.len() as u32,
            first_weight: self.morphs.len() as u32,
            first_target,
            target_count: targets.reach.len() as u32,
            vertex_count: mesh.vertices().len() as u32,
        };
        self.morphs.extend(weights.iter().take(targets.reach.len()));
        let matrices: Vec<_> = matrices.iter().map(|matrix| DMat4::from(*matrix).as_mat4()).collect();
        let reach: Vec3 = targets.reach.iter().zip(weights).map(|(reach, weight)| *reach * weight.abs()).sum();
        let whole = [(0, mesh.corners())].into();
        // A vertex is in the convex hull of where its joints bring it.
        let boxes = primitive.joints.as_ref().map_or(&whole, |joints| &joints.boxes);
        let corners = boxes.iter().flat_map(|(joint, [low, high])| {
            let (low, high, matrix) = (*low - reach, *high + reach, matrices[*joint as usize]);
            (0..8).map(move |corner| {
                let pick = |axis: usize| if corner >> axis & 1 == 0 { low[axis] } else { high[axis] };
                matrix.transform_point3(Vec3::new(pick(0), pick(1), pick(2)))
            })
        });
        let mut bounds = Bounds::around(corners);
        // What the device rounds.
        bounds.radius *= 1.001;
        if !bounds.center.is_finite() || !bounds.radius.is_finite() {
            return Err(Problem::Transform { node, reason: "brings its mesh beyond the range of numbers" });
        }
        self.palette.extend(matrices);
        if self.palette.len() > MAX_JOINTS {
            let (element, what) = ("the scene".to_owned(), "joints of objects");
            let (count, limit) = (self.palette.len() as u64, MAX_JOINTS as u64);
            return Err(Problem::TooMany { element, what, count, limit });
        }
        Ok(Posed { position: DVec3::ZERO, orientation: Quat::IDENTITY, scale: Vec3::ONE, bounds, pose: Some(pose) })
    }
}

/// The greatest number of joints of all objects.
const MAX_JOINTS: usize = 1 << 20;

/// How many joints the palette must have for the vertices of a primitive without a skin.
fn joint_count(primitive: &Primitive) -> usize {
    primitive.joints.as_ref().map_or(1, |joints| joints.greatest as usize + 1)
}
