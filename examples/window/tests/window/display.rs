//! A virtual display with a window manager, a keyboard and a mouse.

use std::io::{BufRead, BufReader};
use std::process::{Child, Command, Stdio};

use libtest_mimic::Failed;
use x11rb::connection::Connection;
use x11rb::protocol::xproto::{
    ClientMessageEvent, ConfigureWindowAux, ConnectionExt, EventMask, ImageFormat, InputFocus, Window,
};
use x11rb::rust_connection::RustConnection;
use x11rb::wrapper::ConnectionExt as _;

/// A virtual display with a window manager. Both end when it is dropped.
pub struct Display {
    _server: Killed,
    _manager: Killed,
    /// As in the environment variable `DISPLAY`.
    pub name: String,
    connection: RustConnection,
    root: Window,
    pub scale_factor: &'static str,
}

/// What a window shows.
#[derive(Clone, PartialEq)]
pub struct Picture {
    pub size: [u32; 2],
    /// Red, green, blue.
    pub pixels: Vec<[u8; 3]>,
}

impl Picture {
    /// Whether it is more than a background.
    pub fn is_drawn(&self) -> bool {
        let mut colors = self.pixels.clone();
        colors.sort_unstable();
        colors.dedup();
        colors.len() > 100
    }

    /// The share of pixels that it has in common with another picture of its size.
    pub fn share_equal_to(&self, other: &Self) -> f64 {
        let equal = self.pixels.iter().zip(&other.pixels).filter(|(own, other)| own == other).count();
        equal as f64 / self.pixels.len() as f64
    }
}

impl Display {
    /// Width and height, in pixels.
    pub const SIZE: [u32; 2] = [1000, 700];

    const PROGRAMS: [&str; 3] = ["Xvfb", "xdotool", "openbox"];

    /// The programs that a display needs and that are not installed.
    pub fn missing_programs() -> Vec<&'static str> {
        let folders: Vec<_> = std::env::var_os("PATH").iter().flat_map(std::env::split_paths).collect();
        let is_missing = |program: &&str| !folders.iter().any(|folder| folder.join(program).is_file());
        Self::PROGRAMS.into_iter().filter(is_missing).collect()
    }

    pub fn new() -> Result<Self, Failed> {
        let [width, height] = Self::SIZE;
        let mut server = Command::new("Xvfb")
            .args(["-displayfd", "1", "-screen", "0", &format!("{width}x{height}x24")])
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .map(Killed)?;
        // The server writes its number when it is ready.
        let name = format!(":{}", server.first_line()?);
        let mut manager = Command::new("openbox")
            .args(["--startup", "echo ready"])
            .env("DISPLAY", &name)
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .map(Killed)?;
        manager.first_line()?;
        let (connection, screen) = x11rb::connect(Some(&name))?;
        let root = connection.setup().roots[screen].root;
        Ok(Self { _server: server, _manager: manager, name, connection, root, scale_factor: "1" })
    }

    pub fn with_scale_factor(self, scale_factor: &'static str) -> Self {
        Self { scale_factor, ..self }
    }

    /// Presses keys and buttons through the extension XTEST.
    pub fn xdotool(&self, arguments: &[&str]) -> Result<(), Failed> {
        let output = Command::new("xdotool").args(arguments).env("DISPLAY", &self.name).output()?;
        if output.status.success() {
            return Ok(());
        }
        Err(format!("xdotool {arguments:?}: {}", String::from_utf8_lossy(&output.stderr)).into())
    }

    /// The window whose title begins like this, if there is one.
    pub fn find(&self, title: &str) -> Result<Option<Window>, Failed> {
        for window in self.clients()? {
            if self.title(window)?.starts_with(title) {
                return Ok(Some(window));
            }
        }
        Ok(None)
    }

    /// The windows that the window manager knows.
    pub fn clients(&self) -> Result<Vec<Window>, Failed> {
        let property = self.atom("_NET_CLIENT_LIST")?;
        let reply = self.connection.get_property(false, self.root, property, 33_u32, 0, 1000)?.reply()?;
        Ok(reply.value32().map(Iterator::collect).unwrap_or_default())
    }

    pub fn title(&self, window: Window) -> Result<String, Failed> {
        let (property, kind) = (self.atom("_NET_WM_NAME")?, self.atom("UTF8_STRING")?);
        // A window that was closed has no title.
        let reply = self.connection.get_property(false, window, property, kind, 0, 1000)?.reply();
        Ok(reply.map(|reply| String::from_utf8_lossy(&reply.value).into_owned()).unwrap_or_default())
    }

    pub fn resize(&self, window: Window, [width, height]: [u32; 2]) -> Result<(), Failed> {
        self.connection.configure_window(window, &ConfigureWindowAux::new().width(width).height(height))?;
        Ok(self.connection.sync()?)
    }

    pub fn focus(&self, window: Window) -> Result<(), Failed> {
        self.xdotool(&["windowactivate", "--sync", &window.to_string()])
    }

    /// No window has the focus.
    pub fn take_focus_away(&self) -> Result<(), Failed> {
        self.connection.set_input_focus(InputFocus::NONE, x11rb::NONE, x11rb::CURRENT_TIME)?;
        Ok(self.connection.sync()?)
    }

    pub fn point_at(&self, window: Window, [x, y]: [u32; 2]) -> Result<(), Failed> {
        self.xdotool(&["mousemove", "--sync", "--window", &window.to_string(), &x.to_string(), &y.to_string()])
    }

    pub fn minimize(&self, window: Window) -> Result<(), Failed> {
        self.xdotool(&["windowminimize", "--sync", &window.to_string()])
    }

    pub fn restore(&self, window: Window) -> Result<(), Failed> {
        self.xdotool(&["windowactivate", "--sync", &window.to_string()])
    }

    /// Has the window manager close a window, as the button in its title does.
    pub fn close(&self, window: Window) -> Result<(), Failed> {
        let event = ClientMessageEvent::new(32, window, self.atom("_NET_CLOSE_WINDOW")?, [0; 5]);
        let mask = EventMask::SUBSTRUCTURE_NOTIFY | EventMask::SUBSTRUCTURE_REDIRECT;
        self.connection.send_event(false, self.root, mask, event)?;
        Ok(self.connection.sync()?)
    }

    /// What a window shows; `None` if it cannot be seen as a whole.
    pub fn picture(&self, window: Window) -> Result<Option<Picture>, Failed> {
        let Ok(geometry) = self.connection.get_geometry(window)?.reply() else { return Ok(None) };
        let (width, height) = (geometry.width, geometry.height);
        let image = self.connection.get_image(ImageFormat::Z_PIXMAP, window, 0, 0, width, height, u32::MAX)?;
        let Ok(image) = image.reply() else { return Ok(None) };
        let pixels = image.data.chunks_exact(4).map(|pixel| [pixel[2], pixel[1], pixel[0]]).collect();
        Ok(Some(Picture { size: [width.into(), height.into()], pixels }))
    }

    fn atom(&self, name: &str) -> Result<u32, Failed> {
        Ok(self.connection.intern_atom(false, name.as_bytes())?.reply()?.atom)
    }
}

/// A process that is killed when it is dropped.
pub struct Killed(pub Child);

impl Killed {
    /// Waits for the first line that it writes.
    fn first_line(&mut self) -> Result<String, Failed> {
        let mut line = String::new();
        BufReader::new(self.0.stdout.take().ok_or("it is piped")?).read_line(&mut line)?;
        Ok(line.trim().to_owned())
    }
}

impl Drop for Killed {
    fn drop(&mut self) {
        // It may have ended already.
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}
