//! Elements of a file: objects of its JSON, and how messages call them.

use std::fmt::{self, Display};

use crate::error::{Problem, excerpt};
use crate::files::is_data;
use crate::json::Json;

/// A kind of element. Each has an array in the file, and elements refer to others by their index in it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
    Accessor,
    Animation,
    Buffer,
    BufferView,
    Camera,
    Image,
    Light,
    Material,
    Mesh,
    Node,
    Sampler,
    Scene,
    Skin,
    Texture,
}

impl Kind {
    /// The name of its array, and what messages call one and many of it.
    pub(crate) fn names(self) -> [&'static str; 3] {
        match self {
            Self::Accessor => ["accessors", "accessor", "accessors"],
            Self::Animation => ["animations", "animation", "animations"],
            Self::Buffer => ["buffers", "buffer", "buffers"],
            Self::BufferView => ["bufferViews", "buffer view", "buffer views"],
            Self::Camera => ["cameras", "camera", "cameras"],
            Self::Image => ["images", "image", "images"],
            Self::Light => ["lights", "light", "lights"],
            Self::Material => ["materials", "material", "materials"],
            Self::Mesh => ["meshes", "mesh", "meshes"],
            Self::Node => ["nodes", "node", "nodes"],
            Self::Sampler => ["samplers", "sampler", "samplers"],
            Self::Scene => ["scenes", "scene", "scenes"],
            Self::Skin => ["skins", "skin", "skins"],
            Self::Texture => ["textures", "texture", "textures"],
        }
    }
}

/// An element, or a part of one, such as `mesh 3 (wheel) primitive 0`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Element<'a> {
    pub(crate) json: &'a Json,
    pub(crate) kind: Kind,
    pub(crate) index: usize,
    name: Option<&'a str>,
    /// What part it is, and its number.
    part: Option<(&'static str, usize)>,
}

impl<'a> Element<'a> {
    pub(crate) fn new(json: &'a Json, kind: Kind, index: usize) -> Self {
        let text = |member| json.get(member).and_then(Json::as_text).filter(|text| !text.is_empty());
        // Images seldom have names. Those inside the file have no URI that tells which they are.
        let uri = || text("uri").filter(|uri| kind == Kind::Image && !is_data(uri));
        let name = text("name").or_else(uri);
        Self { json, kind, index, name, part: None }
    }

    /// A part of it.
    pub(crate) fn part(&self, json: &'a Json, part: &'static str, number: usize) -> Self {
        Self { json, part: Some((part, number)), ..*self }
    }

    /// An object in it, which messages call as this element.
    pub(crate) fn inner(&self, json: &'a Json) -> Self {
        Self { json, ..*self }
    }

    /// The value of an extension.
    pub(crate) fn extension(&self, name: &str) -> Option<Self> {
        self.json.get("extensions").and_then(|all| all.get(name)).map(|json| self.inner(json))
    }

    /// An object, if there is one of that name.
    pub(crate) fn object(&self, member: &str) -> Result<Option<Self>, Problem> {
        self.read(member, "an object", |json| matches!(json, Json::Object(_)).then_some(self.inner(json)))
    }

    /// An index, a count or an offset.
    pub(crate) fn index(&self, member: &str) -> Result<Option<usize>, Problem> {
        self.read(member, "a whole number from 0 on", Json::as_index)
    }

    /// The same, but it has to be there.
    pub(crate) fn needed_index(&self, member: &str) -> Result<usize, Problem> {
        self.index(member)?.ok_or_else(|| self.lacks(member))
    }

    /// A number, as f32 has it.
    pub(crate) fn number(&self, member: &str) -> Result<Option<f32>, Problem> {
        self.read(member, "a number", |json| json.as_number().map(|number| number as f32).filter(|it| it.is_finite()))
    }

    pub(crate) fn flag(&self, member: &str) -> Result<Option<bool>, Problem> {
        self.read(member, "true or false", |json| if let Json::Flag(flag) = *json { Some(flag) } else { None })
    }

    pub(crate) fn text(&self, member: &str) -> Result<Option<&'a str>, Problem> {
        self.read(member, "a string", Json::as_text)
    }

    /// A list of as many numbers as `N` says.
    pub(crate) fn numbers<const N: usize>(&self, member: &str) -> Result<Option<[f64; N]>, Problem> {
        let list = |json: &'a Json| {
            let list = json.as_list().filter(|list| list.len() == N)?;
            let mut numbers = [0.0; N];
            for (number, json) in numbers.iter_mut().zip(list) {
                *number = json.as_number()?;
            }
            Some(numbers)
        };
        self.read(
            member,
            const { ["", "", "2 numbers", "3 numbers", "4 numbers", "16 numbers"][if N < 5 { N } else { 5 }] },
            list,
        )
    }

    /// The values of a list; none if it is not there.
    pub(crate) fn list(&self, member: &str) -> Result<&'a [Json], Problem> {
        Ok(self.read(member, "a list", Json::as_list)?.unwrap_or_default())
    }

    /// For a member that has to be there and is not.
    pub(crate) fn lacks(&self, member: &str) -> Problem {
        Problem::invalid(self, format!("has no `{member}`"))
    }

    fn read<T>(
        &self,
        member: &str,
        expected: &str,
        convert: impl FnOnce(&'a Json) -> Option<T>,
    ) -> Result<Option<T>, Problem> {
        match self.json.get(member) {
            None => Ok(None),
            Some(json) => match convert(json) {
                Some(value) => Ok(Some(value)),
                None => Err(Problem::invalid(self, format!("has a `{member}` that is not {expected}"))),
            },
        }
    }
}

impl Display for Element<'_> {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "{} {}", self.kind.names()[1], self.index)?;
        if let Some(name) = self.name {
            write!(formatter, " ({})", excerpt(name))?;
        }
        if let Some((part, number)) = self.part {
            write!(formatter, " {part} {number}")?;
        }
        Ok(())
    }
}
