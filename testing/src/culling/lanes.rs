//! The planes of [`Naive`] for many spheres at a time: what an engine writes that tests spheres in f32 and wants speed.

use drawloom::glam::{Vec3, Vec4};

use super::naive::Naive;

/// Bounding spheres in world space, an array for each coordinate. The last word is filled up with spheres that nothing
/// sees.
#[derive(Clone, Debug, Default)]
pub struct SphereArrays {
    x: Vec<f32>,
    y: Vec<f32>,
    z: Vec<f32>,
    radii: Vec<f32>,
}

impl SphereArrays {
    pub fn new(spheres: &[(Vec3, f32)]) -> Self {
        let length = spheres.len().next_multiple_of(WORD);
        let mut arrays = Self::default();
        arrays.x.extend(spheres.iter().map(|(center, _)| center.x));
        arrays.y.extend(spheres.iter().map(|(center, _)| center.y));
        arrays.z.extend(spheres.iter().map(|(center, _)| center.z));
        arrays.radii.extend(spheres.iter().map(|(_, radius)| radius));
        for coordinates in [&mut arrays.x, &mut arrays.y, &mut arrays.z] {
            coordinates.resize(length, 0.0);
        }
        arrays.radii.resize(length, f32::NEG_INFINITY);
        arrays
    }

    /// Writes a mask of the visible spheres for each word of 64. It is inlined, so that a caller can compile it for
    /// several instruction sets; `multiply_add(a, b, c)` is a × b + c in the best way of that set.
    #[inline(always)]
    pub fn visible(&self, naive: &Naive, words: &mut [u64], multiply_add: impl Fn(f32, f32, f32) -> f32) {
        let [x, y, z, radii] = [&self.x, &self.y, &self.z, &self.radii].map(|axis| axis.as_chunks::<WORD>().0);
        for ((((word, x), y), z), radii) in words.iter_mut().zip(x).zip(y).zip(z).zip(radii) {
            let distance = |plane: &Vec4, index: usize| {
                let along_z = multiply_add(plane.z, z[index], plane.w);
                multiply_add(plane.x, x[index], multiply_add(plane.y, y[index], along_z))
            };
            // This loop compiles to vector instructions.
            let mut sees = [0_u8; WORD];
            for index in 0..WORD {
                let mut nearest = f32::INFINITY;
                for plane in &naive.planes {
                    let distance = distance(plane, index);
                    nearest = if distance < nearest { distance } else { nearest };
                }
                sees[index] = u8::from(nearest >= -radii[index]);
            }
            let bytes = sees.as_chunks().0.iter().enumerate();
            *word = bytes.fold(0, |mask, (index, &bytes)| mask | lowest_bits(bytes) << (index * 8));
        }
    }
}

const WORD: usize = u64::BITS as usize;

/// A mask of eight bytes that are 0 or 1.
#[inline(always)]
fn lowest_bits(bytes: [u8; 8]) -> u64 {
    // The product has byte i at bit 56 + i, and no sum carries.
    u64::from_le_bytes(bytes).wrapping_mul(0x0102_0408_1020_4080) >> 56
}
