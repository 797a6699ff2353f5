//! Opening files whose names come from other files.

use std::fs::{self, File, Metadata, OpenOptions};
use std::io::{self, BufRead, BufReader, Read, Seek, SeekFrom};
use std::path::Path;

use crate::limits::Limit;

/// Opens the file of a name, relative to the OBJ file, within a limit.
pub(crate) type Open<'a> = &'a dyn Fn(&str, Limit) -> io::Result<Box<dyn Stream>>;

/// A file that is read piece by piece.
pub(crate) trait Stream: BufRead + Seek {}

impl<T: BufRead + Seek> Stream for T {}

/// Opens a regular file of at most `limit` bytes. What is no file, such as a FIFO or a device, may never end, and
/// opening a FIFO waits for whoever writes to it.
///
/// # Errors
/// If it cannot be opened, is no regular file, or is larger.
pub(crate) fn open(path: &Path, limit: Limit) -> io::Result<BufReader<Bounded<File>>> {
    check(&fs::metadata(path)?, limit)?;
    let file = non_blocking().open(path)?;
    // By now, the path may be that of something else.
    check(&file.metadata()?, limit)?;
    Ok(BufReader::with_capacity(1 << 16, Bounded { inner: file, position: 0, limit }))
}

/// Reads up to a limit, and then fails: a file may grow while it is read.
#[derive(Debug)]
pub(crate) struct Bounded<R> {
    inner: R,
    position: u64,
    limit: Limit,
}

impl<R: Read> Read for Bounded<R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let count = self.inner.read(buffer)?;
        self.position += count as u64;
        // A decoder may look for something behind the end, where there is nothing to read.
        if count > 0 {
            self.limit.check(self.position)?;
        }
        Ok(count)
    }
}

impl<R: Seek> Seek for Bounded<R> {
    fn seek(&mut self, position: SeekFrom) -> io::Result<u64> {
        self.position = self.inner.seek(position)?;
        Ok(self.position)
    }
}

fn check(metadata: &Metadata, limit: Limit) -> io::Result<()> {
    if metadata.is_dir() {
        return Err(io::ErrorKind::IsADirectory.into());
    }
    if !metadata.is_file() {
        return Err(io::Error::new(io::ErrorKind::InvalidInput, "it is not a regular file"));
    }
    limit.check(metadata.len())
}

/// Options with which opening a FIFO does not wait, in case that a file is replaced by one between its check and its
/// opening.
fn non_blocking() -> OpenOptions {
    let mut options = OpenOptions::new();
    options.read(true);
    #[cfg(any(target_os = "linux", target_os = "android"))]
    std::os::unix::fs::OpenOptionsExt::custom_flags(&mut options, rustix::fs::OFlags::NONBLOCK.bits().cast_signed());
    options
}

/// The most bytes of a file's name, with its folders: no file has a longer one on Linux, whose limit of 4,096 includes
/// a zero behind it. Names are kept for each material, so longer ones would take memory for nothing.
const MAX_NAME_BYTES: usize = 4095;

/// A name that the text behind a keyword may mean.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct PossibleName {
    pub name: String,
    /// Whether it leaves out options before or behind the name.
    pub drops_options: bool,
}

