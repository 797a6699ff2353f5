//! Files that are replaced, refused, or written straight.

use std::error::Error;
use std::fs;
use std::io::{self, Write};
use std::path::Path;
use std::process::Command;

use drawloom_output::{OutputError, OutputFile, PictureFile, create_folder};
use tempfile::TempDir;

type Outcome = Result<(), Box<dyn Error>>;

/// The names of the files of a folder, sorted.
fn names(folder: &TempDir) -> io::Result<Vec<String>> {
    let entries = fs::read_dir(folder.path())?.map(|entry| Ok(entry?.file_name().to_string_lossy().into_owned()));
    let mut names = entries.collect::<io::Result<Vec<_>>>()?;
    names.sort();
    Ok(names)
}

#[test]
fn a_file_is_written_and_replaced() -> Outcome {
    let folder = TempDir::new()?;
    let file = OutputFile::new(folder.path().join("a.json"))?;
    assert!(names(&folder)?.is_empty(), "the check leaves a file");
    for content in ["first, and longer", "second"] {
        file.write(|file| write!(file, "{content}"))?;
        assert_eq!(fs::read_to_string(file.path())?, content);
    }
    assert_eq!(names(&folder)?, ["a.json"]);
    Ok(())
}

#[test]
fn a_failure_leaves_the_old_file_and_nothing_else() -> Outcome {
    let folder = TempDir::new()?;
    let file = OutputFile::new(folder.path().join("a.json"))?;
    let fail = |file: &OutputFile| {
        file.write(|writer| {
            writer.write_all(&[b'x'; 100_000])?;
            Err(io::ErrorKind::StorageFull.into())
        })
    };
    assert!(matches!(fail(&file), Err(OutputError::Failed { .. })));
    assert!(names(&folder)?.is_empty());
    file.write_all("old")?;
    let error = fail(&file).unwrap_err().to_string();
    assert!(error.contains("a.json") && error.contains("could not be written"), "{error}");
    assert_eq!(fs::read_to_string(file.path())?, "old");
    assert_eq!(names(&folder)?, ["a.json"]);
    Ok(())
}

/// Set in a program that this test starts, which ends in the middle of writing this file.
const INTERRUPTED: &str = "DRAWLOOM_OUTPUT_INTERRUPTED";

#[test]
fn an_interrupt_leaves_the_old_file() -> Outcome {
    if let Some(path) = std::env::var_os(INTERRUPTED) {
        OutputFile::new(path)?.write(|file| {
            file.write_all(&[b'x'; 100_000])?;
            file.flush()?;
            std::process::abort()
        })?;
    }
    let folder = TempDir::new()?;
    let file = OutputFile::new(folder.path().join("a.json"))?;
    file.write_all("old")?;
    let program = Command::new(std::env::current_exe()?)
        .args(["--exact", "an_interrupt_leaves_the_old_file"])
        .env(INTERRUPTED, file.path())
        .output()?;
    assert!(!program.status.success());
    assert_eq!(fs::read_to_string(file.path())?, "old");
    let names = names(&folder)?;
    let [part, kept] = &names[..] else { panic!("it ended before it wrote: {names:?}") };
    assert!(part.starts_with(".drawloom-") && part.ends_with(".part") && kept == "a.json", "{names:?}");
    Ok(())
}

#[test]
fn what_cannot_be_written_is_refused_by_name() -> Outcome {
    let folder = TempDir::new()?;
    fs::write(folder.path().join("file"), "")?;
    let refuse = |path: &Path| OutputFile::new(path).unwrap_err();
    let error = refuse(&folder.path().join("missing/a.json"));
    assert!(matches!(error, OutputError::NoFolder { .. }), "{error}");
    assert!(error.to_string().contains("missing/a.json"), "{error}");
    let error = refuse(&folder.path().join("file/a.json"));
    assert!(matches!(error, OutputError::NoFolder { .. }), "{error}");
    let error = refuse(folder.path());
    assert!(matches!(error, OutputError::IsFolder { .. }), "{error}");
    let error = refuse(Path::new(""));
    assert!(matches!(error, OutputError::IsFolder { .. }), "{error}");
    for spelled_as_folder in ["report/", "report/.", "report/./", "report/.."] {
        let error = refuse(&folder.path().join(spelled_as_folder));
        assert!(matches!(error, OutputError::IsFolder { .. }), "{error}");
    }
    OutputFile::new(folder.path().join("./report."))?;
    let error = refuse(&folder.path().join("a".repeat(300)));
    assert!(matches!(error, OutputError::Failed { .. }), "{error}");
    let error = create_folder(&folder.path().join("file/folder")).unwrap_err();
    assert!(error.to_string().contains("file/folder"), "{error}");
    create_folder(&folder.path().join("new/folder"))?;
    OutputFile::new(folder.path().join("new/folder/a.json"))?;
    Ok(())
}

