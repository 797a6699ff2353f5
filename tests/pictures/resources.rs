//! Resources of the engine's own in shaders of its processes.

use std::sync::{Arc, Mutex};

use drawloom::backend::{BackendError, Picture, WgpuBackend};
use drawloom::process::{ClearColor, Declare, Draws, Format, FullScreen, RenderProcess, ShaderResource};
use drawloom::scene::Scene;
use drawloom::{RendererBuilder, wgpu};
use drawloom_testing::adapter;
use drawloom_testing::scenes::field;
use libtest_mimic::Failed;

use crate::Case;
use crate::fixture::{Fixture, backend, device, pixel};
use crate::image_distance::assert_color;

pub const CASES: &[Case] = &[
    ("a_shader_reads_bytes_that_change_from_frame_to_frame", bytes),
    ("a_frame_in_flight_keeps_its_bytes", bytes_in_flight),
    ("a_shader_reads_a_buffer_a_texture_and_a_sampler", handles),
    ("a_process_may_change_the_kinds_of_its_resources", other_kinds),
    ("a_shader_reads_a_multisampled_texture", multisampled),
    ("a_submission_that_is_refused_reads_nothing_back", refused_submission),
    ("targets_are_sampled_between_pixels", filtered_target),
    ("resources_that_the_device_refuses_are_named_and_the_next_frame_is_right", refused),
];

/// Draws every pixel with a shader and resources that a test sets, into the target `own`.
#[derive(Default)]
struct OwnResources {
    shader: Mutex<&'static str>,
    resources: Mutex<Vec<ShaderResource<'static>>>,
}

impl OwnResources {
    fn set(&self, shader: &'static str, resources: Vec<ShaderResource<'static>>) {
        *self.shader.lock().unwrap() = shader;
        *self.resources.lock().unwrap() = resources;
    }
}

impl RenderProcess for OwnResources {
    fn name(&self) -> &str {
        "own resources"
    }

    fn declare(&self, declare: &mut Declare) {
        declare.clears_color("own", Format::Rgba8Unorm, ClearColor::Value([0.0; 4]));
    }

    fn draws(&self) -> Draws<'_> {
        let (shader, resources) = (*self.shader.lock().unwrap(), self.resources.lock().unwrap().clone());
        Draws::FullScreen(FullScreen { shader, resources, ..FullScreen::default() })
    }
}

struct Own {
    process: Arc<OwnResources>,
    fixture: Fixture,
    scene: Scene,
}

impl Own {
    fn new() -> Result<Self, Failed> {
        Self::on(backend()?)
    }

    fn on(backend: WgpuBackend) -> Result<Self, Failed> {
        let process = Arc::new(OwnResources::default());
        let build = |builder: RendererBuilder<WgpuBackend>| builder.process(Arc::clone(&process)).output("own");
        let fixture = Fixture::on_backend(backend, 2, build)?;
        let mut scene = field(4);
        scene.cameras.truncate(1);
        scene.cameras[0].size = [16, 16];
        Ok(Self { process, fixture, scene })
    }

    fn draw(&mut self, shader: &'static str, resources: Vec<ShaderResource<'static>>) -> Result<Picture, Failed> {
        self.process.set(shader, resources);
        let recorded = self.fixture.record(&self.scene)?;
        Ok(self.fixture.submit(recorded)?.read(0, "own")?)
    }
}

fn floats(values: &[f32]) -> ShaderResource<'static> {
    ShaderResource::Bytes(values.iter().flat_map(|value| value.to_le_bytes()).collect::<Vec<u8>>().into())
}

const FROM_BYTES: &str = "
    @group(3) @binding(0) var<storage, read> first: array<f32>;
    @group(3) @binding(1) var<storage, read> second: array<f32>;

    @fragment
    fn fragment(in: FullScreenPixel) -> @location(0) vec4<f32> {
        return vec4<f32>(first[0], second[arrayLength(&second) - 1u], f32(arrayLength(&first)) / 255.0, 1.0);
    }
";