/// The names that the text behind a keyword may mean, the likeliest first, as [`normalized`] paths. Names may contain
/// spaces, quotes, `#` and `-`, but programs also write quotes around them, a comment or options behind them, and a
/// backslash before a space. None is longer than [`MAX_NAME_BYTES`].
///
/// # Errors
/// Says why there is none.
pub(crate) fn possible_names(folder: &str, text: &str) -> io::Result<Vec<PossibleName>> {
    let quoted = text.strip_prefix('"').and_then(|rest| rest.split_once('"'));
    let comment = text.match_indices('#').map(|(index, _)| &text[..index]);
    let comment = comment.into_iter().find(|before| before.ends_with(char::is_whitespace));
    let readings = [
        Some((text, false)),
        quoted.map(|(name, behind)| (name, behind.trim_start().starts_with('-'))),
        comment.map(|before| (before.trim_end(), false)),
        text.split_once(" -").map(|(before, _)| (before.trim_end(), true)),
        text.rsplit_once(char::is_whitespace).filter(|_| text.starts_with('-')).map(|(_, last)| (last, true)),
    ];
    let mut names: Vec<PossibleName> = Vec::new();
    let mut reason = "there is no name".to_owned();
    for (name, drops_options) in readings.into_iter().flatten().filter(|(name, _)| !name.is_empty()) {
        // A backslash separates folders, or belongs to the space behind it.
        for name in [name.replace('\\', "/"), name.replace("\\ ", " ").replace('\\', "/")] {
            let name = normalized(&format!("{folder}{name}"));
            if name.len() > MAX_NAME_BYTES {
                reason = format!("the name has more than {MAX_NAME_BYTES} bytes");
            } else if !name.is_empty() && names.iter().all(|known| known.name != name) {
                names.push(PossibleName { name, drops_options });
            }
        }
    }
    if names.is_empty() { Err(io::Error::new(io::ErrorKind::InvalidFilename, reason)) } else { Ok(names) }
}

/// A path without empty components, without `.`, and without each `..` and the folder before it that it leaves, so that
/// a file has one name. Symbolic links are not followed.
fn normalized(path: &str) -> String {
    // Two slashes at the start are those of a share on Windows.
    let root = ["//", "/"].into_iter().find(|&root| path.starts_with(root)).unwrap_or_default();
    let mut components = Vec::new();
    for component in path.split('/') {
        match component {
            "" | "." => {}
            ".." if components.last().is_some_and(|&last| last != "..") => {
                components.pop();
            }
            _ => components.push(component),
        }
    }
    root.to_owned() + &components.join("/")
}

