//! The deferred pipeline (L 4), put together from what a scene requires.

use std::sync::Arc;

use super::{DepthPrePass, GeometryBuffer, GeometryFormats, LightVolumes, Requirements, ShadowCasters, Transparency};
use crate::command::MaterialShare;
use crate::process::{ChainSlot, PlanError, PostStep, RenderProcess, ToneMapping};
use crate::quality::Quality;
use crate::scene::LightKind;
use crate::view::{LightClass, ShadowMaps};

/// The deferred pipeline of L 4: its settings, its post-processing, and what an engine replaces or leaves out. What it
/// adds goes to the renderer's builder beside it.
///
/// It models only what a scene requires. Lights of a class that the scene has none of get no process; without a light
/// that casts shadows there is no shadow map; without a material that mixes with what is behind it there is no
/// transparency. When a scene changes what it requires, the processes follow.
///
/// ```text
///  shadow casters ───────────────────────────┐                  one view for each light that casts shadows
///  depth pre-pass → geometry buffer → lights, a process a class → transparency → post-processing
/// ```
///
/// ```
/// use drawloom::process::{Deferred, Fxaa, ToneMapping};
///
/// let deferred = Deferred::new()
///     .depth_pre_pass(true)
///     .post(ToneMapping::new(0.5))
///     .post(Fxaa::default());
/// assert_eq!(deferred.output(), "picture");
/// ```
#[derive(Clone)]
pub struct Deferred {
    depth_pre_pass: bool,
    geometry_shares: u32,
    formats: GeometryFormats,
    shadow_maps: Option<ShadowMaps>,
    post: Vec<Arc<dyn PostStep>>,
    replaced: Vec<(String, Arc<dyn RenderProcess>)>,
    left_out: Vec<String>,
}

impl Deferred {
    /// Without post-processing: the picture is the target `radiance`, which has no upper end.
    pub fn new() -> Self {
        Self {
            depth_pre_pass: false,
            geometry_shares: 1,
            formats: GeometryFormats::default(),
            shadow_maps: Some(ShadowMaps::default()),
            post: Vec::new(),
            replaced: Vec::new(),
            left_out: Vec::new(),
        }
    }

    /// With tone mapping alone, into the target `picture`.
    pub fn to_picture() -> Self {
        Self::new().post(ToneMapping::default())
    }

    /// Whether depth is drawn before the geometry buffer; it is not unless asked for. See [`DepthPrePass`].
    pub fn depth_pre_pass(self, depth_pre_pass: bool) -> Self {
        Self { depth_pre_pass, ..self }
    }

    /// Into how many processes the geometry buffer is split, by material (L 5): 1 to 64, and what is beyond counts as
    /// the nearest. They are called "geometry buffer 1 of 2" and so on.
    pub fn geometry_shares(self, geometry_shares: u32) -> Self {
        Self { geometry_shares, ..self }
    }

    /// What the geometry buffer's targets are.
    pub fn formats(self, formats: GeometryFormats) -> Self {
        Self { formats, ..self }
    }

    /// How shadow maps are drawn and read; with `None`, no light casts shadows.
    pub fn shadow_maps(self, shadow_maps: Option<ShadowMaps>) -> Self {
        Self { shadow_maps, ..self }
    }

    /// What a [`Quality`] says of the pipeline: the depth pre-pass, normals and diffuse colours in the geometry buffer, the steps of
    /// post-processing that are there and, if it has any, its shadow maps. The format of `radiance` stays as it is, and so does how
    /// far the shadow maps of directional lights reach.
    pub fn quality(mut self, quality: &Quality) -> Self {
        self.depth_pre_pass = quality.depth_pre_pass;
        let (normal, diffuse) = (quality.normals.into(), quality.diffuse.into());
        self.formats = GeometryFormats { normal, diffuse, ..self.formats };
        for step in &mut self.post {
            if let Some(other) = step.with_quality(quality) {
                *step = other;
            }
        }
        if let Some(maps) = &mut self.shadow_maps {
            let shadows = quality.shadows;
            *maps = ShadowMaps { side: shadows.side, bias: shadows.bias, filter: shadows.filter, ..*maps };
        }
        self
    }

    /// Adds a step of post-processing behind those that are there. The first reads `radiance`, the last draws `picture`.
    pub fn post(mut self, step: impl PostStep + 'static) -> Self {
        self.post.push(Arc::new(step));
        self
    }

    /// Puts a process of the engine's own in the place of the one called `name`, whenever that would be there. Of two
    /// for one place the later counts.
    pub fn replace(mut self, name: impl Into<String>, process: impl RenderProcess + 'static) -> Self {
        let name = name.into();
        self.replaced.retain(|(other, _)| *other != name);
        self.replaced.push((name, Arc::new(process)));
        self
    }

