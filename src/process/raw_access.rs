//! What raw passes ask for, checked against what their processes declare.

use std::cell::OnceCell;
use std::fmt::{self, Display, Formatter};

use parking_lot::Mutex;

use super::{AccessError, BufferLayout, Declaration, list_names};
use crate::scene::{ColumnLayout, MaterialLayout, ViewKind};

/// Something that a process declares, and that its raw pass asks for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum RawResource<'a> {
    Target(ViewKind, &'a str),
    Column(ColumnLayout),
    MaterialType(MaterialLayout),
    Buffer(BufferLayout),
}

impl<'a> RawResource<'a> {
    /// What a process declares, in the order of its [`RequestLog`].
    fn declared(declaration: &'a Declaration) -> impl Iterator<Item = Self> {
        let Declaration { views, accesses, columns, material_types, buffers, .. } = declaration;
        let targets = accesses.iter().map(|(name, access)| Self::Target(access.views(*views), name));
        let columns = columns.iter().map(|column| Self::Column(*column));
        let material_types = material_types.iter().map(|material_type| Self::MaterialType(*material_type));
        let buffers = buffers.iter().map(|(buffer, _)| Self::Buffer(*buffer));
        targets.chain(columns).chain(material_types).chain(buffers)
    }
}

impl Display for RawResource<'_> {
    fn fmt(&self, formatter: &mut Formatter<'_>) -> fmt::Result {
        match self {
            Self::Target(_, name) => write!(formatter, "target {name:?}"),
            Self::Column(column) => write!(formatter, "the column {:?}", column.name),
            Self::MaterialType(material_type) => write!(formatter, "the material type {:?}", material_type.name),
            Self::Buffer(buffer) => write!(formatter, "the buffer {:?}", buffer.name),
        }
    }
}

/// Checks what one pass asks for.
pub(crate) struct RawAccess<'a> {
    process: &'a str,
    declaration: &'a Declaration,
    requests: &'a RequestLog,
    first_error: OnceCell<AccessError>,
}

impl<'a> RawAccess<'a> {
    /// Begins the pass of a process that has declared this. What the pass asks for is noted in `requests`.
    pub(crate) fn new(process: &'a str, declaration: &'a Declaration, requests: &'a RequestLog) -> Self {
        requests.0.lock().is_encoded = true;
        Self { process, declaration, requests, first_error: OnceCell::new() }
    }

    /// Ends the pass.
    ///
    /// # Errors
    /// If it has asked for what it did not get: the first such error.
    pub(crate) fn end(self) -> Result<(), AccessError> {
        self.first_error.into_inner().map_or(Ok(()), Err)
    }

    /// # Errors
    /// If the process does not declare the target for its own views.
    pub(super) fn target<T>(&self, name: &str, found: impl FnOnce() -> Option<T>) -> Result<T, AccessError> {
        let declared = || self.declared_targets(self.declaration.views);
        let undeclared =
            |process| AccessError::UndeclaredTarget { process, target: name.to_owned(), declared: declared() };
        self.checked(RawResource::Target(self.declaration.views, name), found, undeclared)
    }

    /// # Errors
    /// If the process does not declare the target for views of this kind, or it is not layered.
    pub(super) fn layered_target<T>(
        &self,
        views: ViewKind,
        name: &str,
        found: impl FnOnce() -> Option<T>,
    ) -> Result<T, AccessError> {
        let undeclared = |process| {
            let declared = self.declared_targets(views);
            AccessError::UndeclaredLayeredTarget { process, views, target: name.to_owned(), declared }
        };
        let found = self.checked(RawResource::Target(views, name), || Some(found()), undeclared)?;
        let own = || AccessError::NotLayered { process: self.process.to_owned(), views, target: name.to_owned() };
        found.ok_or_else(|| self.noted(own()))
    }

    /// The names of the targets of views of a kind that the process declares.
    fn declared_targets(&self, views: ViewKind) -> String {
        let Declaration { views: own, accesses, .. } = self.declaration;
        let of_views = accesses.iter().filter(|(_, access)| access.views(*own) == views);
        list_names(of_views.map(|(name, _)| name.as_str()))
    }

    /// # Errors
    /// If the process does not declare the column.
    pub(super) fn column<T>(&self, layout: ColumnLayout, found: impl FnOnce() -> Option<T>) -> Result<T, AccessError> {
        let ColumnLayout { name: column, stride } = layout;
        let undeclared = |process| AccessError::UndeclaredColumn { process, column, stride };
        self.checked(RawResource::Column(layout), found, undeclared)
    }

