//! What the files of an import may take.

use std::io;

/// What the files of an import may take, so that a damaged or hostile file cannot exhaust memory or take very long. A
/// file that exceeds a limit is refused, and the message names the limit.
///
/// ```no_run
/// use drawloom_obj::ObjLimits;
///
/// let limits = ObjLimits { texture_bytes: 1 << 30, ..ObjLimits::default() };
/// let imported = drawloom_obj::load_within("assets/sponza.obj", &limits)?;
/// # Ok::<(), drawloom_obj::ObjError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ObjLimits {
    /// The bytes of the OBJ file. While it is imported, a usual one takes some six times as much memory. Default: 1
    /// GiB.
    pub scene_bytes: u64,
    /// The bytes of one line of an OBJ file or a material library, with the lines that continue it. Longer lines are
    /// left out, with a warning. Default: 32 MiB.
    pub line_bytes: u64,
    /// The bytes of all material libraries together. Default: 64 MiB.
    pub library_bytes: u64,
    /// The bytes of the file of a texture. Default: 256 MiB.
    pub texture_file_bytes: u64,
    /// The bytes that a texture takes while it is decoded, which are known before: 4 for each pixel, and besides those
    /// of the file's own format where a channel has more than 8 bits, and the coefficients of a JPEG that is
    /// progressive or has a scan for each component. Scaling takes no more. Default: 256 MiB, which is enough for the
    /// largest [`Texture`](drawloom::scene::Texture).
    pub texture_bytes: u64,
    /// The bytes that all textures of the scene take together, 4 for each pixel. Default: 4 GiB.
    pub all_textures_bytes: u64,
    /// The bytes that are read from files of textures and decoded to pixels, 4 for each, during the whole import. Those
    /// count too that the scene does not keep: of files that turn out to be damaged, of masks, and of pictures that are
    /// decoded once more, for another mask. This bounds how long an import takes. Default: 16 GiB, which take about a
    /// minute.
    pub decoded_bytes: u64,
    /// The warnings of each kind that are listed. All are counted. Default: 100.
    pub warnings: usize,
}

impl Default for ObjLimits {
    fn default() -> Self {
        Self {
            scene_bytes: 1 << 30,
            line_bytes: 32 << 20,
            library_bytes: 64 << 20,
            texture_file_bytes: 256 << 20,
            texture_bytes: 256 << 20,
            all_textures_bytes: 4 << 30,
            decoded_bytes: 16 << 30,
            warnings: 100,
        }
    }
}

/// One of the limits in bytes.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Limit {
    /// Its field in [`ObjLimits`].
    pub field: &'static str,
    pub bytes: u64,
    /// The bytes that are taken already, where a limit is that of several files.
    pub taken: u64,
}

/// More bytes than a limit allows.
#[derive(Debug, thiserror::Error)]
#[error("it takes {at_least} bytes or more{}, and `ObjLimits::{}` is {}", self.already_taken(), limit.field, limit.bytes)]
struct OverLimit {
    at_least: u64,
    limit: Limit,
}

impl OverLimit {
    fn already_taken(&self) -> String {
        match self.limit.taken {
            0 => String::new(),
            taken => format!(", {taken} are taken"),
        }
    }
}

impl Limit {
    pub(crate) fn new(field: &'static str, bytes: u64) -> Self {
        Self { field, bytes, taken: 0 }
    }

    /// The bytes that are left of it.
    pub(crate) fn left(self) -> u64 {
        self.bytes.saturating_sub(self.taken)
    }

    /// The one of two limits of which less is left.
    pub(crate) fn min(self, other: Self) -> Self {
        if self.left() <= other.left() { self } else { other }
    }

    /// Takes bytes.
    ///
    /// # Errors
    /// As [`Self::check`].
    pub(crate) fn take(&mut self, bytes: u64) -> io::Result<()> {
        self.check(bytes)?;
        self.taken += bytes;
        Ok(())
    }

    /// Checks a size in bytes, of which at least this number is known.
    ///
    /// # Errors
    /// If it is above what is left of the limit, with the kind [`io::ErrorKind::FileTooLarge`].
    pub(crate) fn check(self, at_least: u64) -> io::Result<()> {
        if self.taken.saturating_add(at_least) <= self.bytes {
            return Ok(());
        }
        Err(io::Error::new(io::ErrorKind::FileTooLarge, OverLimit { at_least, limit: self }))
    }
}
