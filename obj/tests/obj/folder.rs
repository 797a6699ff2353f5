//! Temporary files, and access to the scenes loaded from them.

use std::fs;
use std::path::PathBuf;
use std::sync::atomic::{AtomicU32, Ordering};

use drawloom::scene::{Mesh, VERTEX_COLOR};
use drawloom_obj::{Imported, ObjError, ObjLimits};
use image::RgbaImage;

/// A temporary folder, which is removed on drop.
pub struct Folder(pub PathBuf);

impl Folder {
    pub fn new() -> Self {
        static NEXT: AtomicU32 = AtomicU32::new(0);
        // Relaxed: only uniqueness matters.
        let number = NEXT.fetch_add(1, Ordering::Relaxed);
        let path = std::env::temp_dir().join(format!("drawloom-obj-{}-{number}", std::process::id()));
        fs::create_dir_all(path.join("textures")).unwrap();
        Self(path)
    }

    pub fn with(self, name: &str, contents: impl AsRef<[u8]>) -> Self {
        fs::write(self.0.join(name), contents).unwrap();
        self
    }

    pub fn with_image(self, name: &str, image: &RgbaImage) -> Self {
        image.save(self.0.join(name)).unwrap();
        self
    }

    pub fn load_within(&self, limits: &ObjLimits) -> Result<Imported, ObjError> {
        drawloom_obj::load_within(self.0.join("a.obj"), limits)
    }

    pub fn load(&self) -> Result<Imported, ObjError> {
        drawloom_obj::load(self.0.join("a.obj"))
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        // A folder that cannot be removed is no failure.
        let _ = fs::remove_dir_all(&self.0);
    }
}

pub const TRIANGLE: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";

pub fn load(text: &str) -> Imported {
    Folder::new().with("a.obj", text).load().unwrap()
}

pub fn mesh(imported: &Imported, object: usize) -> &Mesh {
    let scene = imported.scene.as_scene_ref();
    scene.assets.get(scene.meshes[object]).unwrap()
}

/// The colours of the vertices of the first object; empty if they have none.
pub fn colors(imported: &Imported) -> Vec<[f32; 3]> {
    let bytes = mesh(imported, 0).attribute(VERTEX_COLOR).unwrap_or_default();
    let numbers: Vec<f32> = bytes.as_chunks().0.iter().copied().map(f32::from_ne_bytes).collect();
    numbers.as_chunks().0.to_vec()
}
