//! The deferred pipeline (L 4), assembled from what a scene requires.

use std::sync::Arc;

use super::deformation::{Deformation, split_by_deformation, undeformed, undeformed_name};
use super::{
    DepthPrePass, FloatSum, GeometryBuffer, GeometryFormats, LightClasses, LightSum, LightTiles, LightVolumes,
    ShadowCasters, Transparency,
};
use crate::process::{
    Contained, DeviceSupport, Format, InjectionPoint, Pipeline, PipelineProcesses, PlanError, PostStep, RenderProcess,
    Requirements, SceneContents, ToneMapping, targets,
};
use crate::quality::{Quality, RadianceSum};
use crate::scene::{ShadowProjection, ViewKind};
use crate::view::{LightClass, ShadowMaps};

/// The deferred pipeline of L 4: its settings, its post-processing, and the processes that an engine replaces or leaves
/// out. An engine adds further processes to the renderer's builder.
///
/// It has only the processes that a scene requires. A class of lights without lights has no process; without a light
/// that casts shadows there is no shadow map; without an object with a blended material there is no transparency,
/// whatever materials the assets have. When a scene's requirements change, so do the processes, in the same frame.
///
/// ```text
///  shadow casters ───────────────────────────┐                  one view for each light that casts shadows
///  depth pre-pass → geometry buffer → lights, a process per class → transparency → post-processing
/// ```
///
/// [`Quality::radiance_sum`] sets how lights and blended objects add up in `radiance`. With [`RadianceSum::HalfFloat`],
/// each process adds to it. The others have further processes, whose names are known to [`Self::keep`],
/// [`Self::leave_out`] and [`Self::replace`] with every quality and on every device:
///
/// - "sum of lights" follows the processes of lights with [`RadianceSum::Float`]. With [`RadianceSum::Shader`], and on
///   devices that do not blend floats, it takes their place, and "tiles of lights" precedes it: that marks the lights
///   that reach each tile.
/// - "sum of blended objects" follows transparency, on devices that blend floats.
///
/// The shipped "sum of lights" reads the tiles, so renderers refuse a pipeline that leaves out the tiles alone: with
/// [`RadianceSum::Float`] on every device.
///
/// A process of lights or of transparency that the engine [replaces](Self::replace) draws over `radiance` as ever.
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
    vertex_colors: bool,
    shadow_maps: Option<ShadowMaps>,
    radiance_sum: RadianceSum,
    blends_floats: bool,
    post: Vec<Contained<Arc<dyn PostStep>>>,
    replaced: Vec<(String, Arc<dyn RenderProcess>)>,
    left_out: Vec<String>,
    kept: Vec<String>,
    deformations: Vec<Arc<dyn Deformation>>,
}

impl Deferred {
    /// Without post-processing: the output is the target `radiance`, which is not limited to 1.
    pub fn new() -> Self {
        Self {
            depth_pre_pass: false,
            geometry_shares: 1,
            formats: GeometryFormats::default(),
            vertex_colors: false,
            shadow_maps: Some(ShadowMaps::default()),
            radiance_sum: RadianceSum::default(),
            blends_floats: true,
            post: Vec::new(),
            replaced: Vec::new(),
            left_out: Vec::new(),
            kept: Vec::new(),
            deformations: Vec::new(),
        }
    }

    /// With tone mapping only, into the target `picture`.
    pub fn to_picture() -> Self {
        Self::new().post(ToneMapping::default())
    }

    /// Sets whether depth is drawn before the geometry buffer; the default is no. See [`DepthPrePass`].
    pub fn depth_pre_pass(self, depth_pre_pass: bool) -> Self {
        Self { depth_pre_pass, ..self }
    }

    /// Sets into how many processes the geometry buffer is split, by material (L 5), clamped to 1 to 64. Their names
    /// are "geometry buffer 1 of 2" and so on.
    pub fn geometry_shares(self, geometry_shares: u32) -> Self {
        Self { geometry_shares, ..self }
    }

    /// Sets the formats of the geometry buffer's targets.
    pub fn formats(self, formats: GeometryFormats) -> Self {
        Self { formats, ..self }
    }

    /// Sets whether the colours of vertices, [`VERTEX_COLOR`](crate::scene::VERTEX_COLOR), are drawn; the default is
    /// no. Diffuse colours are multiplied by them. Meshes without colours look as without this setting, and cost as
    /// much as those with colours.
    pub fn vertex_colors(self, vertex_colors: bool) -> Self {
        Self { vertex_colors, ..self }
    }

