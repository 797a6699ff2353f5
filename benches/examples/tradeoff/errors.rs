//! The error of each knob in its own unit, and its bound. Bounds are derived here or in the knob's documentation from
//! the knob's definition, never from measurements.

use std::f64::consts::PI;

use drawloom::command::RenderCommand;
use drawloom::quality::{DepthPrecision, Quality, TransformPrecision};
use drawloom::scene::{Blend, Camera, Light, Material, Scene};

use crate::measure::{Measurement, Measurements};
use crate::settings::{Knob, Setting};
use crate::subject::Subject;
use crate::targets::{colors, directions};
use crate::{Failure, impostor, levels, paraboloid, vertices};

/// The error of a knob.
pub struct KnobError {
    /// `None` if the knob affects nothing in the scene.
    pub error: Option<f64>,
    pub metric: &'static str,
    /// `None` if no bound is known.
    pub bound: Option<f64>,
    /// The oracle that the error is measured against.
    pub oracle: &'static str,
}

/// The measurement of one setting.
struct Case<'a> {
    scene: &'a Scene,
    /// At the last position of the path.
    camera: &'a Camera,
    quality: &'a Quality,
    measured: &'a Measurement,
    exact: &'a Measurement,
}

/// # Errors
/// Returns an error if a target cannot be decoded.
pub fn of(
    setting: &Setting,
    subject: &Subject,
    path: &[Camera],
    measurements: &Measurements,
    measured: &Measurement,
) -> Result<KnobError, Failure> {
    let scene = &subject.scene;
    let camera = path.last().ok_or("the path has no position")?;
    let exact = measurements.settings.first().ok_or("nothing was measured")?;
    let configuration = &setting.configuration;
    let quality = &configuration.quality;
    let case = Case { scene, camera, quality, measured, exact };
    match setting.knob {
        Knob::Preset => Ok(KnobError {
            error: Some(measured.from_reference.rmse * 255.0),
            metric: "RMSE of 255",
            // The bound holds for `exact` alone: the error of a device that draws the same frame in f32.
            bound: (setting.name == "exact").then_some(2.0),
            oracle: "f64 reference",
        }),
        Knob::Quality(index) => case.of_quality(Knob::Quality(index).name()),
        Knob::ViewLevelOfDetail => {
            let mirrors = subject.mirror_cameras(camera);
            let commands = &measured.contents.mirrored;
            let error = mirrors.first().and_then(|mirror| levels::greatest_error(scene, mirror, commands));
            let scale = configuration.mirrors.level_of_detail_scale;
            Ok(of_levels(error, f64::from(quality.level_of_detail * scale)))
        }
        Knob::Cascades | Knob::MaxDistance => {
            let is_sun = |light: &Light| matches!(light, Light::Directional { casts_shadow: true, .. });
            let error = scene.lights.iter().any(is_sun).then_some(measured.differing[1]);
            Ok(KnobError { error, ..case.pixels_that_visibly_differ() })
        }
        Knob::Redraw => Ok(KnobError {
            error: Some(f64::from(measured.age)),
            metric: "frames that a mirror's picture is old",
            bound: Some(f64::from(configuration.mirrors.interval - 1)),
            oracle: "the frames that drew the view",
        }),
        Knob::ViewSize | Knob::ViewCameras | Knob::ViewLeftOut => Ok(case.pixels_that_visibly_differ()),
        Knob::ImpostorAngle => {
            let max_angle = configuration.impostor.unwrap_or_default();
            Ok(KnobError {
                error: impostor::greatest_displacement(subject, path, max_angle),
                metric: "degrees over the original's radius",
                // Beside the angle, what the f32 of the picture's camera rounds: a millionth of the radius.
                bound: Some(max_angle + 1e-6_f64.to_degrees()),
                oracle: "f64 rays through the impostor",
            })
        }
    }
}

/// The error of levels of detail with this limit, in pixels.
fn of_levels(error: Option<f64>, pixels: f64) -> KnobError {
    KnobError { error, metric: "pixels", bound: Some(pixels), oracle: "the stated errors of the levels, in f64" }
}

