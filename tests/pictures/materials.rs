//! Materials that change, and material types.

use std::error::Error;
use std::sync::{Arc, LazyLock};

use drawloom::backend::{Backend, EncodingStrategy, RecordingStrategy, SoftwareBackend, WgpuBackend};
use drawloom::command::Selection;
use drawloom::glam::{DVec3, Vec3};
use drawloom::process::{
    BlendEquation, CommandDraws, CpuShader, Declare, Deferred, Draws, GeometryBuffer, GeometryFormats, InjectionPoint,
    ObjectCpuShader, ObjectPixel, PassInputs, RawPass, RawPassResources, RenderProcess, ShaderObject, ShaderResource,
    Transparency, VARYINGS, VertexInput, VertexOutput,
};
use drawloom::raster::{Real, Vector, Vector4};
use drawloom::scene::{LayerMask, Material, MaterialType, MaterialValues, RenderObject, Scene, SceneRef, Texture};
use drawloom::task::Scheduler;
use drawloom::{Renderer, RendererBuilder, wgpu};
use drawloom_testing::adapter;
use drawloom_testing::scenes::field;
use libtest_mimic::Failed;
use parking_lot::Mutex;

use crate::Case;
use crate::fixture::Fixture;
use crate::strategies::{counts, drawn_by_a_new_renderer, expect, fixture_of, pictures, small_maps};

pub const CASES: &[Case] = &[
    ("a_material_that_changes_uploads_the_block_that_it_is_in", changing),
    ("material_types_are_drawn_like_layers_with_bytes", types),
    ("draw_lists_follow_materials_that_change_their_type", changing_types),
    ("values_that_change_upload_the_block_that_they_are_in", changing_values),
    ("raw_passes_get_the_material_types_that_they_read", in_raw_pass),
    ("the_software_backend_draws_the_engines_own_materials", on_software),
];

/// A field with many materials, of which its objects use the first few.
fn many_materials() -> Result<Scene, Failed> {
    let mut scene = field(200);
    for _ in 0..1000 {
        scene.add(Material::default())?;
    }
    Ok(scene)
}

fn changing() -> Result<(), Failed> {
    // A device of its own: reading the picture waits for the frame, so every frame reuses the same buffers.
    let (device, queue) = adapter::device()?;
    let backend = WgpuBackend::new(device, queue)?.recording_strategy(RecordingStrategy::CachedBundles);
    let mut fixture = fixture_of(backend.encoding_strategy(EncodingStrategy::PerPass))?;
    let mut scene = many_materials()?;
    let texture = scene.add(Texture::new("red", 1, 1, vec![255, 0, 0, 255])?)?;
    let handles: Vec<_> = scene.assets().iter::<Material>().map(|(handle, _)| handle).collect();
    let mut uploaded = |scene: &Scene| -> Result<_, Failed> {
        let before = fixture.renderer.backend().extras().uploaded_bytes();
        let recorded = fixture.record(scene)?;
        let drawn = pictures(&fixture, recorded, scene)?;
        let (recorded, _) = counts(&fixture, |_| true);
        Ok((drawn, fixture.renderer.backend().extras().uploaded_bytes() - before, recorded))
    };
    uploaded(&scene)?;
    let (mut before, nothing, _) = uploaded(&scene)?;
    let changes: [fn(&mut Material); 3] = [
        |material| material.diffuse = Vec3::new(1.0, 0.2, 0.0),
        |material| material.emission = Vec3::new(0.0, 0.3, 0.0),
        |material| material.opacity = 0.25,
    ];
    for (change, material) in changes.into_iter().zip([handles[0], handles[1], handles[2]]) {
        let mut changed = scene.assets().get(material)?.clone();
        change(&mut changed);
        scene.replace(material, changed)?;
        let (found, bytes, recorded) = uploaded(&scene)?;
        expect(found != before, || "the change is not seen".into())?;
        expect(found == drawn_by_a_new_renderer(&scene)?, || "it differs from a new renderer".into())?;
        expect(bytes <= nothing + 1024, || format!("{bytes} bytes are uploaded, without a change {nothing}"))?;
        expect(recorded == 0, || format!("{recorded} bundles are recorded anew"))?;
        before = found;
    }
    // A texture that is there already is a change of the material alone.
    let textured = Material { texture: Some(texture), ..scene.assets().get(handles[0])?.clone() };
    scene.replace(handles[0], textured)?;
    let (found, bytes, recorded) = uploaded(&scene)?;
    expect(found != before && found == drawn_by_a_new_renderer(&scene)?, || "the texture is not seen".into())?;
    expect(bytes <= nothing + 1024 && recorded == 0, || format!("{bytes} bytes, {recorded} bundles"))?;
    // Other states need other draws.
    let double_sided = Material { double_sided: true, ..scene.assets().get(handles[1])?.clone() };
    scene.replace(handles[1], double_sided)?;
    let (found, ..) = uploaded(&scene)?;
    expect(found == drawn_by_a_new_renderer(&scene)?, || "it differs from a new renderer".into())
}