    /// Sets how shadow maps are drawn and read; with `None`, no light casts shadows.
    pub fn shadow_maps(self, shadow_maps: Option<ShadowMaps>) -> Self {
        Self { shadow_maps, ..self }
    }

    /// Applies a [`Quality`]: to the depth pre-pass, to normals and diffuse colours in the geometry buffer, to the sum
    /// of lights, to the post-processing steps added so far and to the shadow maps if there are any. It changes neither
    /// the format of `radiance` nor how far the shadow maps of directional lights reach. A panic of a step unwinds to
    /// the caller; [`RendererBuilder::quality`](crate::RendererBuilder::quality) makes it an error.
    pub fn quality(mut self, quality: &Quality) -> Self {
        self.depth_pre_pass = quality.depth_pre_pass;
        let (normal, diffuse) = (quality.normals.into(), quality.diffuse.into());
        self.formats = GeometryFormats { normal, diffuse, ..self.formats };
        self.radiance_sum = quality.radiance_sum;
        for step in &mut self.post {
            if let Some(other) = step.with_quality(quality) {
                *step = Contained::new(other);
            }
        }
        if let Some(maps) = &mut self.shadow_maps {
            let shadows = quality.shadows;
            *maps = ShadowMaps { side: shadows.side, bias: shadows.bias, filter: shadows.filter, ..*maps };
        }
        self
    }

    /// Appends a step of post-processing. The first step reads `radiance`, the last draws `picture`.
    pub fn post(mut self, step: impl PostStep + 'static) -> Self {
        self.post.push(Contained::new(Arc::new(step)));
        self
    }

    /// Replaces the process called `name`, in the frames that have it, with a process of the engine. A later
    /// replacement of the same process overrides an earlier one. It draws masked objects too, with holes if it has
    /// [entry points](crate::process::CommandDraws::masked) for them.
    pub fn replace(mut self, name: impl Into<String>, process: impl RenderProcess + 'static) -> Self {
        let name = name.into();
        self.replaced.retain(|(other, _)| *other != name);
        self.replaced.push((name, Arc::new(Contained::new(process))));
        self
    }

    /// Leaves out the process called `name`, such as `"transparency"` or `"point lights"`. If it is a step of
    /// post-processing, the next step reads what it would have read; without `"shadow casters"`, no light casts
    /// shadows.
    pub fn leave_out(mut self, name: impl Into<String>) -> Self {
        self.left_out.push(name.into());
        self
    }

    /// Keeps the process called `name` in every frame, whether the scene requires it or not. The picture is the same to
    /// the byte, and frames whose scene does not require the process pay for its passes: an engine does so to keep a
    /// change of the scene from changing the plan and making pipelines. A process that is left out stays out.
    pub fn keep(mut self, name: impl Into<String>) -> Self {
        self.kept.push(name.into());
        self
    }

    /// Adds vertex code of the engine's own for the objects of some layers.
    pub fn deformation(mut self, deformation: impl Deformation + 'static) -> Self {
        self.deformations.push(Arc::new(Contained::new(deformation)));
        self
    }

