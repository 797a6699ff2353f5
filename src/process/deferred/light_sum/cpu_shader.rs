//! `light_sum.wgsl` on the CPU.

use std::f64::consts::PI;

use crate::process::cpu_shader::built_in::{rgb, with_alpha};
use crate::process::deferred::LightClasses;
use crate::process::deferred::light_tiles::cpu_shader::{BITS, LightTile};
use crate::process::deferred::shading::cpu_shader::illumination::{MAX_STORED_RADIANCE, illuminance_from};
use crate::process::deferred::shading::cpu_shader::light_batches::LightBatches;
use crate::process::deferred::shading::cpu_shader::shadow::ShadowFilter;
use crate::process::{FullScreenCpuShader, FullScreenPixel, GeometryFormats, PassInputs};
use crate::raster::{Real, Vector3, Vector4};
use crate::view::{LightClass, ShadowMaps};

/// Adds the light that a surface of the geometry buffer reflects of all lights of some classes.
#[derive(Clone, Copy, Debug)]
pub(super) struct LightSumCpuShader {
    classes: LightClasses,
    /// The formats of the geometry buffer.
    formats: GeometryFormats,
    /// `None` if no light has a shadow map.
    shadows: Option<ShadowFilter>,
}

impl LightSumCpuShader {
    pub(super) fn new(classes: LightClasses, formats: GeometryFormats, maps: Option<&ShadowMaps>) -> Self {
        Self { classes, formats, shadows: maps.map(ShadowFilter::new) }
    }

    /// Whether a light is of a class that is summed.
    fn is_summed<R: Real>(&self, pass: &PassInputs<'_, R>, index: usize) -> bool {
        let class = LightClass::all().zip(pass.light_ends).find(|&(_, &end)| index < end);
        class.is_some_and(|(class, _)| self.classes.contains(class))
    }
}

impl<R: Real> FullScreenCpuShader<R> for LightSumCpuShader {
    fn fragment(&self, pass: &PassInputs<'_, R>, pixel: &FullScreenPixel<R>, targets: &mut [Vector4<R>]) -> bool {
        let stored = |target: usize| pass.sampled[target].load(pixel.coordinates, 0);
        let depth = stored(DEPTH)[0];
        if depth == R::zero() {
            return false;
        }
        let position = pass.view.position_from_depth(pixel.clip, depth);
        let normal = self.formats.decode_normal(stored(NORMAL));

        let mut batches = LightBatches::default();
        let tiles = pass.sampled[TILES];
        let tile = LightTile::of(pixel.coordinates.map(|coordinate| coordinate / 2), tiles.size(), pass.lights.len());
        for (word, lights) in pass.lights.chunks(BITS * tile.lights_per_bit).enumerate() {
            let coordinates = [tile.first[0] + word % tile.size[0], tile.first[1] + word / tile.size[0]];
            let marks = tiles.load(coordinates, 0)[0].as_f64() as u32;
            for (bit, marked) in lights.chunks(tile.lights_per_bit).enumerate() {
                if marks >> bit & 1 == 0 {
                    continue;
                }
                let first = (word * BITS + bit) * tile.lights_per_bit;
                for (light, index) in marked.iter().zip(first..) {
                    let unobstructed = illuminance_from(light, position, normal);
                    if unobstructed.0.iter().all(|&value| value <= R::zero()) || !self.is_summed(pass, index) {
                        continue;
                    }
                    let visibility = self.shadows.map_or(R::one(), |shadows| {
                        let (maps, by_layer) = (pass.sampled[SHADOW_MAPS], pass.lights_by_layer);
                        shadows.light_visibility(pass.view, maps, light, by_layer, position, normal)
                    });
                    batches.add(unobstructed * visibility);
                }
            }
        }
        let illuminance = batches.sum();
        if illuminance == Vector3::zero() {
            return false;
        }
        let reflected = rgb(stored(DIFFUSE)).map(|value| value / R::of(PI)) * illuminance;
        // Above 65,504 a half float would become infinite, and later NaN.
        targets[0] = with_alpha(reflected.map(|value| value.min(R::of(MAX_STORED_RADIANCE))), R::zero());
        true
    }
}

// Indices of the sampled targets, in the order declared.
const DEPTH: usize = 0;
const NORMAL: usize = 1;
const DIFFUSE: usize = 2;
const TILES: usize = 3;
const SHADOW_MAPS: usize = 4;