fn bytes() -> Result<(), Failed> {
    let mut own = Own::new()?;
    let picture = own.draw(FROM_BYTES, vec![floats(&[1.0]), floats(&[0.0, 0.0, 0.5])])?;
    assert_color(pixel(&picture, 3, 3), [255, 128, 1])?;
    let picture = own.draw(FROM_BYTES, vec![floats(&[0.0; 100]), floats(&[0.0, 1.0])])?;
    assert_color(pixel(&picture, 3, 3), [0, 255, 100])?;
    let picture = own.draw(FROM_BYTES, vec![floats(&[0.5, 0.0]), floats(&[1.0])])?;
    assert_color(pixel(&picture, 3, 3), [128, 255, 2])
}

fn bytes_in_flight() -> Result<(), Failed> {
    let mut own = Own::new()?;
    let mut in_flight = Vec::new();
    for red in [1.0, 0.5, 0.25] {
        own.process.set(FROM_BYTES, vec![floats(&[red]), floats(&[0.0])]);
        in_flight.push(own.fixture.record(&own.scene)?);
    }
    for (recorded, red) in in_flight.into_iter().zip([255, 128, 64]) {
        let picture = own.fixture.submit(recorded)?.read(0, "own")?;
        assert_color(pixel(&picture, 3, 3), [red, 0, 1])?;
    }
    Ok(())
}

const FROM_HANDLES: &str = "
    @group(3) @binding(0) var<storage, read> tint: array<f32>;
    @group(3) @binding(1) var image: texture_2d<f32>;
    @group(3) @binding(2) var image_sampler: sampler;

    @fragment
    fn fragment(in: FullScreenPixel) -> @location(0) vec4<f32> {
        return vec4<f32>(textureSampleLevel(image, image_sampler, vec2<f32>(0.5, 0.5), 0.0).rg, tint[0], 1.0);
    }
";

/// A buffer with one number.
fn buffer(device: &wgpu::Device, queue: &wgpu::Queue, value: f32, usage: wgpu::BufferUsages) -> wgpu::Buffer {
    let usage = usage | wgpu::BufferUsages::COPY_DST;
    let descriptor = wgpu::BufferDescriptor { label: Some("tint"), size: 4, usage, mapped_at_creation: false };
    let buffer = device.create_buffer(&descriptor);
    queue.write_buffer(&buffer, 0, &value.to_le_bytes());
    buffer
}

/// A texture of one red and one green pixel.
fn image(device: &wgpu::Device, queue: &wgpu::Queue) -> ShaderResource<'static> {
    let size = wgpu::Extent3d { width: 2, height: 1, depth_or_array_layers: 1 };
    let texture = device.create_texture(&wgpu::TextureDescriptor {
        label: Some("image"),
        size,
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format: wgpu::TextureFormat::Rgba8Unorm,
        usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
        view_formats: &[],
    });
    let layout = wgpu::TexelCopyBufferLayout { bytes_per_row: Some(8), ..wgpu::TexelCopyBufferLayout::default() };
    #[expect(clippy::disallowed_methods, reason = "the texture is new")]
    queue.write_texture(texture.as_image_copy(), &[255, 0, 0, 255, 0, 255, 0, 255], layout, size);
    let view = texture.create_view(&wgpu::TextureViewDescriptor::default());
    ShaderResource::Texture { view, dimension: wgpu::TextureViewDimension::D2 }
}

fn sampler(device: &wgpu::Device, filter: wgpu::FilterMode) -> ShaderResource<'static> {
    let descriptor =
        wgpu::SamplerDescriptor { mag_filter: filter, min_filter: filter, ..wgpu::SamplerDescriptor::default() };
    let kind = wgpu::SamplerBindingType::Filtering;
    ShaderResource::Sampler { sampler: device.create_sampler(&descriptor), kind }
}