    /// The target that the frame outputs. Calls [`PostStep::process`] if processes are left out: a panic of a step
    /// unwinds to the caller.
    pub fn output(&self) -> &'static str {
        if self.steps().next().is_none() { targets::RADIANCE.name() } else { targets::PICTURE.name() }
    }

    /// The pipeline for this device.
    fn on(&self, device: DeviceSupport) -> Self {
        Self { blends_floats: device.float_blending, ..self.clone() }
    }

    /// The names of all processes that a frame may have, whatever the scene, in order. Asks steps and deformations,
    /// whose panics unwind to the caller.
    pub fn names(&self) -> Vec<String> {
        self.assemble(&Requirements::all()).iter().flatten().map(|process| process.name().to_owned()).collect()
    }

    /// How shadow maps are drawn, if they are drawn.
    fn maps(&self) -> Option<&ShadowMaps> {
        self.shadow_maps.as_ref().filter(|_| !self.left_out.iter().any(|name| name == ShadowCasters::NAME))
    }

    /// The steps of post-processing that are not left out.
    fn steps(&self) -> impl Iterator<Item = &Contained<Arc<dyn PostStep>>> {
        self.post.iter().filter(|step| {
            self.left_out.is_empty() || {
                let process = Contained::new(step.process("", ""));
                !self.left_out.iter().any(|name| name == process.name())
            }
        })
    }

    /// What frames have processes for whatever their scene.
    fn kept_requirements(&self) -> Requirements {
        let light_term = self.light_term();
        let is_kept = |name: &str| {
            self.kept.iter().any(|kept| {
                let deformed =
                    || self.deformations.iter().filter_map(|deformation| undeformed_name(&**deformation, kept));
                // A sum stays with a process whose terms it adds.
                let has_sum = match kept.as_str() {
                    LightSum::NAME => light_term.as_deref() == Some(name),
                    LightTiles::NAME => self.light_sum() == RadianceSum::Shader && light_term.as_deref() == Some(name),
                    FloatSum::BLENDED_OBJECTS_NAME => self.sums_blended_objects() && name == Transparency::NAME,
                    _ => false,
                };
                kept == name || deformed().any(|undeformed| undeformed == name) || has_sum
            })
        };
        let lights = LightClass::all().filter(|class| is_kept(&LightVolumes::name_of(*class)));
        let kept = lights.fold(Requirements::default(), Requirements::with_lights);
        let kept = if is_kept(Transparency::NAME) { kept.with_transparency() } else { kept };
        if is_kept(ShadowCasters::NAME) { kept.with_shadow_maps() } else { kept }
    }

    /// The name of a process whose lights are summed, if possible of one without shadow maps; `None` if no lights are.
    fn light_term(&self) -> Option<String> {
        let summed = self.summed_classes();
        let is_term = |class: &LightClass| summed.contains(*class) && (!class.shadowed || self.maps().is_some());
        let term = LightClass::all().filter(is_term).min_by_key(|class| class.shadowed);
        term.filter(|_| self.light_sum() != RadianceSum::HalfFloat).map(LightVolumes::name_of)
    }

    /// The process in the slot of this name, for the one that comes with the crate, if the frame has that.
    fn process_in_slot(&self, name: &str, shipped: Option<Arc<dyn RenderProcess>>) -> Option<Arc<dyn RenderProcess>> {
        let shipped = shipped?;
        if self.left_out.iter().any(|left_out| left_out == name) || self.is_summed_in_shader(name) {
            return None;
        }
        let Some((_, replacement)) = self.replaced.iter().find(|(replaced, _)| replaced == name) else {
            return Some(shipped);
        };
        // A replacement of a process that draws deformed objects draws these.
        let is_deformed = self.deformations.iter().any(|deformation| undeformed_name(&**deformation, name).is_some());
        let excluded = if is_deformed { &[][..] } else { &self.deformations };
        Some(undeformed(Arc::clone(replacement), excluded))
    }

    /// The shipped processes that a scene requires, in order: those before each of [`InjectionPoint::ALL`].
    fn assemble(&self, requirements: &Requirements) -> [Vec<Arc<dyn RenderProcess>>; InjectionPoint::ALL.len()] {
        [
            self.shadows(requirements),
            self.geometry(),
            self.lighting(requirements),
            self.transparency(requirements),
            self.post_processing(),
        ]
    }

    /// How shadow maps are drawn, if a scene requires them.
    fn required_maps(&self, requirements: &Requirements) -> Option<&ShadowMaps> {
        self.maps().filter(|_| requirements.shadow_maps())
    }

    fn shadows(&self, requirements: &Requirements) -> Vec<Arc<dyn RenderProcess>> {
        let hemispheres = LightClass::all().any(|class| has_paraboloid_map(&class) && requirements.lights(class));
        let casters = || Arc::new(ShadowCasters { hemispheres }) as Arc<dyn RenderProcess>;
        self.with_deformed(self.required_maps(requirements).map(|_| casters()).into_iter().collect())
    }

    fn geometry(&self) -> Vec<Arc<dyn RenderProcess>> {
        let (mut pre_pass, mut processes): (Vec<Arc<dyn RenderProcess>>, Vec<_>) = (Vec::new(), Vec::new());
        if self.depth_pre_pass {
            pre_pass.push(Arc::new(DepthPrePass::new(self.formats.depth)));
        }
        let of = self.geometry_shares.clamp(1, 64);
        for index in 0..of {
            let mut geometry_buffer = GeometryBuffer::of_share(self.formats, index, of);
            if self.depth_pre_pass {
                geometry_buffer = geometry_buffer.after_depth_pre_pass();
            }
            if self.vertex_colors {
                geometry_buffer = geometry_buffer.with_vertex_colors();
            }
            processes.push(Arc::new(geometry_buffer) as _);
        }
        [self.with_deformed(pre_pass), self.with_deformed(processes)].concat()
    }

    fn lighting(&self, requirements: &Requirements) -> Vec<Arc<dyn RenderProcess>> {
        let mut processes: Vec<Arc<dyn RenderProcess>> = Vec::new();
        let maps = self.required_maps(requirements);
        let (sum, summed) = (self.light_sum(), self.summed_classes());
        let mut has_terms = false;
        for class in LightClass::all().filter(|class| requirements.lights(*class)) {
            let volumes = match maps {
                None if class.shadowed => continue,
                Some(maps) if class.shadowed => LightVolumes::shadowed(class.kind, self.formats, maps),
                _ => LightVolumes::new(class.kind, self.formats),
            };
            let is_summed = summed.contains(class);
            let in_floats = is_summed && sum == RadianceSum::Float;
            processes.push(Arc::new(if in_floats { volumes.into_sum(!has_terms) } else { volumes }));
            has_terms |= is_summed;
        }
        match sum {
            RadianceSum::Float if has_terms => processes.push(Arc::new(FloatSum::LIGHTS)),
            RadianceSum::Shader if has_terms => {
                processes.push(Arc::new(LightTiles));
                processes.push(Arc::new(LightSum::new(summed, self.formats, maps)));
            }
            _ => {}
        }
        processes
    }

    /// How lights are summed on this backend.
    fn light_sum(&self) -> RadianceSum {
        match self.radiance_sum {
            RadianceSum::Float if !self.blends_floats => RadianceSum::Shader,
            sum => sum,
        }
    }

    /// The lights that are summed, unless they are added one by one: those whose process is neither replaced nor left
    /// out.
    fn summed_classes(&self) -> LightClasses {
        let is_shipped = |class: &LightClass| {
            let name = LightVolumes::name_of(*class);
            !self.left_out.contains(&name) && !self.is_replaced(&name)
        };
        LightClass::all().filter(is_shipped).collect()
    }

    /// Whether a shader that sums lights takes the place of the process of this name.
    fn is_summed_in_shader(&self, name: &str) -> bool {
        self.light_sum() == RadianceSum::Shader
            && !self.is_replaced(name)
            && LightClass::all().any(|class| LightVolumes::name_of(class) == name)
    }

    fn is_replaced(&self, name: &str) -> bool {
        self.replaced.iter().any(|(replaced, _)| replaced == name)
    }

    /// Whether blended objects are summed in floats.
    fn sums_blended_objects(&self) -> bool {
        self.blends_floats && self.would_sum_blended_objects()
    }

    /// Whether a backend that blends floats sums blended objects in floats: all of them or none, because those that are
    /// drawn later cover the others.
    fn would_sum_blended_objects(&self) -> bool {
        let draws_blended = |name: &str| {
            let mut deformed = self.deformations.iter().map(|deformation| undeformed_name(&**deformation, name));
            name == Transparency::NAME || deformed.any(|undeformed| undeformed == Some(Transparency::NAME))
        };
        self.radiance_sum != RadianceSum::HalfFloat
            && !self.left_out.iter().any(|name| name == Transparency::NAME)
            && !self.replaced.iter().any(|(name, _)| draws_blended(name))
    }

    fn transparency(&self, requirements: &Requirements) -> Vec<Arc<dyn RenderProcess>> {
        let transparency = || {
            let transparency = Transparency::new(self.required_maps(requirements));
            let transparency = if self.vertex_colors { transparency.with_vertex_colors() } else { transparency };
            let sums = self.sums_blended_objects();
            Arc::new(if sums { transparency.into_sum() } else { transparency }) as Arc<dyn RenderProcess>
        };
        let sum = requirements.transparency() && self.sums_blended_objects();
        let sum = sum.then(|| Arc::new(FloatSum::BLENDED_OBJECTS) as Arc<dyn RenderProcess>);
        let processes = requirements.transparency().then(transparency).into_iter().collect();
        self.with_deformed(processes).into_iter().chain(sum).collect()
    }

    /// These processes, which draw objects, and those that draw deformed objects, except in place of processes that are
    /// left out.
    fn with_deformed(&self, processes: Vec<Arc<dyn RenderProcess>>) -> Vec<Arc<dyn RenderProcess>> {
        let is_left_out = |process: &Arc<dyn RenderProcess>| self.left_out.iter().any(|name| name == process.name());
        let (left_out, drawn): (Vec<_>, Vec<_>) = processes.into_iter().partition(is_left_out);
        [left_out, split_by_deformation(drawn, &self.deformations)].concat()
    }

    fn post_processing(&self) -> Vec<Arc<dyn RenderProcess>> {
        let mut processes: Vec<Arc<dyn RenderProcess>> = Vec::new();
        let mut source = targets::RADIANCE.to_string();
        let steps: Vec<_> = self.steps().collect();
        for (index, step) in steps.iter().enumerate() {
            let last = index + 1 == steps.len();
            let target = if last { targets::PICTURE.to_string() } else { format!("post-processed {}", index + 1) };
            processes.push(Arc::new(Contained::new(step.process(&source, &target))));
            source = target;
        }
        processes
    }
}

