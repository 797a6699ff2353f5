//! Three pictures of the flight.

use std::error::Error;
use std::path::Path;

use drawloom::backend::WgpuReadBack;
use drawloom_output::PictureFile;

/// The pictures, each read back by the frame that drew it, without waiting for it.
#[derive(Default)]
pub struct Pictures {
    pictures: Vec<WgpuReadBack>,
}

impl Pictures {
    /// The shares of the flight after which there is a picture.
    const TIMES: [f64; 3] = [0.2, 0.5, 0.85];

    /// Whether the next picture is due.
    pub fn is_due(&self, share: f64) -> bool {
        Self::TIMES.get(self.pictures.len()).is_some_and(|time| share >= *time)
    }

    pub fn add(&mut self, picture: WgpuReadBack) {
        self.pictures.push(picture);
    }

    /// Writes them into a folder.
    ///
    /// # Errors
    /// If one cannot be read or written.
    pub fn write(&self, folder: &Path) -> Result<(), Box<dyn Error>> {
        for (number, picture) in self.pictures.iter().enumerate() {
            let picture = picture.read()?;
            let file = PictureFile::new(folder.join(format!("picture-{}.png", number + 1)))?;
            file.write([picture.width, picture.height], &picture.bytes)?;
        }
        Ok(())
    }
}