impl Case<'_> {
    /// The error of a setting of [`Quality`], by its field.
    fn of_quality(&self, field: &str) -> Result<KnobError, Failure> {
        match field {
            "opaque_order" => Ok(self.order(self.quality.opaque_order, &self.measured.contents.opaque, Blend::None)),
            "blended_order" => {
                Ok(self.order(self.quality.blended_order, &self.measured.contents.blended, Blend::Alpha))
            }
            // Culling must not remove visible objects.
            "culling" => Ok(KnobError { bound: Some(0.0), ..self.pixels_that_differ() }),
            // It has an effect only if an object is occluded.
            "occlusion" => {
                let error = (self.measured.occluded > 0).then_some(self.measured.differing[0]);
                Ok(KnobError { error, bound: Some(0.0), ..self.pixels_that_differ() })
            }
            "depth_pre_pass" => Ok(self.pixels_that_differ()),
            "normals" | "vertices" => self.normals(field),
            "diffuse" => self.diffuse(),
            "level_of_detail" => {
                let error = levels::greatest_error(self.scene, self.camera, &self.measured.contents.opaque);
                Ok(of_levels(error, f64::from(self.quality.level_of_detail)))
            }
            "shadows.side" | "shadows.filter" | "shadows.bias" | "shadows.interval" => {
                Ok(self.pixels_that_visibly_differ())
            }
            "shadows.widest_edge" => Ok(self.shadow_edges()),
            "light_cut_off" => self.light_cut_off(),
            "radiance_sum" => self.radiance_sum(),
            "tone_curve" => Ok(KnobError {
                error: Some(self.measured.from_exact.rmse * 255.0),
                metric: "RMSE of 255",
                bound: None,
                oracle: "exact",
            }),
            "transforms" => Ok(KnobError {
                error: vertices::greatest_error(self.scene, self.camera, self.quality.transforms),
                metric: "pixels",
                // The bound holds for camera-relative transforms, at any distance from the world's origin.
                bound: (self.quality.transforms == TransformPrecision::CameraRelative).then_some(1e-3),
                oracle: "f64 from the camera's definition",
            }),
            _ => Err(format!("the error of {field} is not known").into()),
        }
    }

    fn pixels_that_differ(&self) -> KnobError {
        let metric = "share of pixels that differ";
        KnobError { error: Some(self.measured.differing[0]), metric, bound: None, oracle: "exact" }
    }

    fn pixels_that_visibly_differ(&self) -> KnobError {
        let metric = "share of pixels off by more than 3 of 255";
        KnobError { error: Some(self.measured.differing[1]), metric, bound: None, oracle: "exact" }
    }

    /// The greatest depth difference of two objects in the wrong order. The order applies to opaque objects of one mesh
    /// and state, and to all blended objects. The bound is [`DepthPrecision::step`], plus the error of f32 distances:
    /// about ten roundings of 2⁻²⁴ each.
    fn order(&self, key: DepthPrecision, commands: &[RenderCommand], blend: Blend) -> KnobError {
        let (metric, oracle) = ("of the key's step in the wrong order", "f64 distances along the view's axis");
        if key.bits == 0 {
            // Any order is right.
            return KnobError { error: None, metric, bound: None, oracle };
        }
        let is_opaque = blend == Blend::None;
        let runs = commands.chunk_by(|one, other| !is_opaque || (one.mesh, one.state) == (other.mesh, other.state));
        let mut worst: Option<f64> = None;
        for run in runs {
            // Opaque objects are sorted front to back, so each is compared with the farthest before it; blended ones
            // back to front.
            let mut extreme: Option<f64> = None;
            for command in run {
                let depth = self.depth_of(command.object as usize);
                let Some(before) = extreme.replace(
                    extreme.map_or(depth, |before| if is_opaque { before.max(depth) } else { before.min(depth) }),
                ) else {
                    continue;
                };
                let (nearer, farther) = if is_opaque { (depth, before) } else { (before, depth) };
                let step = key.step(farther as f32, self.camera.near, self.camera.far) + farther.abs() * 1e-6;
                let of_step = ((farther - nearer) / step.max(f64::MIN_POSITIVE)).max(0.0);
                worst = Some(worst.map_or(of_step, |worst| worst.max(of_step)));
            }
        }
        KnobError { error: worst, metric, bound: Some(1.0), oracle }
    }

    /// The depth of the centre of the object's bounds, along the view's axis.
    fn depth_of(&self, object: usize) -> f64 {
        let scene = self.scene.as_scene_ref();
        let local = scene.scales[object].as_dvec3() * scene.bounds[object].center.as_dvec3();
        let center = scene.positions[object] + scene.orientations[object].as_dquat().normalize() * local;
        let forward = self.camera.orientation.as_dquat().normalize() * drawloom::glam::DVec3::NEG_Z;
        // Objects behind the camera count as depth 0.
        forward.dot(center - self.camera.position).max(0.0)
    }

    /// The greatest angle between a pixel's normal and that of `exact`, ignoring the side. Both cover the same pixels.
    ///
    /// `exact` has the error of its own format. A packed vertex's normal has the error δ. An interpolation of three
    /// normals at right angles at most is at least 1/√3 as long as they are, so its direction has the error √3·δ at
    /// most. No bound is known if a triangle has larger angles, or if an object is scaled non-uniformly, which rotates
    /// normals farther.
    fn normals(&self, field: &str) -> Result<KnobError, Failure> {
        let own = directions(&self.measured.contents.normal, self.quality.normals)?;
        let exact = directions(&self.exact.contents.normal, Quality::exact().normals)?;
        let angles = own.iter().zip(&exact).filter_map(|(one, other)| {
            let (one, other) = ((*one)?, (*other)?);
            // The cross product resolves small angles, which a cosine does not.
            Some(one.cross(other).length().atan2(one.dot(other).abs()).to_degrees())
        });
        let bound = match field {
            "vertices" => {
                let of_mixtures = 3.0_f64.sqrt() * self.quality.vertices.max_normal_error_degrees();
                vertices::normals_are_bounded(self.scene)
                    .then_some(of_mixtures + 2.0 * Quality::exact().normals.max_error_degrees())
            }
            _ => Some(self.quality.normals.max_error_degrees() + Quality::exact().normals.max_error_degrees()),
        };
        let error = angles.reduce(worst_of);
        Ok(KnobError { error, metric: "degrees", bound, oracle: "the same target of exact" })
    }

    /// The greatest difference of a pixel's diffuse colour from that of `exact`, in steps of sRGB bytes.
    ///
    /// The bound is half a step from rounding to bytes, a tenth of a step for devices (Direct3D 11.3 functional
    /// specification, 3.2.3.6), and 255 · 0.44 · 2⁻¹⁰ from the half float of `exact`: truncation has a relative error
    /// of 2⁻¹⁰, and the curve magnifies it by 1.055 / 2.4 at most.
    fn diffuse(&self) -> Result<KnobError, Failure> {
        let (own, exact) = (colors(&self.measured.contents.diffuse)?, colors(&self.exact.contents.diffuse)?);
        let steps = own.iter().zip(&exact).flat_map(|(one, other)| {
            [0, 1, 2].map(|channel| (srgb_encoded(one[channel]) - srgb_encoded(other[channel])).abs() * 255.0)
        });
        let error = steps.reduce(worst_of);
        Ok(KnobError { error, metric: "steps of 1/255", bound: Some(0.6 + 0.11), oracle: "the same target of exact" })
    }

    /// The greatest difference of a pixel's radiance from that of `exact`.
    ///
    /// The error of each light is 1.089 times the cut-off at most ([`Quality::light_cut_off`]). A surface reflects its
    /// diffuse share of that, over π. Alpha-blended objects in front reduce it, and each additive or subtractive object
    /// may add as much again. Both sums have an error of their own. No bound is known if such
    /// a light casts shadows: its map ends with its range, so a shadow's edge may move.
    fn light_cut_off(&self) -> Result<KnobError, Failure> {
        let (own, exact) = (colors(&self.measured.contents.radiance)?, colors(&self.exact.contents.radiance)?);
        let differences = own
            .iter()
            .zip(&exact)
            .flat_map(|(one, other)| [0, 1, 2].map(|channel| (one[channel] - other[channel]).abs()));
        let brightest = exact.iter().flatten().copied().fold(0.0, f64::max);
        let scene = self.scene.as_scene_ref();
        let lights = scene.lights.iter().filter(|light| !matches!(light, Light::Directional { .. })).count();
        let materials = || scene.assets.iter::<Material>().map(|(_, material)| material);
        let diffuse = materials().map(|material| f64::from(material.diffuse.max_element())).fold(1.0, f64::max);
        let is_added = |object: usize| {
            let material = scene.assets.get(scene.materials[object]);
            material.is_ok_and(|material| matches!(material.blend, Blend::Additive | Blend::Subtractive))
        };
        let layers = 1 + (0..scene.object_count()).filter(|&object| is_added(object)).count();
        let of_light = 1.089 * f64::from(self.quality.light_cut_off) * diffuse / PI;
        let (sum, all) = (self.quality.radiance_sum, scene.lights.len() as u32);
        let of_sums = 2.0 * (sum.max_light_error(all) + sum.max_blended_error(layers as u32));
        let bound = (of_light * lights as f64 + brightest * of_sums) * layers as f64;
        let has_maps = scene.lights.iter().any(|light| match *light {
            Light::Point { casts_shadow, .. }
            | Light::Spot { casts_shadow, .. }
            | Light::Hemispherical { casts_shadow, .. } => casts_shadow,
            _ => false,
        });
        let error = if lights == 0 { None } else { differences.reduce(worst_of) };
        Ok(KnobError {
            error,
            metric: "radiance",
            bound: (!has_maps).then_some(bound),
            oracle: "the same target of exact",
        })
    }

    /// The greatest difference of a pixel's radiance from that of `exact`, as a fraction of the latter.
    ///
    /// The error of each is a fraction of what the radiance is, so it is also one of what `exact` makes of it. Each
    /// addition to a half float may lose 2⁻²⁴ beside that. Blended objects in front of the surface make its error a
    /// fraction of more than what is seen, so no bound is known with them.
    fn radiance_sum(&self) -> Result<KnobError, Failure> {
        let (own, exact) = (colors(&self.measured.contents.radiance)?, colors(&self.exact.contents.radiance)?);
        let lights = self.scene.lights.len() as u32;
        let smallest = f64::from(lights + 2) * 2_f64.powi(-24);
        let differences = own.iter().zip(&exact).flat_map(|(one, other)| {
            [0, 1, 2].map(|channel| {
                let difference = ((one[channel] - other[channel]).abs() - smallest).max(0.0);
                if difference == 0.0 { 0.0 } else { difference / other[channel].abs() }
            })
        });
        let [of_own, of_exact] =
            [self.quality, &Quality::exact()].map(|quality| quality.radiance_sum.max_light_error(lights));
        let bound = (of_own + of_exact) / (1.0 - of_exact);
        Ok(KnobError {
            error: if lights == 0 { None } else { differences.reduce(worst_of) },
            metric: "of the radiance",
            bound: self.measured.contents.blended.is_empty().then_some(bound),
            oracle: "the same target of exact",
        })
    }

    /// The distance of a drawn edge from its paraboloid projection, in pixels of a map of 1024. The bounds are 512 (1 −
    /// cos(angle / 2)), the sagitta of an edge of that angle in the map of Brabec et al. (2002), rounded up.
    fn shadow_edges(&self) -> KnobError {
        let bound = match self.quality.shadows.widest_edge {
            edge if edge <= 2.0 => 0.08,
            edge if edge <= 5.0 => 0.488,
            edge if edge <= 10.0 => 1.95,
            edge if edge <= 20.0 => 7.78,
            _ => 38.98,
        };
        let error = paraboloid::greatest_error(self.scene, &self.measured.contents.shadow_maps);
        KnobError { error, metric: "pixels of a map of 1024", bound: Some(bound), oracle: "f64 along each edge" }
    }
}

/// The greater of two errors; NaN counts as the greatest.
pub fn worst_of(one: f64, other: f64) -> f64 {
    if one.is_nan() || one > other { one } else { other }
}

fn srgb_encoded(linear: f64) -> f64 {
    if linear <= 0.003_130_8 { linear * 12.92 } else { 1.055 * linear.powf(1.0 / 2.4) - 0.055 }
}