/// What the shaders read of a material.
#[repr(C)]
#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
struct Flat {
    color: [f32; 3],
    strength: f32,
}

const FLAT: MaterialType<Flat> = MaterialType::new("flat");
/// With larger values.
const STRIPED: MaterialType<[[f32; 4]; 2]> = MaterialType::new("striped");

/// Draws the objects of one type in their material's colour. Without types, those of a layer, with the same bytes as a
/// resource.
#[derive(Clone)]
struct Colored {
    is_striped: bool,
    layer: Option<(LayerMask, Arc<[u8]>)>,
}

impl Colored {
    fn of_types() -> [Self; 2] {
        [false, true].map(|is_striped| Self { is_striped, layer: None })
    }
}

const SHADER: &str = "
    struct Corner {
        @builtin(position) position: vec4<f32>,
        @location(0) @interpolate(flat) material: u32,
    }

    @vertex
    fn vertex(in: VertexInput) -> Corner {
        let object = drawn_object(in.instance);
        return Corner(clip_position(relative_position(object, in.position)), object.material);
    }

    @fragment
    fn fragment(in: Corner) -> @location(0) vec4<f32> {
        return vec4<f32>(color_of(in.material), 1.0);
    }
";

const FLAT_SHADER: &str = "
    struct Flat {
        color: vec3<f32>,
        strength: f32,
    }

    @group(3) @binding(0) var<storage, read> flats: array<Flat>;

    fn color_of(material: u32) -> vec3<f32> {
        return flats[material].color * flats[material].strength;
    }
";

const STRIPED_SHADER: &str = "
    @group(3) @binding(0) var<storage, read> stripes: array<array<vec4<f32>, 2>>;

    fn color_of(material: u32) -> vec3<f32> {
        return stripes[material][0].rgb + stripes[material][1].rgb;
    }
";

static SHADERS: LazyLock<[String; 2]> =
    LazyLock::new(|| [FLAT_SHADER, STRIPED_SHADER].map(|own| [own, SHADER].concat()));

impl RenderProcess for Colored {
    fn name(&self) -> &str {
        if self.is_striped { "striped" } else { "flat" }
    }

    fn declare(&self, declare: &mut Declare) {
        declare.at(InjectionPoint::AfterLighting);
        declare.draws_over("radiance");
        declare.draws_depth("depth");
        match (&self.layer, self.is_striped) {
            (None, false) => declare.reads_materials(FLAT),
            (None, true) => declare.reads_materials(STRIPED),
            (Some(_), _) => {}
        }
        if self.is_striped {
            declare.after("flat");
        }
    }

    fn draws(&self) -> Draws<'_> {
        let (selection, resources) = match (&self.layer, self.is_striped) {
            (None, false) => (Selection::ALL.of_material_type(FLAT), Vec::new()),
            (None, true) => (Selection::ALL.of_material_type(STRIPED), Vec::new()),
            (Some((layer, bytes)), _) => {
                (Selection::ALL.in_layers(*layer), vec![ShaderResource::SharedBytes(Arc::clone(bytes))])
            }
        };
        let shader = &SHADERS[usize::from(self.is_striped)];
        Draws::Commands(CommandDraws {
            shader,
            selection,
            blend_equations: vec![BlendEquation::REPLACE],
            // Otherwise the depth hides what the shipped processes draw in the same place.
            writes_depth: !self.is_striped,
            resources,
            ..CommandDraws::default()
        })
    }

    fn cpu_shader(&self) -> Option<CpuShader> {
        Some(CpuShader::objects(self.clone()))
    }
}

impl<R: Real> ObjectCpuShader<R> for Colored {
    fn vertex(&self, pass: &PassInputs<'_, R>, object: &ShaderObject<R>, vertex: &VertexInput<R>) -> VertexOutput<R> {
        let clip = pass.view.clip_position(object.relative_position(vertex.position));
        VertexOutput { clip, varyings: [R::zero(); VARYINGS] }
    }

    fn fragment(&self, pass: &PassInputs<'_, R>, pixel: &ObjectPixel<R>, targets: &mut [Vector4<R>]) -> bool {
        let [red, green, blue] = if self.is_striped {
            let [one, other] = pass.material_values(STRIPED, pixel.material);
            [0, 1, 2].map(|channel| one[channel] + other[channel])
        } else {
            let Flat { color, strength } = pass.material_values(FLAT, pixel.material);
            color.map(|channel| channel * strength)
        };
        targets[0] = Vector([red, green, blue, 1.0].map(|number| R::of(f64::from(number))));
        true
    }
}

