//! The WGSL of this folder on the CPU, for the software backend.

use std::sync::Arc;

use drawloom::backend::Picture;
use drawloom::glam::{DMat4, DVec3};
use drawloom::process::{FullScreenCpuShader, FullScreenPixel, PassInputs, SampledTexture, ShaderView};
use drawloom::raster::{Real, Vector, Vector2, Vector4};
use drawloom::scene::{Camera, Projection};
use drawloom::view::RenderView;

use crate::layer_settings::{LayerBlend, LayerReprojection, LayerSettings};
use crate::selection::Selection;

/// What workers computed for a view from an earlier frame, and the view of that frame.
#[derive(Clone)]
pub(crate) struct CpuLayer {
    view: String,
    picture: Arc<Picture>,
    clip_from_relative: DMat4,
    position: DVec3,
    is_paraboloid: bool,
}

/// Where a surface was in a layer's picture.
#[derive(Clone, Copy, Debug, PartialEq)]
enum LayerPosition<R> {
    Within(Vector2<R>),
    Beside(Vector2<R>),
    BehindCamera,
}

impl CpuLayer {
    /// The layers that a frame shows.
    pub(crate) fn all(shown: &Selection) -> Vec<Self> {
        shown.results.iter().map(|(view, result)| Self::new(view, &result.camera, &result.picture)).collect()
    }

    fn new(view: &str, camera: &Camera, picture: &Arc<Picture>) -> Self {
        Self {
            view: view.to_owned(),
            picture: Arc::clone(picture),
            clip_from_relative: RenderView::new(camera).precise_clip_from_relative(),
            position: camera.position,
            is_paraboloid: camera.projection == Projection::Paraboloid,
        }
    }

    /// `layer_position`.
    fn position<R: Real>(&self, view: &ShaderView<R>, clip: Vector2<R>, depth: R) -> LayerPosition<R> {
        if self.is_paraboloid || view.projection == Projection::Paraboloid {
            return LayerPosition::Within(position_of_clip(clip));
        }
        let moved = (view.position - self.position).to_array().map(R::of);
        let (relative, inverse_distance) = match view.projection {
            Projection::Perspective { .. } => {
                let ray = view.right * clip[0] + view.up * clip[1] + view.forward;
                // As far away as a ray of this length, in homogeneous coordinates.
                let [right, up, back, origin] = view.clip_from_relative.map(|column| column[2]);
                let depth_at_infinity = Vector([right, up, back]).dot(ray);
                (ray, (depth - depth_at_infinity).max(R::zero()) / origin)
            }
            _ => (view.position_from_depth(clip, depth), R::one()),
        };
        let relative = relative + Vector(moved) * inverse_distance;
        let columns = self.clip_from_relative.to_cols_array_2d().map(|column| Vector(column.map(R::of)));
        let [x, y, z] = relative.0;
        let products = [columns[0] * x, columns[1] * y, columns[2] * z, columns[3] * inverse_distance];
        let projected = products.into_iter().fold(Vector::zero(), |sum, product| sum + product);
        let w = projected[3];
        let is_in_front = w > R::zero();
        if !is_in_front {
            return LayerPosition::BehindCamera;
        }
        let clip = Vector([projected[0] / w, projected[1] / w]);
        let is_within = clip.0.iter().all(|coordinate| coordinate.abs() <= R::one());
        let position = position_of_clip(clip);
        if is_within { LayerPosition::Within(position) } else { LayerPosition::Beside(position) }
    }
}

/// `layer_position_of_clip`.
fn position_of_clip<R: Real>(clip: Vector2<R>) -> Vector2<R> {
    let half = R::of(0.5);
    Vector([clip[0] * half + half, half - clip[1] * half])
}

fn layer_of<'a, R: Real>(layers: &'a [CpuLayer], pass: &PassInputs<'_, R>) -> Option<&'a CpuLayer> {
    layers.iter().find(|layer| *layer.view == *pass.view.name)
}