#[test]
fn a_picture_has_the_format_of_its_extension() -> Outcome {
    let folder = TempDir::new()?;
    // Two of the blocks that JPEG divides a picture into, one above the other. Each has one colour.
    const BLOCK: u32 = 16;
    let [width, height] = [BLOCK, 2 * BLOCK];
    let colors = [[200_u8, 10, 20, 255], [10, 200, 20, 255]];
    let rgba: Vec<u8> = colors.iter().flat_map(|color| color.repeat((BLOCK * BLOCK) as usize)).collect();
    for name in ["a.png", "a.PNG", "a.jpg", "a.jpeg", "a.tga", "a.bmp"] {
        let picture = PictureFile::new(folder.path().join(name))?;
        picture.write([width, height], &rgba)?;
        assert_eq!(image::open(picture.path())?.color().has_alpha(), !name.contains(".jp"), "{name}");
        picture.write_opaque([width, height], &rgba)?;
        assert!(!image::open(picture.path())?.color().has_alpha(), "{name}");
        let read = image::open(picture.path()).map_err(|error| format!("{name}: {error}"))?.to_rgb8();
        assert_eq!(read.dimensions(), (width, height), "{name}");
        // JPEG converts colours to brightness and two differences of colour, in whole numbers, and stores the mean of a
        // block in steps of 1 (at a quality of 75): half a step each time, so 1.06 of 255 in each of the three, and
        // times 1 + 1.77 at most in a colour.
        let tolerance = if name.contains(".jp") { 3 } else { 0 };
        for (x, y, pixel) in read.enumerate_pixels() {
            let expected = &colors[(y / BLOCK) as usize][..3];
            let is_near = pixel.0.iter().zip(expected).all(|(one, other)| one.abs_diff(*other) <= tolerance);
            assert!(is_near, "{name}: {pixel:?} at {x}, {y}");
        }
        let error = picture.write([width, height + 1], &rgba).unwrap_err().to_string();
        assert!(error.contains(name), "{error}");
        assert_eq!(image::open(picture.path())?.height(), height);
    }
    Ok(())
}

#[test]
fn other_formats_are_refused_by_name() -> Outcome {
    let folder = TempDir::new()?;
    for (name, part) in [("a.gif", "ends in .gif"), ("a.json", "ends in .json"), ("a", "no extension")] {
        let error = PictureFile::new(folder.path().join(name)).unwrap_err();
        assert!(matches!(error, OutputError::PictureFormat { .. }), "{error}");
        assert!(error.to_string().contains(part), "{error}");
    }
    Ok(())
}

#[cfg(unix)]
mod unix {
    use std::fs::Permissions;
    use std::os::unix::fs::{FileTypeExt, PermissionsExt, symlink};
    use std::thread;

    use super::*;

    fn mode(path: &Path) -> io::Result<u32> {
        Ok(fs::metadata(path)?.permissions().mode() & 0o777)
    }

    #[test]
    fn permissions_are_those_of_new_files_or_stay() -> Outcome {
        let folder = TempDir::new()?;
        let other = folder.path().join("other");
        fs::write(&other, "")?;
        let file = OutputFile::new(folder.path().join("a.json"))?;
        file.write_all("new")?;
        assert_eq!(mode(file.path())?, mode(&other)?);
        fs::set_permissions(file.path(), Permissions::from_mode(0o640))?;
        file.write_all("replaced")?;
        assert_eq!(mode(file.path())?, 0o640);
        Ok(())
    }

    #[test]
    fn a_link_stays_and_its_target_is_replaced() -> Outcome {
        let (folder, elsewhere) = (TempDir::new()?, TempDir::new()?);
        let target = elsewhere.path().join("target.json");
        let link = folder.path().join("a.json");
        symlink(&target, folder.path().join("second"))?;
        symlink("second", &link)?;
        // The target is created first, and then replaced.
        for content in ["first", "second"] {
            OutputFile::new(&link)?.write_all(content)?;
            assert!(fs::symlink_metadata(&link)?.is_symlink());
            assert_eq!(fs::read_to_string(&target)?, content);
        }
        assert_eq!(names(&elsewhere)?, ["target.json"]);
        let round = folder.path().join("round");
        symlink("round", &round)?;
        assert!(matches!(OutputFile::new(round), Err(OutputError::Failed { .. })));
        Ok(())
    }

    #[test]
    fn a_pipe_is_written_straight() -> Outcome {
        let folder = TempDir::new()?;
        let pipe = folder.path().join("pipe.png");
        assert!(Command::new("mkfifo").arg(&pipe).status()?.success());
        let reader = thread::spawn({
            let pipe = pipe.clone();
            move || fs::read(pipe)
        });
        PictureFile::new(&pipe)?.write([1, 1], &[1, 2, 3, 255])?;
        let read = reader.join().expect("reading does not panic")?;
        assert!(fs::symlink_metadata(&pipe)?.file_type().is_fifo(), "the pipe was replaced");
        assert_eq!(image::load_from_memory(&read)?.to_rgba8().get_pixel(0, 0).0, [1, 2, 3, 255]);
        Ok(())
    }
}

#[cfg(target_os = "linux")]
mod linux {
    use std::fs::Permissions;
    use std::os::unix::fs::{MetadataExt, PermissionsExt, symlink};
    use std::os::unix::process::CommandExt;
    use std::process::Stdio;