fn flat(material: usize) -> Flat {
    Flat { color: [0.1 * material as f32, 0.5, 0.0], strength: 0.5 }
}

fn striped(material: usize) -> [[f32; 4]; 2] {
    [[0.0, 0.0, 0.1 * material as f32, 9.0], [0.2, 0.0, 0.0, 9.0]]
}

/// A field of which the second material is flat, and the third and fourth are striped: one of them is blended.
fn typed() -> Result<Scene, Failed> {
    let mut scene = field(200);
    set_types(&mut scene, |slot| match slot {
        1 => Some(FLAT.values(flat(1))),
        2 | 3 => Some(STRIPED.values(striped(slot))),
        _ => None,
    })?;
    Ok(scene)
}

fn set_types(scene: &mut Scene, values_of: impl Fn(usize) -> Option<MaterialValues>) -> Result<(), Failed> {
    let materials: Vec<_> = scene.assets().iter::<Material>().map(|(handle, one)| (handle, one.clone())).collect();
    for (handle, material) in materials {
        scene.replace(handle, Material { values: values_of(handle.index() as usize), ..material })?;
    }
    Ok(())
}

fn typed_fixture() -> Result<Fixture, Failed> {
    typed_fixture_of(small_maps())
}

fn typed_fixture_of(deferred: Deferred) -> Result<Fixture, Failed> {
    let [flat, striped] = Colored::of_types();
    Fixture::with(2, |builder| builder.pipeline(deferred).process(flat).process(striped))
}

fn types() -> Result<(), Failed> {
    let found = typed_fixture()?.draw(&typed()?)?;
    // The same by layers. The shipped processes leave out what is in them.
    let scene = field(200);
    let [plain, own, other] = [0, 1, 2].map(LayerMask::layer);
    let layer_of = |slot: u32| match slot {
        1 => own,
        2 | 3 => other,
        _ => plain,
    };
    let layers: Vec<_> = scene.as_scene_ref().materials.iter().map(|material| layer_of(material.index())).collect();
    let flats: Vec<_> = (0..5).map(flat).collect();
    let stripes: Vec<_> = (0..5).map(striped).collect();
    let flats = Colored { is_striped: false, layer: Some((own, bytemuck::cast_slice(&flats).into())) };
    let stripes = Colored { is_striped: true, layer: Some((other, bytemuck::cast_slice(&stripes).into())) };
    let deferred = small_maps()
        .replace("geometry buffer", Excluding(GeometryBuffer::new(GeometryFormats::default()), own | other))
        .replace("transparency", Excluding(Transparency::new(None), own | other));
    let mut fixture = Fixture::with(2, |builder| builder.pipeline(deferred).process(flats).process(stripes))?;
    let recorded = fixture.renderer.record(SceneRef { layers: &layers, ..scene.as_scene_ref() })?;
    let expected = fixture.submit(recorded)?.read(0, "picture")?;
    expect(found == expected, || "they differ".into())?;
    let after_pre_pass = typed_fixture_of(small_maps().depth_pre_pass(true))?.draw(&typed()?)?;
    expect(after_pre_pass == expected, || "after a depth pre-pass they differ".into())?;
    expect(found != Fixture::with(2, |builder| builder.pipeline(small_maps()))?.draw(&scene)?, || {
        "no type is seen".into()
    })
}

/// A shipped process without the objects of some layers.
struct Excluding<P>(P, LayerMask);

impl<P: RenderProcess> RenderProcess for Excluding<P> {
    fn name(&self) -> &str {
        self.0.name()
    }

    fn declare(&self, declare: &mut Declare) {
        self.0.declare(declare);
    }

    fn draws(&self) -> Draws<'_> {
        match self.0.draws() {
            Draws::Commands(draws) => {
                let selection = draws.selection.not_in_layers(self.1);
                Draws::Commands(CommandDraws { selection, ..draws })
            }
            other => other,
        }
    }
}

/// A raw pass that notes the size of the values that it gets.
#[derive(Default)]
struct Noting(Mutex<Option<u64>>);

impl RenderProcess for &'static Noting {
    fn name(&self) -> &str {
        "noting"
    }

    fn declare(&self, declare: &mut Declare) {
        declare.reads_materials(STRIPED);
        declare.keep();
    }

    fn draws(&self) -> Draws<'_> {
        Draws::Raw(*self)
    }
}

impl RawPass for Noting {
    fn encode(
        &self,
        _: &mut wgpu::CommandEncoder,
        resources: &RawPassResources<'_>,
    ) -> Result<(), Box<dyn Error + Send + Sync>> {
        *self.0.lock() = resources.materials(STRIPED)?.size.map(wgpu::BufferSize::get);
        Ok(())
    }
}

