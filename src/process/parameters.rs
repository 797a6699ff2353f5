//! Parameters of a shader that change between frames.

use std::borrow::Cow;
use std::sync::Arc;

use bytemuck::NoUninit;
use parking_lot::{Mutex, ReentrantMutex};

/// Parameters of a shader that the engine changes between frames, while the renderer has the process that reads them.
///
/// Clones share their value: the engine keeps one, and the process has another. A frame has the value at the time when
/// it is recorded.
///
/// In WGSL they are the uniform at `@group(2) @binding(0)`, so `T` has the layout that WGSL gives the shader's type:
/// `f32` is `f32`, and `[f32; 4]` is `vec4<f32>`. What follows a `vec3<f32>` in a structure is aligned as its own type
/// says, and elements of arrays are multiples of 16 bytes.
///
/// Lavapipe of Mesa 22.3 compiles a large shader anew for each pass, and keeps all that it compiled, if the shader
/// branches on a member of the structure and reads its first four bytes. A first member that no shader reads prevents
/// that.
///
/// ```
/// use drawloom::process::{Declare, Draws, FullScreen, Parameters, InjectionPoint, RenderProcess, targets};
/// use drawloom::scene::Blend;
///
/// /// Fog over what was drawn, of a density per metre.
/// struct Fog(Parameters<f32>);
///
/// impl RenderProcess for Fog {
///     fn name(&self) -> &str {
///         "fog"
///     }
///
///     fn declare(&self, declare: &mut Declare) {
///         declare.at(InjectionPoint::AfterTransparency);
///         declare.samples(targets::DEPTH);
///         declare.draws_over(targets::RADIANCE);
///     }
///
///     fn draws(&self) -> Draws<'_> {
///         let shader = "
///             @group(2) @binding(0) var<uniform> density: f32;
///             @group(2) @binding(1) var depth_target: texture_depth_2d;
///
///             @fragment
///             fn fragment(in: FullScreenPixel) -> @location(0) vec4<f32> {
///                 // Depth is reversed: 0 is infinitely far away.
///                 let depth = max(textureLoad(depth_target, vec2<i32>(in.position.xy), 0), 1e-6);
///                 let distance = length(position_from_depth(in.clip, depth));
///                 return vec4<f32>(0.5, 0.6, 0.7, 1.0 - exp(-density * distance));
///             }
///         ";
///         let parameters = self.0.bytes();
///         Draws::FullScreen(FullScreen { shader, parameters, blend: Blend::Alpha, ..FullScreen::default() })
///     }
/// }
///
/// let density = Parameters::new(0.01_f32);
/// let fog = Fog(density.clone());
/// // Between frames:
/// density.set(0.05);
/// assert_eq!(fog.0.get(), 0.05);
/// ```
#[derive(Debug, Default)]
pub struct Parameters<T>(Arc<Shared<T>>);

/// What the clones share.
#[derive(Debug, Default)]
struct Shared<T> {
    /// Held by whoever changes the value, so that no change is lost. A frame that reads the value does not wait for it.
    updates: ReentrantMutex<()>,
    value: Mutex<T>,
}

impl<T: NoUninit> Parameters<T> {
    /// New parameters, which share their value with no others.
    pub fn new(value: T) -> Self {
        Self(Arc::new(Shared { updates: ReentrantMutex::new(()), value: Mutex::new(value) }))
    }

    /// Changes them, for frames that are recorded from now on.
    pub fn set(&self, value: T) {
        let _updates = self.0.updates.lock();
        *self.0.value.lock() = value;
    }

    /// Changes them, for frames that are recorded from now on: `change` gets a copy, which takes the place of the value
    /// when it returns. Other threads that change them wait for that; nobody waits to read them. If `change` panics,
    /// they stay.
    pub fn update<R>(&self, change: impl FnOnce(&mut T) -> R) -> R {
        let _updates = self.0.updates.lock();
        let mut value = self.get();
        let result = change(&mut value);
        *self.0.value.lock() = value;
        result
    }

    /// The current value.
    pub fn get(&self) -> T {
        *self.0.value.lock()
    }

    /// The bytes of the current value, such as [`FullScreen::parameters`](super::FullScreen::parameters) has them.
    pub fn bytes(&self) -> Cow<'static, [u8]> {
        bytemuck::bytes_of(&self.get()).to_vec().into()
    }
}

impl<T> Clone for Parameters<T> {
    fn clone(&self) -> Self {
        Self(Arc::clone(&self.0))
    }
}
