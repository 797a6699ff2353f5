//! Shaders in files that change while the engine runs.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;
use std::time::{Duration, Instant, SystemTime};

use parking_lot::Mutex;

use crate::unwind::emit;

/// WGSL in a file, which is read again when the file changes. With
/// [`WgpuBackend::keep_working_shaders`](crate::backend::WgpuBackend::keep_working_shaders), a mistake in it is reported with its line,
/// and frames are drawn with the shader before it until it is mended.
///
/// ```no_run
/// use drawloom::process::{CommandDraws, Declare, Draws, RenderProcess, ShaderFile};
///
/// struct Water {
///     shader: ShaderFile,
/// }
///
/// impl RenderProcess for Water {
///     fn name(&self) -> &str {
///         "water"
///     }
///
///     fn declare(&self, declare: &mut Declare) {
///         declare.draws_over("radiance");
///     }
///
///     fn draws(&self) -> Draws<'_> {
///         Draws::Commands(CommandDraws { shader: self.shader.text(), ..CommandDraws::default() })
///     }
/// }
///
/// let water = Water { shader: ShaderFile::open("shaders/water.wgsl")? };
/// # Ok::<(), std::io::Error>(())
/// ```
#[derive(Debug)]
pub struct ShaderFile {
    path: PathBuf,
    first: Version,
    checked: Mutex<Check>,
}

/// When the file was looked at, and what it was then.
#[derive(Debug)]
struct Check {
    at: Instant,
    stamp: Option<Stamp>,
}

/// What changes with a file: its time of change, and its length. `None` for a file that is not there.
type Stamp = (Option<SystemTime>, u64);

/// A text that the file had. Texts that shaders were made from are lent, so each stays until the file is dropped.
#[derive(Debug)]
struct Version {
    text: String,
    next: OnceLock<Box<Version>>,
}

impl ShaderFile {
    /// How often the file is looked at.
    const INTERVAL: Duration = Duration::from_millis(200);

    /// Reads a file.
    ///
    /// # Errors
    /// If it cannot be read, or is not UTF-8.
    pub fn open(path: impl Into<PathBuf>) -> io::Result<Self> {
        let path = path.into();
        // Taken first: a change while the text is read is found the next time.
        let stamp = stamp(&path);
        let first = Version::read(&path)?;
        Ok(Self { path, first, checked: Mutex::new(Check { at: Instant::now(), stamp }) })
    }

    /// The text that the file has, or had a moment ago. A file that cannot be read keeps the text that it had; that is warned of
    /// through `tracing`.
    pub fn text(&self) -> &str {
        let mut latest = &self.first;
        while let Some(next) = latest.next.get() {
            latest = next;
        }
        let mut checked = self.checked.lock();
        if checked.at.elapsed() < Self::INTERVAL {
            return &latest.text;
        }
        let stamp = stamp(&self.path);
        checked.at = Instant::now();
        if std::mem::replace(&mut checked.stamp, stamp) == stamp {
            return &latest.text;
        }
        match Version::read(&self.path) {
            // Only the thread with the lock adds one.
            Ok(next) => &latest.next.get_or_init(|| Box::new(next)).text,
            Err(error) => {
                drop(checked);
                // The engine's subscriber may ask for the text.
                emit(|| {
                    tracing::warn!(target: "drawloom", path = %self.path.display(), %error, "a shader cannot be read again");
                });
                &latest.text
            }
        }
    }

    /// The path of the file.
    pub fn path(&self) -> &Path {
        &self.path
    }
}

impl Version {
    fn read(path: &Path) -> io::Result<Self> {
        Ok(Self { text: fs::read_to_string(path)?, next: OnceLock::new() })
    }
}

fn stamp(path: &Path) -> Option<Stamp> {
    let metadata = fs::metadata(path).ok()?;
    Some((metadata.modified().ok(), metadata.len()))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Writes the file so that its time of change is another.
    fn write(path: &Path, text: &str, seconds: u64) {
        fs::write(path, text).unwrap();
        let file = fs::File::options().append(true).open(path).unwrap();
        file.set_modified(SystemTime::UNIX_EPOCH + Duration::from_secs(seconds)).unwrap();
    }

    #[test]
    fn a_changed_file_is_read_again_and_texts_stay() {
        let path = std::env::temp_dir().join(format!("drawloom-shader-{}.wgsl", std::process::id()));
        write(&path, "first", 1);
        let file = ShaderFile::open(&path).unwrap();
        let look_again = || file.checked.lock().at = Instant::now() - 2 * ShaderFile::INTERVAL;
        let first = file.text();
        write(&path, "second", 2);
        assert_eq!(file.text(), "first", "it is looked at a few times a second");
        look_again();
        let second = file.text();
        look_again();
        assert_eq!(file.text(), "second");
        fs::remove_file(&path).unwrap();
        look_again();
        assert_eq!(file.text(), "second", "a file that is gone keeps its text");
        write(&path, "third", 3);
        look_again();
        assert_eq!([first, second, file.text()], ["first", "second", "third"]);
        fs::remove_file(&path).unwrap();
        assert!(ShaderFile::open(&path).is_err());
    }
}