    use super::*;

    #[test]
    fn a_full_disk_is_an_error() -> Outcome {
        let folder = TempDir::new()?;
        let full = folder.path().join("full.png");
        symlink("/dev/full", &full)?;
        let error = PictureFile::new(&full)?.write([1, 1], &[0; 4]).unwrap_err();
        assert!(matches!(&error, OutputError::Failed { source, .. } if source.kind() == io::ErrorKind::StorageFull));
        assert!(error.to_string().contains("full.png"), "{error}");
        assert!(fs::symlink_metadata(&full)?.is_symlink());
        Ok(())
    }

    #[test]
    fn a_folder_that_takes_no_files_is_refused() {
        let error = OutputFile::new("/sys/kernel/a.json").unwrap_err();
        assert!(matches!(error, OutputError::Failed { .. }), "{error}");
        assert!(error.to_string().contains("/sys/kernel"), "{error}");
    }

    #[test]
    fn standard_streams_are_written_straight() -> Outcome {
        if let Some(name) = std::env::var_os(INTERRUPTED) {
            let file = OutputFile::new(Path::new(&name))?;
            if name.to_str().is_some_and(|name| name.ends_with("err") || name.ends_with('2')) {
                eprintln!("before");
                file.write_all("content\n")?;
                eprintln!("behind");
            } else {
                println!("before");
                file.write_all("content\n")?;
                println!("behind");
            }
            return Ok(());
        }
        let folder = TempDir::new()?;
        let redirected = folder.path().join("log.txt");
        let outputs = ["/dev/stdout", "/dev/fd/1", "/proc/self/fd/1"].map(|name| (name, false));
        let errors = ["/dev/stderr", "/dev/fd/2", "/proc/self/fd/2"].map(|name| (name, true));
        // As a shell does for `>` and for `>>`.
        for appends in [false, true] {
            for (name, is_error) in outputs.into_iter().chain(errors) {
                let log = fs::OpenOptions::new().create(true).write(true).append(appends).open(&redirected)?;
                log.set_len(0)?;
                let mut command = Command::new(std::env::current_exe()?);
                command.args(["--exact", "linux::standard_streams_are_written_straight", "--nocapture"]);
                let command = command.env(INTERRUPTED, name);
                let command = if is_error { command.stderr(log).stdout(Stdio::null()) } else { command.stdout(log) };
                let status = command.status()?;
                let text = fs::read_to_string(&redirected)?;
                assert!(status.success() && text.contains("before\ncontent\nbehind\n"), "{name}, {appends}: {text}");
                assert_eq!(names(&folder)?, ["log.txt"]);
            }
        }
        Ok(())
    }

    #[test]
    fn a_file_that_a_shell_opened_is_written_straight() -> Outcome {
        if let Some(name) = std::env::var_os(INTERRUPTED) {
            return Ok(OutputFile::new(Path::new(&name))?.write_all("content\n")?);
        }
        let folder = TempDir::new()?;
        let redirected = folder.path().join("log.txt");
        for redirection in ["3>", "3>>"] {
            for name in ["/dev/fd/3", "/proc/self/fd/3"] {
                fs::write(&redirected, "")?;
                let script =
                    format!("exec {redirection}log.txt; echo before >&3; \"$@\" >/dev/null && echo behind >>log.txt");
                let status = Command::new("sh")
                    .args(["-c".as_ref(), script.as_ref(), "sh".as_ref(), std::env::current_exe()?.as_os_str()])
                    .args(["--exact", "linux::a_file_that_a_shell_opened_is_written_straight"])
                    .env(INTERRUPTED, name)
                    .current_dir(folder.path())
                    .status()?;
                assert!(status.success());
                assert_eq!(fs::read_to_string(&redirected)?, "before\ncontent\nbehind\n", "{redirection} {name}");
                assert_eq!(names(&folder)?, ["log.txt"]);
            }
        }
        Ok(())
    }

    #[test]
    fn a_pipe_that_may_not_be_written_is_refused() -> Outcome {
        if let Some(pipe) = std::env::var_os(INTERRUPTED) {
            assert!(matches!(OutputFile::new(Path::new(&pipe)), Err(OutputError::Failed { .. })));
            return Ok(());
        }
        let folder = TempDir::new()?;
        let pipe = folder.path().join("pipe");
        assert!(Command::new("mkfifo").args(["--mode=444".as_ref(), pipe.as_os_str()]).status()?.success());
        fs::set_permissions(folder.path(), Permissions::from_mode(0o755))?;
        // The other user need not be allowed to reach the program by its name.
        let mut command = Command::new("/proc/self/exe");
        command.args(["--exact", "linux::a_pipe_that_may_not_be_written_is_refused"]).env(INTERRUPTED, &pipe);
        // Root may write everything.
        if fs::metadata(folder.path())?.uid() == 0 {
            command.uid(65534);
        }
        let output = command.output()?;
        let text = String::from_utf8_lossy(&output.stdout);
        assert!(output.status.success() && text.contains("1 passed"), "{text}");
        Ok(())
    }
}