fn handles() -> Result<(), Failed> {
    let mut own = Own::new()?;
    let (device, queue) = device()?;
    let tint = buffer(&device, &queue, 0.25, wgpu::BufferUsages::STORAGE);
    let (image, linear) = (image(&device, &queue), sampler(&device, wgpu::FilterMode::Linear));
    let resources = vec![ShaderResource::Buffer(tint.clone()), image.clone(), linear.clone()];
    let picture = own.draw(FROM_HANDLES, resources.clone())?;
    assert_color(pixel(&picture, 3, 3), [128, 128, 64])?;
    queue.write_buffer(&tint, 0, &1.0_f32.to_le_bytes());
    let picture = own.draw(FROM_HANDLES, resources)?;
    assert_color(pixel(&picture, 3, 3), [128, 128, 255])?;
    // Another buffer and another sampler: another bind group.
    let other = buffer(&device, &queue, 0.0, wgpu::BufferUsages::STORAGE);
    let nearest = sampler(&device, wgpu::FilterMode::Nearest);
    let picture = own.draw(FROM_HANDLES, vec![ShaderResource::Buffer(other), image, nearest])?;
    assert_color(pixel(&picture, 3, 3), [0, 255, 0])
}

fn other_kinds() -> Result<(), Failed> {
    let mut own = Own::new()?;
    let (device, queue) = device()?;
    let tint = ShaderResource::Buffer(buffer(&device, &queue, 0.25, wgpu::BufferUsages::STORAGE));
    for _round in 0..2 {
        let picture = own.draw(FROM_BYTES, vec![floats(&[1.0]), floats(&[0.5])])?;
        assert_color(pixel(&picture, 3, 3), [255, 128, 1])?;
        let handles = vec![tint.clone(), image(&device, &queue), sampler(&device, wgpu::FilterMode::Linear)];
        let picture = own.draw(FROM_HANDLES, handles)?;
        assert_color(pixel(&picture, 3, 3), [128, 128, 64])?;
    }
    Ok(())
}

/// Red in the left half of the picture, green in the right one.
struct Halves;

impl RenderProcess for Halves {
    fn name(&self) -> &str {
        "halves"
    }

    fn declare(&self, declare: &mut Declare) {
        declare.clears_color("halves", Format::Rgba16Float, ClearColor::Value([0.0; 4]));
    }

    fn draws(&self) -> Draws<'_> {
        let shader = "
            @fragment
            fn fragment(in: FullScreenPixel) -> @location(0) vec4<f32> {
                return select(vec4<f32>(0.0, 1.0, 0.0, 1.0), vec4<f32>(1.0, 0.0, 0.0, 1.0), in.clip.x < 0.0);
            }
        ";
        Draws::FullScreen(FullScreen { shader, ..FullScreen::default() })
    }
}

/// The colour in the middle of `halves`, between two pixels.
struct Middle;

impl RenderProcess for Middle {
    fn name(&self) -> &str {
        "middle"
    }

    fn declare(&self, declare: &mut Declare) {
        declare.samples("halves");
        declare.clears_color("middle", Format::Rgba8Unorm, ClearColor::Value([0.0; 4]));
    }

    fn draws(&self) -> Draws<'_> {
        let shader = "
            @group(2) @binding(1) var halves: texture_2d<f32>;

            @fragment
            fn fragment(in: FullScreenPixel) -> @location(0) vec4<f32> {
                return textureSampleLevel(halves, target_sampler, vec2<f32>(0.5, 0.5), 0.0);
            }
        ";
        Draws::FullScreen(FullScreen { shader, ..FullScreen::default() })
    }
}

fn filtered_target() -> Result<(), Failed> {
    let mut fixture = Fixture::with(2, |builder| builder.process(Halves).process(Middle).output("middle"))?;
    let recorded = fixture.record(&field(4))?;
    let picture = fixture.submit(recorded)?.read(0, "middle")?;
    assert_color(pixel(&picture, 0, 0), [128, 128, 0])
}

