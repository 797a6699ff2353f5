//! A headless Chromium that opens pages.

use std::fs::{self, File};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};
use std::{env, thread};

use drawloom_jobs::report::{SchedulerCosts, write_page};
use drawloom_jobs::timeline::Log;
use libtest_mimic::Failed;

const NAMES: [&str; 4] = ["chromium", "chromium-browser", "google-chrome", "google-chrome-stable"];

/// The maximum time to load a page on a busy machine.
const TIMEOUT: Duration = Duration::from_secs(180);

pub struct Browser {
    program: PathBuf,
}

/// A page after all its scripts have run.
pub struct LoadedPage {
    /// The opening tag of its body. Its data attributes describe the page's state.
    body: String,
    /// The size of the file in bytes.
    pub length: u64,
}

/// The maximum number of attempts to load a page until it is ready.
const ATTEMPTS: u32 = 6;

impl Browser {
    /// The browser in `PATH`.
    pub fn find() -> Option<Self> {
        let path = env::var_os("PATH")?;
        let folders: Vec<_> = env::split_paths(&path).collect();
        let mut programs = NAMES.iter().flat_map(|name| folders.iter().map(move |folder| folder.join(name)));
        programs.find(|program| program.is_file()).map(|program| Self { program })
    }

    /// Opens the log's page. The page has to become ready without writing to the console.
    pub fn open(&self, name: &str, log: &Log) -> Result<LoadedPage, Failed> {
        self.load_until(name, log, "", |page| page.value("ready") == "true")
    }

    /// Opens the log's page with a script added to it, which writes the body's data attribute `outcome` when it is
    /// done.
    pub fn open_with(&self, name: &str, log: &Log, script: &str) -> Result<LoadedPage, Failed> {
        self.load_until(name, log, script, |page| !page.value("outcome").is_empty())
    }

    /// The browser runs on virtual time, which advances while nothing happens: its budget may be spent before the
    /// compositor has drawn anything. So the browser is told to finish each drawing first, and a page that is not ready
    /// is loaded again, with twice the budget.
    fn load_until(
        &self,
        name: &str,
        log: &Log,
        script: &str,
        is_ready: impl Fn(&LoadedPage) -> bool,
    ) -> Result<LoadedPage, Failed> {
        let mut body = String::new();
        for attempt in 0..ATTEMPTS {
            let page = self.load(name, log, script, Duration::from_secs(5) * 2_u32.pow(attempt))?;
            if is_ready(&page) {
                return Ok(page);
            }
            body = page.body;
        }
        Err(format!("{name} did not become ready: {body}").into())
    }

    fn load(&self, name: &str, log: &Log, script: &str, virtual_time: Duration) -> Result<LoadedPage, Failed> {
        let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("page_{name}"));
        fs::create_dir_all(&folder)?;
        let [page, dom, console] = ["page.html", "dom.html", "console"].map(|file| folder.join(file));
        let mut html = Vec::new();
        write_page(log, &SchedulerCosts::ZERO, &mut html)?;
        let length = html.len() as u64;
        let html = String::from_utf8(html)?.replace("</body>", &format!("<script>{script}</script></body>"));
        fs::write(&page, html)?;

        let mut child = Command::new(&self.program)
            .args(["--headless", "--no-sandbox", "--disable-gpu", "--no-first-run", "--enable-logging=stderr", "--v=0"])
            .args(["--window-size=1280,800", "--run-all-compositor-stages-before-draw", "--dump-dom"])
            .arg(format!("--virtual-time-budget={}", virtual_time.as_millis()))
            .arg(format!("--user-data-dir={}", folder.join("profile").display()))
            .arg(format!("file://{}", page.display()))
            .stdin(Stdio::null())
            .stdout(File::create(&dom)?)
            .stderr(File::create(&console)?)
            .spawn()?;
        let start = Instant::now();
        let status = loop {
            match child.try_wait()? {
                Some(status) => break status,
                None if start.elapsed() > TIMEOUT => {
                    child.kill()?;
                    return Err(format!("{name} did not load within {TIMEOUT:?}").into());
                }
                None => thread::sleep(Duration::from_millis(20)),
            }
        };

        let (dom, console) = (fs::read(&dom)?, fs::read(&console)?);
        let (dom, console) = (String::from_utf8_lossy(&dom), String::from_utf8_lossy(&console));
        let messages: Vec<_> = console.lines().filter(|line| line.contains("CONSOLE")).collect();
        if !messages.is_empty() {
            return Err(messages.join("\n").into());
        }
        let body = dom.split_once("<body").and_then(|(_, rest)| rest.split_once('>')).map(|(body, _)| body);
        let body = body.ok_or_else(|| format!("{status}: there is no body, but {console}"))?.to_owned();
        fs::remove_dir_all(&folder)?;
        Ok(LoadedPage { body, length })
    }
}

impl LoadedPage {
    /// The value of the body's data attribute of this name, or an empty string.
    pub fn value(&self, name: &str) -> String {
        let start = format!(" data-{name}=\"");
        let found = self.body.split_once(&start).and_then(|(_, rest)| rest.split_once('"'));
        found.map_or_else(String::new, |(value, _)| value.to_owned())
    }
}