    /// # Errors
    /// If the process does not declare the material type.
    pub(super) fn material_type<T>(
        &self,
        layout: MaterialLayout,
        found: impl FnOnce() -> Option<T>,
    ) -> Result<T, AccessError> {
        let MaterialLayout { name: material_type, stride } = layout;
        let undeclared = |process| AccessError::UndeclaredMaterialType { process, material_type, stride };
        self.checked(RawResource::MaterialType(layout), found, undeclared)
    }

    /// # Errors
    /// If the process does not declare the buffer.
    pub(super) fn buffer<T>(&self, layout: BufferLayout, found: impl FnOnce() -> Option<T>) -> Result<T, AccessError> {
        let BufferLayout { name: buffer, bytes, .. } = layout;
        let undeclared = |process| AccessError::UndeclaredBuffer { process, buffer, bytes };
        self.checked(RawResource::Buffer(layout), found, undeclared)
    }

    /// # Errors
    /// If the process does not declare the resource, or it is not found.
    fn checked<T>(
        &self,
        wanted: RawResource<'_>,
        found: impl FnOnce() -> Option<T>,
        undeclared: impl FnOnce(String) -> AccessError,
    ) -> Result<T, AccessError> {
        if !self.requests.note(self.declaration, wanted) {
            return Err(self.noted(undeclared(self.process.to_owned())));
        }
        let missing = || AccessError::Missing { process: self.process.to_owned(), resource: wanted.to_string() };
        found().ok_or_else(|| self.noted(missing()))
    }

    /// Notes an error, if it is the first.
    fn noted(&self, error: AccessError) -> AccessError {
        self.first_error.get_or_init(|| error.clone());
        error
    }
}

/// Which of the resources that a process declares its raw pass has asked for, in any view.
#[derive(Debug)]
pub(crate) struct RequestLog(Mutex<Requests>);

#[derive(Debug)]
struct Requests {
    /// For each declared resource whether it was ever requested.
    requested: Vec<bool>,
    /// Whether a pass began since the latest frame ended.
    is_encoded: bool,
    /// The number of frames with a raw pass of the process.
    frames: u32,
}

impl RequestLog {
    /// A raw pass may use a resource only in some frames. One that it leaves alone in its first 60 is taken for one
    /// that it never uses.
    pub(crate) const OBSERVED_FRAMES: u32 = 60;

    /// The log of a process that has declared this.
    pub(crate) fn new(declaration: &Declaration) -> Self {
        let requested = RawResource::declared(declaration).map(|_| false).collect();
        Self(Mutex::new(Requests { requested, is_encoded: false, frames: 0 }))
    }

    /// Ends a frame. In the last of those that are observed, lists what is declared, and whether the raw pass has ever
    /// asked for it; nothing in other frames.
    pub(crate) fn end_frame(&self, declaration: &Declaration) -> Vec<(String, bool)> {
        let Requests { requested, is_encoded, frames } = &mut *self.0.lock();
        if !std::mem::take(is_encoded) {
            return Vec::new();
        }
        *frames = frames.saturating_add(1);
        if *frames != Self::OBSERVED_FRAMES {
            return Vec::new();
        }
        let declared = RawResource::declared(declaration).zip(requested);
        declared.map(|(resource, requested)| (resource.to_string(), *requested)).collect()
    }

    /// Notes that a resource is requested. Returns whether it is declared.
    fn note(&self, declaration: &Declaration, wanted: RawResource<'_>) -> bool {
        let mut requests = self.0.lock();
        let mut is_declared = false;
        // One target may be declared twice: as what the process reads, and as what it changes.
        for (declared, requested) in RawResource::declared(declaration).zip(&mut requests.requested) {
            if declared == wanted {
                (is_declared, *requested) = (true, true);
            }
        }
        is_declared
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::process::{Declare, Format};

    #[test]
    fn a_log_lists_what_is_declared_in_the_last_observed_frame_only() {
        let mut declare = Declare::default();
        declare.writes("used", Format::Rgba8Unorm);
        declare.changes("unused");
        let declaration = declare.finish();
        let log = RequestLog::new(&declaration);
        for frame in 1..=2 * RequestLog::OBSERVED_FRAMES {
            // Two views are one frame, and frames without a pass do not count.
            for _ in 0..2 {
                let access = RawAccess::new("process", &declaration, &log);
                assert_eq!(access.target("used", || Some(1)), Ok(1));
                assert_eq!(access.end(), Ok(()));
            }
            let listed = log.end_frame(&declaration);
            if frame == RequestLog::OBSERVED_FRAMES {
                let expected = [("target \"used\"", true), ("target \"unused\"", false)];
                assert_eq!(listed, expected.map(|(resource, requested)| (resource.to_owned(), requested)));
            } else {
                assert_eq!(listed, []);
            }
            assert_eq!(log.end_frame(&declaration), []);
        }
    }
}