/// The first of several possible names under which `read` finds something, and what it finds.
///
/// # Errors
/// Returns an error of a name under which there is something, or else says that nothing is found.
pub(crate) fn first_readable<T>(
    names: &[PossibleName],
    mut read: impl FnMut(&str) -> io::Result<T>,
) -> io::Result<(&PossibleName, T)> {
    let mut reason = io::Error::from(io::ErrorKind::NotFound);
    for name in names {
        match read(&name.name) {
            Ok(found) => return Ok((name, found)),
            Err(error) if reason.kind() == io::ErrorKind::NotFound => reason = error,
            Err(_) => {}
        }
    }
    Err(reason)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_is_found_behind_what_programs_write_around_it() {
        for (text, name, drops_options) in [
            ("a.png", "a.png", false),
            ("in\\a file.png", "in/a file.png", false),
            ("\"a file.png\"", "a file.png", false),
            ("\"a file.png\" # the leaf", "a file.png", false),
            ("\"a file.png\" -s 2 2", "a file.png", true),
            ("a.png # the leaf", "a.png", false),
            ("a\\ file.png", "a file.png", false),
            ("a.png -s 2 2 2", "a.png", true),
            ("-colorspace sRGB a.png", "a.png", true),
            ("-x.png", "-x.png", false),
            ("a #1.png", "a #1.png", false),
        ] {
            let names = possible_names("folder/", text).unwrap();
            let expected = PossibleName { name: format!("folder/{name}"), drops_options };
            assert!(names.contains(&expected), "{text}: {names:?}");
            assert_eq!(names[0].name, format!("folder/{}", text.replace('\\', "/")));
        }
    }

    #[test]
    fn a_file_has_one_name() {
        for (text, name) in [
            ("x.png", "x.png"),
            ("./x.png", "x.png"),
            (".\\.\\x.png", "x.png"),
            ("a//x.png", "a/x.png"),
            ("a/../x.png", "x.png"),
            ("a/b/../../x.png", "x.png"),
            ("../x.png", "../x.png"),
            ("a/../../../x.png", "../../x.png"),
            ("...x/..png", "...x/..png"),
            ("/a/./x.png", "/a/x.png"),
            ("\\\\server\\share\\x.png", "//server/share/x.png"),
        ] {
            assert_eq!(possible_names("", text).unwrap()[0].name, name, "{text}");
        }
        assert_eq!(possible_names("in/", "../x.png").unwrap()[0].name, "x.png");
        assert_eq!(possible_names("in/", "..\\..\\x.png").unwrap()[0].name, "../x.png");
    }

    #[test]
    fn an_error_says_why_there_is_no_name() {
        for text in ["", "a/.."] {
            assert_eq!(possible_names("", text).unwrap_err().to_string(), "there is no name");
        }
        assert_eq!(possible_names("", &"x".repeat(4095)).unwrap()[0].name.len(), 4095);
        let error = possible_names("", &"x".repeat(4096)).unwrap_err();
        assert_eq!(error.to_string(), "the name has more than 4095 bytes");
    }

    #[test]
    fn a_limit_is_named_and_applies_to_what_is_read() {
        let path = std::env::temp_dir().join(format!("drawloom-limit-{}", std::process::id()));
        fs::write(&path, [7; 100]).unwrap();
        let limit = |bytes| Limit::new("library_bytes", bytes);
        let read = |file: &mut BufReader<Bounded<File>>| {
            let mut bytes = Vec::new();
            file.read_to_end(&mut bytes).map(|_| bytes)
        };
        let mut file = open(&path, limit(100)).unwrap();
        assert_eq!(read(&mut file).unwrap(), [7; 100]);
        // What is read again does not count again.
        file.seek(SeekFrom::End(-60)).unwrap();
        assert_eq!(read(&mut file).unwrap(), [7; 60]);
        // Behind the end there is nothing.
        file.seek(SeekFrom::Start(1000)).unwrap();
        assert!(read(&mut file).unwrap().is_empty());
        // A file that grows is read up to the limit.
        fs::write(&path, [7; 101]).unwrap();
        file.rewind().unwrap();
        assert_eq!(read(&mut file).unwrap_err().kind(), io::ErrorKind::FileTooLarge);
        fs::write(&path, [7; 100]).unwrap();
        let error = open(&path, limit(99)).unwrap_err();
        assert_eq!(error.kind(), io::ErrorKind::FileTooLarge);
        assert_eq!(error.to_string(), "it takes 100 bytes or more, and `ObjLimits::library_bytes` is 99");
        let error = open(&path, Limit { taken: 50, ..limit(120) }).unwrap_err();
        assert_eq!(
            error.to_string(),
            "it takes 100 bytes or more, 50 are taken, and `ObjLimits::library_bytes` is 120"
        );
        fs::remove_file(&path).unwrap();
        let mut endless = Bounded { inner: io::repeat(7), position: 0, limit: limit(5000) };
        assert_eq!(endless.read_to_end(&mut Vec::new()).unwrap_err().kind(), io::ErrorKind::FileTooLarge);
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn a_file_that_is_replaced_by_a_fifo_after_its_check_is_opened_without_waiting() {
        let path = std::env::temp_dir().join(format!("drawloom-fifo-{}", std::process::id()));
        assert!(std::process::Command::new("mkfifo").arg(&path).status().unwrap().success());
        let (sender, receiver) = std::sync::mpsc::channel();
        let opened = path.clone();
        std::thread::spawn(move || {
            // Nobody receives what comes after the deadline.
            let _ = sender.send(non_blocking().open(opened).and_then(|file| file.metadata()));
        });
        let metadata = receiver.recv_timeout(std::time::Duration::from_secs(60));
        fs::remove_file(&path).unwrap();
        let error = check(&metadata.unwrap().unwrap(), Limit::new("scene_bytes", 9)).unwrap_err();
        assert_eq!(error.to_string(), "it is not a regular file");
    }
}