impl Pipeline for Deferred {
    fn requirements(&self, scene: &SceneContents<'_>) -> Requirements {
        Requirements::of(scene, self.maps().is_some())
    }

    /// Each process has its slot in every frame. Empty slots mark the places for an engine's processes.
    fn build(
        &self,
        requirements: &Requirements,
        device: DeviceSupport,
        processes: &mut PipelineProcesses,
    ) -> Result<(), PlanError> {
        let pipeline = self.on(device);
        let mut built: Vec<_> = pipeline.assemble(requirements).into_iter().flatten().collect();
        for (possible, point) in pipeline.assemble(&Requirements::all()).into_iter().zip(InjectionPoint::ALL) {
            for name in possible.iter().map(|process| process.name()) {
                let shipped = built.iter().position(|process| process.name() == name);
                let is_replaced = pipeline.replaced.iter().any(|(replaced, _)| replaced == name);
                match pipeline.process_in_slot(name, shipped.map(|index| built.swap_remove(index))) {
                    Some(process) if is_replaced => processes.process_in(name, process),
                    Some(process) => processes.process(process),
                    None => processes.absent(name),
                }
            }
            processes.injection_point(point);
        }
        self.kept.iter().for_each(|name| processes.keep(name));
        if self.maps().is_some() {
            processes.absent_layers(ViewKind::Shadow, targets::SHADOW_MAP.name(), Format::Depth32Float);
        }
        processes.output(self.output());
        Ok(())
    }