fn refused() -> Result<(), Failed> {
    let [(device, queue), (other_device, other_queue)] = adapter::two_devices()?;
    let mut own = Own::on(WgpuBackend::new(device.clone(), queue.clone())?)?;
    let storage = wgpu::BufferUsages::STORAGE;
    let (image, linear) = (image(&device, &queue), sampler(&device, wgpu::FilterMode::Linear));
    let ShaderResource::Sampler { sampler: comparison, .. } = linear.clone() else { unreachable!("it is a sampler") };
    let comparison = ShaderResource::Sampler { sampler: comparison, kind: wgpu::SamplerBindingType::Comparison };
    let destroyed = buffer(&device, &queue, 0.25, storage);
    destroyed.destroy();
    let good = ShaderResource::Buffer(buffer(&device, &queue, 0.25, storage));
    let without_usage = ShaderResource::Buffer(buffer(&device, &queue, 0.25, wgpu::BufferUsages::VERTEX));
    let of_another_device = ShaderResource::Buffer(buffer(&other_device, &other_queue, 0.25, storage));
    let cases = [
        ("usage", vec![without_usage, image.clone(), linear.clone()]),
        ("another device", vec![of_another_device, image.clone(), linear.clone()]),
        ("destroyed", vec![ShaderResource::Buffer(destroyed), image.clone(), linear.clone()]),
        ("another kind of sampler", vec![good.clone(), image.clone(), comparison]),
        ("too few", vec![good.clone(), image.clone()]),
        ("another order", vec![image.clone(), good.clone(), linear.clone()]),
        ("no whole numbers", vec![ShaderResource::Bytes(vec![1, 2, 3].into()), image.clone(), linear.clone()]),
        ("no bytes", vec![ShaderResource::Bytes(Vec::new().into()), image.clone(), linear.clone()]),
    ];
    for (case, resources) in cases {
        let Err(error) = own.draw(FROM_HANDLES, resources) else { return Err(format!("{case} is not refused").into()) };
        let message = error.message().unwrap_or_default();
        println!("{case}: {message}");
        if !message.contains("own resources") {
            return Err(format!("{case}: the error does not name the process: {message}").into());
        }
        let picture = own.draw(FROM_HANDLES, vec![good.clone(), image.clone(), linear.clone()])?;
        assert_color(pixel(&picture, 3, 3), [128, 128, 64])?;
    }
    Ok(())
}

/// A texture of four samples a pixel, whose content is 0.
fn multisampled() -> Result<(), Failed> {
    let mut own = Own::new()?;
    let (device, _) = device()?;
    let texture = device.create_texture(&wgpu::TextureDescriptor {
        label: Some("samples"),
        size: wgpu::Extent3d { width: 2, height: 2, depth_or_array_layers: 1 },
        mip_level_count: 1,
        sample_count: 4,
        dimension: wgpu::TextureDimension::D2,
        format: wgpu::TextureFormat::Rgba8Unorm,
        usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::RENDER_ATTACHMENT,
        view_formats: &[],
    });
    let view = texture.create_view(&wgpu::TextureViewDescriptor::default());
    let shader = "
        @group(3) @binding(0) var samples: texture_multisampled_2d<f32>;

        @fragment
        fn fragment(in: FullScreenPixel) -> @location(0) vec4<f32> {
            return vec4<f32>(textureLoad(samples, vec2<i32>(1, 1), 3).rg, f32(textureNumSamples(samples)) / 255.0, 1.0);
        }
    ";
    let picture =
        own.draw(shader, vec![ShaderResource::Texture { view, dimension: wgpu::TextureViewDimension::D2 }])?;
    assert_color(pixel(&picture, 3, 3), [0, 0, 4])
}

fn refused_submission() -> Result<(), Failed> {
    let mut own = Own::new()?;
    let (device, queue) = device()?;
    let tint = buffer(&device, &queue, 0.25, wgpu::BufferUsages::STORAGE);
    let resources =
        vec![ShaderResource::Buffer(tint.clone()), image(&device, &queue), sampler(&device, wgpu::FilterMode::Linear)];
    own.process.set(FROM_HANDLES, resources);
    let mut recorded = own.fixture.record(&own.scene)?;
    let read_back = recorded.read_back(0, "own", [0, 0], [1, 1])?;
    tint.destroy();
    if own.fixture.submit(recorded).is_ok() {
        return Err("a buffer was destroyed, and nobody noticed".into());
    }
    match read_back.try_read() {
        Err(BackendError::NotSubmitted) => {}
        other => return Err(format!("read back of a refused submission: {other:?}").into()),
    }
    let picture = own.draw(FROM_BYTES, vec![floats(&[1.0]), floats(&[0.5])])?;
    assert_color(pixel(&picture, 3, 3), [255, 128, 1])
}
