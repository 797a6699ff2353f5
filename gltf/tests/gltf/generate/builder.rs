//! Writes glTF: JSON, and a buffer behind it.

use image::{ImageFormat, RgbaImage};
use serde_json::{Value, json};

use super::shapes::Shape;

/// A file that is being made. Its JSON can be changed at will.
pub struct Builder {
    pub json: Value,
    pub binary: Vec<u8>,
}

impl Builder {
    pub fn new() -> Self {
        let json = json!({"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": []}]});
        Self { json, binary: Vec::new() }
    }

    /// Adds an element to one of the arrays, such as `nodes`. Returns its index.
    pub fn push(&mut self, array: &str, element: Value) -> usize {
        if self.json.get(array).is_none() {
            self.json[array] = json!([]);
        }
        let elements = self.json[array].as_array_mut().expect("an array");
        elements.push(element);
        elements.len() - 1
    }

    /// Adds a node to the scene.
    pub fn root(&mut self, node: Value) -> usize {
        let index = self.push("nodes", node);
        self.json["scenes"][0]["nodes"].as_array_mut().expect("an array").push(index.into());
        index
    }

    /// Adds bytes as a buffer view.
    pub fn view(&mut self, bytes: &[u8]) -> usize {
        self.binary.resize(self.binary.len().next_multiple_of(4), 0);
        let offset = self.binary.len();
        self.binary.extend_from_slice(bytes);
        self.push("bufferViews", json!({"buffer": 0, "byteOffset": offset, "byteLength": bytes.len()}))
    }

    /// Adds an accessor of floats: scalars, vectors, or matrices of 16.
    pub fn floats<const N: usize>(&mut self, values: &[[f32; N]]) -> usize {
        let view = self.view(bytemuck::cast_slice(values.as_flattened()));
        let kind = ["", "SCALAR", "VEC2", "VEC3", "VEC4"].get(N).copied().unwrap_or("MAT4");
        let edge = |pick: fn(f32, f32) -> f32| -> Vec<f32> {
            (0..N).map(|axis| values.iter().map(|value| value[axis]).reduce(pick).unwrap_or(0.0)).collect()
        };
        let (min, max) = (edge(f32::min), edge(f32::max));
        let count = values.len();
        let accessor =
            json!({"bufferView": view, "componentType": 5126, "count": count, "type": kind, "min": min, "max": max});
        self.push("accessors", accessor)
    }

    /// Adds an accessor of indices.
    pub fn indices(&mut self, values: &[u32]) -> usize {
        let view = self.view(bytemuck::cast_slice(values));
        let accessor = json!({"bufferView": view, "componentType": 5125, "count": values.len(), "type": "SCALAR"});
        self.push("accessors", accessor)
    }

    /// Adds an accessor of joints.
    pub fn joints(&mut self, values: &[[u8; 4]]) -> usize {
        let view = self.view(values.as_flattened());
        let accessor = json!({"bufferView": view, "componentType": 5121, "count": values.len(), "type": "VEC4"});
        self.push("accessors", accessor)
    }

    /// Adds an image as a PNG in a buffer view, and a texture of it.
    pub fn texture(&mut self, image: &RgbaImage) -> usize {
        let view = self.view(&png(image));
        let source = self.push("images", json!({"bufferView": view, "mimeType": "image/png"}));
        self.push("textures", json!({"source": source}))
    }

    /// The primitive of a shape.
    pub fn primitive(&mut self, shape: &Shape, material: Option<usize>) -> Value {
        let mut attributes = json!({
            "POSITION": self.floats(&shape.positions),
            "NORMAL": self.floats(&shape.normals),
        });
        if !shape.uvs.is_empty() {
            attributes["TEXCOORD_0"] = self.floats(&shape.uvs).into();
        }
        let mut primitive = json!({"attributes": attributes, "indices": self.indices(&shape.indices)});
        if let Some(material) = material {
            primitive["material"] = material.into();
        }
        primitive
    }

    /// Adds a mesh of one primitive.
    pub fn mesh(&mut self, shape: &Shape, material: Option<usize>) -> usize {
        let primitive = self.primitive(shape, material);
        self.push("meshes", json!({"primitives": [primitive]}))
    }

    /// Adds a camera at a point that looks along -Z.
    pub fn camera_at(&mut self, position: [f32; 3]) -> usize {
        let camera = json!({"type": "perspective", "perspective": {"yfov": 0.8, "znear": 0.1}});
        let camera = self.push("cameras", camera);
        self.root(json!({"camera": camera, "translation": position}))
    }

    /// Adds a light that shines along -Z, turned by a quaternion.
    pub fn light(&mut self, light: Value, position: [f32; 3], rotation: [f32; 4]) {
        let extensions = &mut self.json["extensions"]["KHR_lights_punctual"]["lights"];
        if !extensions.is_array() {
            *extensions = json!([]);
        }
        let lights = extensions.as_array_mut().expect("an array");
        lights.push(light);
        let index = lights.len() - 1;
        self.json["extensionsUsed"] = json!(["KHR_lights_punctual"]);
        let extension = json!({"KHR_lights_punctual": {"light": index}});
        self.root(json!({"translation": position, "rotation": rotation, "extensions": extension}));
    }

    /// A light behind the camera that shines along -Z.
    pub fn sun(&mut self, illuminance: f32) {
        let light = json!({"type": "directional", "intensity": illuminance});
        self.light(light, [0.0; 3], [0.0, 0.0, 0.0, 1.0]);
    }

    /// A light from the upper right, behind the camera.
    pub fn slanted_sun(&mut self) {
        let light = json!({"type": "directional", "intensity": 3.0});
        self.light(light, [0.0; 3], [-0.3, 0.2, 0.0, 0.932_737_9]);
    }

    /// As a `.glb`.
    pub fn glb(&self) -> Vec<u8> {
        let mut json = self.json.clone();
        if !self.binary.is_empty() {
            json["buffers"] = json!([{"byteLength": self.binary.len()}]);
        }
        glb(&json, &self.binary)
    }

    /// As a `.gltf` whose buffer is in a file of this name.
    pub fn gltf(&self, buffer: &str) -> Vec<u8> {
        let mut json = self.json.clone();
        json["buffers"] = json!([{"byteLength": self.binary.len(), "uri": buffer}]);
        json.to_string().into_bytes()
    }
}

/// The container of some JSON and a binary chunk.
pub fn glb(json: &Value, binary: &[u8]) -> Vec<u8> {
    let mut json = json.to_string().into_bytes();
    json.resize(json.len().next_multiple_of(4), b' ');
    let mut binary = binary.to_vec();
    binary.resize(binary.len().next_multiple_of(4), 0);
    let length = 12 + 8 + json.len() + 8 + binary.len();
    let word = |number: usize| (number as u32).to_le_bytes();
    let parts: [&[u8]; 9] =
        [b"glTF", &word(2), &word(length), &word(json.len()), b"JSON", &json, &word(binary.len()), b"BIN\0", &binary];
    parts.concat()
}

/// An image as a PNG.
pub fn png(image: &RgbaImage) -> Vec<u8> {
    let mut bytes = std::io::Cursor::new(Vec::new());
    image.write_to(&mut bytes, ImageFormat::Png).expect("it is written to memory");
    bytes.into_inner()
}
