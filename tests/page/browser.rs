//! A headless Chromium that opens pages.

use std::{
    env,
    fs::{self, File},
    path::{Path, PathBuf},
    process::{Command, Stdio},
    thread,
    time::{Duration, Instant},
};

use drawloom::{
    report::{SchedulerCosts, write_page},
    timeline::Log,
};
use libtest_mimic::Failed;

const NAMES: [&str; 4] = ["chromium", "chromium-browser", "google-chrome", "google-chrome-stable"];

/// How long a page may take on a busy machine.
const PATIENCE: Duration = Duration::from_secs(180);

pub struct Browser {
    program: PathBuf,
}

/// A page as it stood when everything on it had happened.
pub struct Shown {
    /// The opening tag of its body, which tells how it is.
    body: String,
    /// How many bytes the file has.
    pub length: u64,
}

const ATTEMPTS: usize = 4;

impl Browser {
    /// The one in `PATH`.
    pub fn find() -> Option<Self> {
        let path = env::var_os("PATH")?;
        let folders: Vec<_> = env::split_paths(&path).collect();
        let mut programs = NAMES.iter().flat_map(|name| folders.iter().map(move |folder| folder.join(name)));
        programs.find(|program| program.is_file()).map(|program| Self { program })
    }

    /// Opens the log's page, with a script of the test's added to it. It has to get ready, and to complain of nothing.
    ///
    /// The browser's clock runs ahead while nothing happens. On a machine that is short of time its budget may be spent before the
    /// compositor has drawn anything, so a page that was not ready is opened anew.
    pub fn open(&self, name: &str, log: &Log, script: &str) -> Result<Shown, Failed> {
        let mut body = String::new();
        for _ in 0..ATTEMPTS {
            let shown = self.look(name, log, script)?;
            if shown.value("ready") == "true" {
                return Ok(shown);
            }
            body = shown.body;
        }
        Err(format!("{name} never got ready: {body}").into())
    }

    fn look(&self, name: &str, log: &Log, script: &str) -> Result<Shown, Failed> {
        let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("page_{name}"));
        fs::create_dir_all(&folder)?;
        let [page, tree, messages] = ["page.html", "tree.html", "messages"].map(|file| folder.join(file));
        let mut html = Vec::new();
        write_page(log, &SchedulerCosts::ZERO, &mut html)?;
        let length = html.len() as u64;
        let html = String::from_utf8(html)?.replace("</body>", &format!("<script>{script}</script></body>"));
        fs::write(&page, html)?;

        let mut child = Command::new(&self.program)
            .args(["--headless", "--no-sandbox", "--disable-gpu", "--no-first-run", "--enable-logging=stderr", "--v=0"])
            .args(["--virtual-time-budget=5000", "--window-size=1280,800", "--dump-dom"])
            .arg(format!("--user-data-dir={}", folder.join("profile").display()))
            .arg(format!("file://{}", page.display()))
            .stdin(Stdio::null())
            .stdout(File::create(&tree)?)
            .stderr(File::create(&messages)?)
            .spawn()?;
        let start = Instant::now();
        let status = loop {
            match child.try_wait()? {
                Some(status) => break status,
                None if start.elapsed() > PATIENCE => {
                    child.kill()?;
                    return Err(format!("{name} was not shown within {PATIENCE:?}").into());
                }
                None => thread::sleep(Duration::from_millis(20)),
            }
        };

        let (tree, messages) = (fs::read(&tree)?, fs::read(&messages)?);
        let (tree, messages) = (String::from_utf8_lossy(&tree), String::from_utf8_lossy(&messages));
        let complaints: Vec<_> = messages.lines().filter(|line| line.contains("CONSOLE")).collect();
        if !complaints.is_empty() {
            return Err(complaints.join("\n").into());
        }
        let body = tree.split_once("<body").and_then(|(_, rest)| rest.split_once('>')).map(|(body, _)| body);
        let body = body.ok_or_else(|| format!("{status}: no page, but {messages}"))?.to_owned();
        fs::remove_dir_all(&folder)?;
        Ok(Shown { body, length })
    }
}

impl Shown {
    /// What the body's data attribute of that name is; empty if there is none.
    pub fn value(&self, name: &str) -> String {
        let start = format!(" data-{name}=\"");
        let found = self.body.split_once(&start).and_then(|(_, rest)| rest.split_once('"'));
        found.map_or_else(String::new, |(value, _)| value.to_owned())
    }
}