impl<R: Real> SampledTexture<R> for CpuLayer {
    fn size(&self) -> [usize; 2] {
        [self.picture.width as usize, self.picture.height as usize]
    }

    fn load(&self, [x, y]: [usize; 2], _layer: usize) -> Vector4<R> {
        Vector(self.picture.texel([x as u32, y as u32]).map(|number| R::of(f64::from(number))))
    }
}

/// `layer.wgsl`.
pub(crate) struct LayerCpuShader {
    pub(crate) layers: Vec<CpuLayer>,
    pub(crate) settings: LayerSettings,
}

impl<R: Real> FullScreenCpuShader<R> for LayerCpuShader {
    fn fragment(&self, pass: &PassInputs<'_, R>, pixel: &FullScreenPixel<R>, targets: &mut [Vector4<R>]) -> bool {
        let color = pass.sampled[0].load(pixel.coordinates, 0);
        targets[0] = color;
        let Some(layer) = layer_of(&self.layers, pass) else { return true };
        let same_place = position_of_clip(pixel.clip);
        let position = if self.settings.reprojection == LayerReprojection::None {
            same_place
        } else {
            let depth = pass.sampled[1].load(pixel.coordinates, 0)[0];
            match (layer.position(pass.view, pixel.clip, depth), self.settings.reprojection) {
                (LayerPosition::Within(position), _) => position,
                (_, LayerReprojection::ByDepthOrNone) => return true,
                (LayerPosition::Beside(position), LayerReprojection::ByDepth) => position,
                _ => same_place,
            }
        };
        let value = SampledTexture::<R>::sample_level(layer, position, 0, R::zero());
        let strength = R::of(f64::from(self.settings.strength));
        let channel = |index: usize| match self.settings.blend {
            LayerBlend::Add => color[index] + strength * value[index],
            LayerBlend::Multiply => color[index] * (R::one() - strength + strength * value[index]),
        };
        targets[0] = Vector([channel(0), channel(1), channel(2), color[3]]);
        true
    }
}

/// `late_picture.wgsl`, or `late_picture_alone.wgsl` for a process that samples nothing.
pub(crate) struct LatePictureCpuShader {
    pub(crate) layers: Vec<CpuLayer>,
}

impl<R: Real> FullScreenCpuShader<R> for LatePictureCpuShader {
    fn fragment(&self, pass: &PassInputs<'_, R>, pixel: &FullScreenPixel<R>, targets: &mut [Vector4<R>]) -> bool {
        let source = pass.sampled.first();
        let size = source.map_or(pass.view.size, |source| source.size());
        targets[0] = match layer_of(&self.layers, pass) {
            None => source.map_or_else(Vector::zero, |source| source.load(pixel.coordinates, 0)),
            Some(layer) if SampledTexture::<R>::size(layer) == size => layer.load(pixel.coordinates, 0),
            Some(layer) => SampledTexture::<R>::sample_level(layer, position_of_clip(pixel.clip), 0, R::zero()),
        };
        true
    }
}

/// `downsample.wgsl`.
pub(crate) struct DownsampleCpuShader {
    pub(crate) divisor: usize,
}

impl<R: Real> FullScreenCpuShader<R> for DownsampleCpuShader {
    fn fragment(&self, pass: &PassInputs<'_, R>, pixel: &FullScreenPixel<R>, targets: &mut [Vector4<R>]) -> bool {
        let source = pass.sampled[0];
        let [width, height] = source.size();
        let [x, y] = pixel.coordinates.map(|coordinate| coordinate * self.divisor);
        let [right, lower] = [(x + self.divisor).min(width), (y + self.divisor).min(height)];
        let covered = (y..lower).flat_map(|y| (x..right).map(move |x| [x, y]));
        let sum = covered.fold(Vector::zero(), |sum, pixel| sum + source.load(pixel, 0));
        targets[0] = sum * (R::one() / R::of_integer(((right - x) * (lower - y)) as i64));
        true
    }
}