    fn check(&self) -> Result<(), PlanError> {
        if let Some((target, format)) = self.formats.first_unsuitable() {
            let process = String::from("geometry buffer");
            return Err(PlanError::WrongFormat { process, target: target.to_string(), format });
        }
        let complete = Self { left_out: Vec::new(), ..self.clone() };
        // Which processes sum depends on the quality and the device, and these may change.
        let with_sum = |radiance_sum| Self { radiance_sum, blends_floats: true, ..complete.clone() }.names();
        let mut known = complete.names();
        for name in [RadianceSum::Float, RadianceSum::Shader].into_iter().flat_map(with_sum) {
            if !known.contains(&name) {
                known.push(name);
            }
        }
        let mut named = self.replaced.iter().map(|(name, _)| name).chain(self.left_out.iter().chain(&self.kept));
        match named.find(|name| !known.contains(name)) {
            Some(name) => Err(PlanError::NoSuchProcess { name: name.clone(), known: known.join(", ") }),
            None => Ok(()),
        }
    }

    fn kept(&self, device: DeviceSupport) -> Requirements {
        self.on(device).kept_requirements()
    }

    fn shadow_maps(&self) -> Option<ShadowMaps> {
        self.maps().copied()
    }

    fn with_quality(&self, quality: &Quality) -> Option<Arc<dyn Pipeline>> {
        Some(Arc::new(self.clone().quality(quality)))
    }

    /// Transparency reads shadow maps or does not, and shadow casters are drawn in paraboloid maps too or are not.
    fn to_prepare(&self) -> Vec<Requirements> {
        let without = |is_absent: fn(&LightClass) -> bool| {
            LightClass::all().filter(is_absent).fold(Requirements::all(), Requirements::without_lights)
        };
        vec![Requirements::all(), without(has_paraboloid_map), without(|class| class.shadowed)]
    }

    fn lacks_float_blending(&self, device: DeviceSupport) -> bool {
        !device.float_blending && self.would_sum_blended_objects()
    }
}

/// Whether the lights of a class have paraboloid maps.
fn has_paraboloid_map(class: &LightClass) -> bool {
    class.shadowed && class.kind.shadow_projection() == ShadowProjection::Paraboloid
}

impl Default for Deferred {
    fn default() -> Self {
        Self::new()
    }
}