    /// Leaves out the process called `name`, such as `"transparency"` or `"point lights"`. Without a step of
    /// post-processing the chain closes around it; without `"shadow casters"` no light casts shadows.
    pub fn leave_out(mut self, name: impl Into<String>) -> Self {
        self.left_out.push(name.into());
        self
    }

    /// The target that the frame is for.
    pub fn output(&self) -> &'static str {
        if self.steps().next().is_none() { RADIANCE } else { PICTURE }
    }

    /// The names of all processes there may be, whatever the scene, in their order.
    pub fn names(&self) -> Vec<String> {
        self.built(&Requirements::all()).iter().map(|process| process.name().to_owned()).collect()
    }

    /// How shadow maps are drawn, if at all.
    pub(crate) fn maps(&self) -> Option<&ShadowMaps> {
        self.shadow_maps.as_ref().filter(|_| !self.left_out.iter().any(|name| name == ShadowCasters::NAME))
    }

    /// The steps of post-processing that are not left out.
    fn steps(&self) -> impl Iterator<Item = &Arc<dyn PostStep>> {
        self.post.iter().filter(|step| !self.left_out.iter().any(|name| name == step.process("", "").name()))
    }

    /// The processes that draw a scene, at the places where they stand.
    pub(crate) fn chain(&self, requirements: &Requirements) -> Vec<ChainSlot> {
        let mut built = self.built(requirements);
        let place = |name: String| {
            let standing =
                built.iter().position(|process| process.name() == name).map(|index| built.swap_remove(index));
            let own = self.replaced.iter().find(|(replaced, _)| *replaced == name).map(|(_, own)| Arc::clone(own));
            let process = standing.map(|standing| own.unwrap_or(standing));
            ChainSlot { process: process.filter(|_| !self.left_out.contains(&name)), name }
        };
        self.names().into_iter().map(place).collect()
    }

    /// # Errors
    /// If a setting cannot be, or a name of what is replaced or left out is nobody's.
    pub(crate) fn check(&self) -> Result<(), PlanError> {
        if let Some((target, format)) = self.formats.first_unsuitable() {
            let process = String::from("geometry buffer");
            return Err(PlanError::WrongFormat { process, target: target.to_owned(), format });
        }
        if let Some(problem) = self.shadow_maps.as_ref().and_then(ShadowMaps::problem) {
            return Err(PlanError::ShadowMaps { problem });
        }
        let whole = Self { left_out: Vec::new(), ..self.clone() };
        let names = whole.names();
        let mut wanted = self.replaced.iter().map(|(name, _)| name).chain(&self.left_out);
        match wanted.find(|name| !names.contains(name)) {
            Some(name) => Err(PlanError::NoSuchProcess { name: name.clone(), known: names.join(", ") }),
            None => Ok(()),
        }
    }

    /// As they come with the crate.
    fn built(&self, requirements: &Requirements) -> Vec<Arc<dyn RenderProcess>> {
        let mut processes: Vec<Arc<dyn RenderProcess>> = Vec::new();
        let maps = self.maps().filter(|_| requirements.shadows());
        if maps.is_some() {
            let hemispheres = requirements.lights(LightClass { kind: LightKind::Hemispherical, shadowed: true });
            processes.push(Arc::new(ShadowCasters { hemispheres }));
        }
        if self.depth_pre_pass {
            processes.push(Arc::new(DepthPrePass));
        }
        let of = self.geometry_shares.clamp(1, 64);
        for index in 0..of {
            let geometry_buffer = GeometryBuffer::of_share(self.formats, MaterialShare { index, of });
            processes.push(if self.depth_pre_pass {
                Arc::new(geometry_buffer.after_depth_pre_pass())
            } else {
                Arc::new(geometry_buffer)
            });
        }
        for class in LightClass::all().filter(|class| requirements.lights(*class)) {
            match maps {
                None if class.shadowed => {}
                Some(maps) if class.shadowed => {
                    processes.push(Arc::new(LightVolumes::shadowed(class.kind, self.formats, maps)));
                }
                _ => processes.push(Arc::new(LightVolumes::new(class.kind, self.formats))),
            }
        }
        if requirements.transparency() {
            processes.push(Arc::new(Transparency::new(maps)));
        }
        let mut source = RADIANCE.to_owned();
        let steps: Vec<_> = self.steps().collect();
        for (index, step) in steps.iter().enumerate() {
            let last = index + 1 == steps.len();
            let target = if last { PICTURE.to_owned() } else { format!("post-processed {}", index + 1) };
            processes.push(step.process(&source, &target));
            source = target;
        }
        processes
    }
}

impl Default for Deferred {
    fn default() -> Self {
        Self::new()
    }
}

const RADIANCE: &str = "radiance";
const PICTURE: &str = "picture";