fn in_raw_pass() -> Result<(), Failed> {
    let noting: &'static Noting = Box::leak(Box::default());
    let [flat, striped] = Colored::of_types();
    let process = |builder: RendererBuilder<WgpuBackend>| {
        builder.pipeline(small_maps()).process(flat).process(striped).process(noting)
    };
    let scene = typed()?;
    Fixture::with(2, process)?.draw(&scene)?;
    let expected = scene.assets().iter::<Material>().count() * size_of::<[[f32; 4]; 2]>();
    let found = *noting.0.lock();
    expect(found == Some(expected as u64), || format!("{found:?}, and not {expected}"))
}

fn changing_types() -> Result<(), Failed> {
    let (mut scene, mut kept) = (typed()?, typed_fixture()?);
    let objects: Vec<_> = scene.objects().collect();
    for frame in 0..10_usize {
        match frame {
            // All without a type, all of one, and each of another one than before.
            3 => set_types(&mut scene, |_| None)?,
            5 => set_types(&mut scene, |slot| Some(FLAT.values(flat(slot))))?,
            6 => set_types(&mut scene, |slot| (slot % 2 == 0).then(|| STRIPED.values(striped(slot))))?,
            7 => set_types(&mut scene, |slot| (slot % 2 == 1).then(|| STRIPED.values(striped(slot))))?,
            // An object of another material, and one that moves.
            8 => {
                let materials: Vec<_> = scene.assets().iter::<Material>().map(|(handle, _)| handle).collect();
                let first = scene.object(objects[0])?;
                scene.replace_object(objects[0], RenderObject { material: materials[1], ..first })?;
            }
            9 => {
                let first = scene.object(objects[0])?;
                let position = first.position + DVec3::Y;
                scene.replace_object(objects[0], RenderObject { position, ..first })?;
            }
            _ => {}
        }
        expect(kept.draw(&scene)? == typed_fixture()?.draw(&scene)?, || {
            format!("frame {frame} differs from a new renderer")
        })?;
    }
    Ok(())
}

fn changing_values() -> Result<(), Failed> {
    let (device, queue) = adapter::device()?;
    let backend = WgpuBackend::new(device, queue)?.recording_strategy(RecordingStrategy::CachedBundles);
    let backend = backend.encoding_strategy(EncodingStrategy::PerPass);
    let [own, _] = Colored::of_types();
    let builder = Renderer::builder(backend).pipeline(small_maps()).process(own);
    let (renderer, submitter) = builder.build(Arc::new(Scheduler::new(2)?))?;
    let mut fixture = Fixture { renderer, submitter };
    let mut scene = typed()?;
    for slot in 0..1000 {
        scene.add(Material { values: Some(FLAT.values(flat(slot % 5))), ..Material::default() })?;
    }
    let flat_material =
        scene.assets().iter::<Material>().nth(1).map(|(handle, _)| handle).ok_or("there are materials")?;
    let mut uploaded = |scene: &Scene| -> Result<_, Failed> {
        let before = fixture.renderer.backend().extras().uploaded_bytes();
        let picture = fixture.draw(scene)?;
        let (recorded, _) = counts(&fixture, |_| true);
        Ok((picture, fixture.renderer.backend().extras().uploaded_bytes() - before, recorded))
    };
    uploaded(&scene)?;
    let (mut before, nothing, _) = uploaded(&scene)?;
    for step in 0..3 {
        let values = Some(FLAT.values(Flat { color: [0.2, 0.3 * step as f32, 1.0], strength: 1.0 }));
        let changed = Material { values, ..scene.assets().get(flat_material)?.clone() };
        scene.replace(flat_material, changed)?;
        let (found, bytes, recorded) = uploaded(&scene)?;
        expect(found != before, || "the change is not seen".into())?;
        expect(bytes <= nothing + 1024 && recorded == 0, || format!("{bytes} bytes and {recorded} bundles"))?;
        before = found;
    }
    Ok(())
}

fn on_software() -> Result<(), Failed> {
    let by_wgpu = typed_fixture()?.draw(&typed()?)?;
    let scheduler = Arc::new(Scheduler::new(2)?);
    let [flat, striped] = Colored::of_types();
    let builder = Renderer::builder(SoftwareBackend::new(Arc::clone(&scheduler)));
    let (mut renderer, submitter) = builder.pipeline(small_maps()).process(flat).process(striped).build(scheduler)?;
    let recorded = renderer.record(typed()?.as_scene_ref())?;
    let by_software = submitter.submit(recorded)?.submission.read(0, "picture")?;
    let pairs = by_wgpu.bytes.chunks_exact(4).zip(by_software.bytes.chunks_exact(4));
    let differs = |(one, other): &(&[u8], &[u8])| one.iter().zip(*other).any(|(one, other)| one.abs_diff(*other) > 2);
    let differing = pairs.filter(differs).count();
    expect(differing * 200 < by_wgpu.bytes.len() / 4, || format!("{differing} pixels differ"))
}
