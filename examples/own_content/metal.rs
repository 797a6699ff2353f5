//! A material type of the engine's own: base colour, normals, and metalness with roughness from three textures, on
//! vertices with tangents and colours.

use std::f32::consts::TAU;

use drawloom::command::Selection;
use drawloom::glam::{Vec2, Vec3};
use drawloom::process::{
    CommandDraws, Declare, Draws, ILLUMINATION_SHADER, InjectionPoint, RenderProcess, ShaderResource, targets,
};
use drawloom::scene::{MaterialType, Mesh, SceneError, Topology, Vertex, VertexAttribute};
use drawloom::wgpu;
use wgpu::util::DeviceExt;

/// The direction in which the texture coordinate u grows, and the sign of the third axis.
pub const TANGENT: VertexAttribute<[f32; 4]> = VertexAttribute::new("tangent");

/// The colour that the base colour is multiplied by.
pub const COLOR: VertexAttribute<[u8; 4]> = VertexAttribute::new("colour");

/// What distinguishes one material of this type from another: `Metal` in `metal.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
pub struct Metal {
    /// Multiplied by the base colour.
    pub color: [f32; 3],
    /// Multiplied by the roughness.
    pub roughness: f32,
}

/// The material type of the rings.
pub const METAL: MaterialType<Metal> = MaterialType::new("metal");

/// The name of the process.
pub const NAME: &str = "metal";

/// Draws the objects whose material is of the type [`METAL`], lit by all lights that reach the view, without their
/// shadows.
pub struct MetalSurfaces {
    shader: String,
    resources: Vec<ShaderResource<'static>>,
}

impl MetalSurfaces {
    pub fn new(device: &wgpu::Device, queue: &wgpu::Queue) -> Self {
        use wgpu::TextureFormat::{Rgba8Unorm, Rgba8UnormSrgb};
        let sampler = device.create_sampler(&wgpu::SamplerDescriptor {
            address_mode_u: wgpu::AddressMode::Repeat,
            address_mode_v: wgpu::AddressMode::Repeat,
            mag_filter: wgpu::FilterMode::Linear,
            min_filter: wgpu::FilterMode::Linear,
            ..wgpu::SamplerDescriptor::default()
        });
        let resources = vec![
            texture(device, queue, "base colour", Rgba8UnormSrgb, base_color),
            texture(device, queue, "normals", Rgba8Unorm, normal),
            texture(device, queue, "metalness and roughness", Rgba8Unorm, metalness_and_roughness),
            ShaderResource::Sampler { sampler, kind: wgpu::SamplerBindingType::Filtering },
        ];
        Self { shader: [ILLUMINATION_SHADER, include_str!("metal.wgsl")].concat(), resources }
    }
}

impl RenderProcess for MetalSurfaces {
    fn name(&self) -> &str {
        NAME
    }

    fn declare(&self, declare: &mut Declare) {
        declare.at(InjectionPoint::AfterLighting);
        declare.draws_over(targets::RADIANCE);
        declare.draws_depth(targets::DEPTH);
        declare.reads_materials(METAL);
        declare.reads_attribute(TANGENT, [1.0, 0.0, 0.0, 1.0]);
        declare.reads_attribute(COLOR, [255; 4]);
    }

    fn draws(&self) -> Draws<'_> {
        let (shader, resources) = (&self.shader, self.resources.clone());
        let selection = Selection::OPAQUE.of_material_type(METAL);
        Draws::Commands(CommandDraws { shader, selection, resources, ..CommandDraws::default() })
    }
}

/// A ring whose colours go around once.
pub fn torus() -> Result<Mesh, SceneError> {
    const AROUND: u32 = 96;
    const ACROSS: u32 = 40;
    let (mut vertices, mut tangents, mut colors, mut indices) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
    for around in 0..=AROUND {
        for across in 0..=ACROSS {
            let [u, v] = [around as f32 / AROUND as f32, across as f32 / ACROSS as f32];
            let (along, angle) = (Vec2::from_angle(u * TAU), Vec2::from_angle(v * TAU));
            let normal = Vec3::new(along.x * angle.x, angle.y, -along.y * angle.x);
            let position = Vec3::new(along.x, 0.0, -along.y) + 0.4 * normal;
            let uv = [u * 8.0, -v * 3.0];
            vertices.push(Vertex { position: position.to_array(), normal: normal.to_array(), uv });
            tangents.push([-along.y, 0.0, -along.x, 1.0]);
            colors.push([255, (200.0 + 55.0 * along.x) as u8, (170.0 + 80.0 * along.y) as u8, 255]);
            if around < AROUND && across < ACROSS {
                let first = around * (ACROSS + 1) + across;
                let next = first + ACROSS + 1;
                indices.extend([first, next, next + 1, first, next + 1, first + 1]);
            }
        }
    }
    let mesh = Mesh::new("torus", Topology::TriangleList, vertices, indices)?;
    mesh.with_attribute(TANGENT, &tangents)?.with_attribute(COLOR, &colors)
}

/// The width and height of the textures in pixels.
const SIDE: u32 = 256;

fn texture(
    device: &wgpu::Device,
    queue: &wgpu::Queue,
    label: &'static str,
    format: wgpu::TextureFormat,
    color: fn(Vec2) -> Vec3,
) -> ShaderResource<'static> {
    let points = (0..SIDE * SIDE).map(|pixel| Vec2::new((pixel % SIDE) as f32, (pixel / SIDE) as f32) / SIDE as f32);
    let bytes: Vec<u8> = points
        .flat_map(|point| (color(point).extend(1.0) * 255.0).round().to_array())
        .map(|channel| channel as u8)
        .collect();
    let descriptor = wgpu::TextureDescriptor {
        label: Some(label),
        size: wgpu::Extent3d { width: SIDE, height: SIDE, depth_or_array_layers: 1 },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage: wgpu::TextureUsages::TEXTURE_BINDING,
        view_formats: &[],
    };
    let texture = device.create_texture_with_data(queue, &descriptor, wgpu::util::TextureDataOrder::LayerMajor, &bytes);
    let view = texture.create_view(&wgpu::TextureViewDescriptor::default());
    ShaderResource::Texture { view, dimension: wgpu::TextureViewDimension::D2 }
}

/// How far a point is above the joints between plates, 0 to 1, and its gradient.
fn height(point: Vec2) -> (f32, Vec2) {
    let cell = (point * 4.0).fract() - 0.5;
    let from_edge = 0.5 - cell.abs().max_element();
    let slope =
        if cell.x.abs() > cell.y.abs() { Vec2::new(-cell.x.signum(), 0.0) } else { Vec2::new(0.0, -cell.y.signum()) };
    ((from_edge * 12.0).clamp(0.0, 1.0), if from_edge < 1.0 / 12.0 { slope } else { Vec2::ZERO })
}

fn base_color(point: Vec2) -> Vec3 {
    let (height, _) = height(point);
    Vec3::new(0.12, 0.1, 0.1).lerp(Vec3::new(1.0, 0.86, 0.57), height)
}

fn normal(point: Vec2) -> Vec3 {
    let (_, gradient) = height(point);
    Vec3::new(-gradient.x, gradient.y, 1.2).normalize() * 0.5 + 0.5
}

/// Red is metalness, green is roughness.
fn metalness_and_roughness(point: Vec2) -> Vec3 {
    let (height, _) = height(point);
    Vec3::new(height, 0.9 - 0.6 * height, 0.0)
}
