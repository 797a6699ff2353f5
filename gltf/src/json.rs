//! JSON as a compact tree: 24 bytes for a number, and 40 for a member of an object.

use std::cell::Cell;
use std::fmt;

use serde_json::de::{Deserializer, SliceRead};
use serde_json::error::Category;

use crate::error::Problem;
use crate::limits::Limit;

/// A value. The members of an object are sorted by their names.
#[derive(Clone, Debug)]
pub(crate) enum Json {
    Null,
    Flag(bool),
    Number(f64),
    Text(Box<str>),
    List(Box<[Json]>),
    Object(Box<[(Box<str>, Json)]>),
}

impl Json {
    /// Parses JSON in UTF-8. Members named `extras`, which are an application's own, and what is deeper than any
    /// element of glTF are skipped.
    ///
    /// # Errors
    /// If it is not JSON, or has more values than `limit` allows.
    pub(crate) fn parse(text: &[u8], limit: &Limit) -> Result<Self, Problem> {
        let over = Cell::new(None);
        let mut parser = Deserializer::new(SliceRead::new(text));
        let seed = Tree { limit, over: &over, depth: 0 };
        let parsed = serde::de::DeserializeSeed::deserialize(seed, &mut parser).and_then(|tree| {
            parser.end()?;
            Ok(tree)
        });
        parsed.map_err(|error| {
            let is_cut_off = error.classify() == Category::Eof;
            let reason = if is_cut_off { format!("its JSON is cut off: {error}") } else { error.to_string() };
            over.take().unwrap_or(Problem::Malformed { reason })
        })
    }

    /// Replaces each escape of half a surrogate pair, which JSON allows and UTF-8 cannot have, by that of U+FFFD.
    pub(crate) fn replace_lone_surrogates(text: &mut [u8]) {
        let mut rest = text;
        // JSON has backslashes in strings only.
        while let Some(at) = rest.iter().position(|&byte| byte == b'\\') {
            let escape = &mut rest[at..];
            let length = match [escaped_unit(escape), escape.get(6..).and_then(escaped_unit)] {
                [Some(0xd800..=0xdbff), Some(0xdc00..=0xdfff)] => 12,
                [Some(0xd800..=0xdfff), _] => {
                    escape[2..6].copy_from_slice(b"fffd");
                    6
                }
                [Some(_), _] => 6,
                [None, _] => 2,
            };
            let length = length.min(escape.len());
            rest = &mut escape[length..];
        }
    }

    /// A member of an object; `None` if it is not there or `null`, or if this is no object.
    pub(crate) fn get(&self, name: &str) -> Option<&Self> {
        let Self::Object(members) = self else { return None };
        let found = members.binary_search_by(|(of_member, _)| (**of_member).cmp(name)).ok()?;
        Some(&members[found].1).filter(|value| !matches!(value, Self::Null))
    }

    /// The members of an object; none of other values.
    pub(crate) fn members(&self) -> &[(Box<str>, Self)] {
        if let Self::Object(members) = self { members } else { &[] }
    }

    /// A whole number from 0 on, also if it is written as `5.0` or `5e0`.
    pub(crate) fn as_index(&self) -> Option<usize> {
        match *self {
            // Greater ones are not exact, and no file has so many elements or bytes.
            Self::Number(number) if number.fract() == 0.0 && (0.0..=9e15).contains(&number) => Some(number as usize),
            _ => None,
        }
    }

    pub(crate) fn as_number(&self) -> Option<f64> {
        if let Self::Number(number) = *self { Some(number) } else { None }
    }

    pub(crate) fn as_text(&self) -> Option<&str> {
        if let Self::Text(text) = self { Some(text) } else { None }
    }

    pub(crate) fn as_list(&self) -> Option<&[Self]> {
        if let Self::List(values) = self { Some(values) } else { None }
    }
}

/// The unit of UTF-16 of an escape such as `\u00e9`, if a text begins with one.
fn escaped_unit(text: &[u8]) -> Option<u16> {
    let digits = text.strip_prefix(b"\\u")?.get(..4)?;
    digits.iter().try_fold(0, |unit, &digit| Some(unit << 4 | char::from(digit).to_digit(16)? as u16))
}

/// Builds trees, and counts their values.
#[derive(Clone, Copy)]
struct Tree<'a> {
    limit: &'a Limit,
    /// The problem, if there are too many: errors of the parser are text.
    over: &'a Cell<Option<Problem>>,
    /// How many lists and objects it is in.
    depth: usize,
}

/// How deep values are kept. The parser recurses into those, and skips others without recursion.
const MAX_DEPTH: usize = 64;

impl Tree<'_> {
    /// For the values of a list or an object.
    fn inside(self) -> Self {
        Self { depth: self.depth + 1, ..self }
    }
}

impl<'de> serde::de::DeserializeSeed<'de> for Tree<'_> {
    type Value = Json;

    fn deserialize<D: serde::Deserializer<'de>>(self, parser: D) -> Result<Json, D::Error> {
        if let Err(problem) = self.limit.take("its JSON", 1, 1) {
            self.over.set(Some(problem));
            return Err(serde::de::Error::custom("there are too many values"));
        }
        if self.depth > MAX_DEPTH {
            parser.deserialize_ignored_any(serde::de::IgnoredAny)?;
            return Ok(Json::Null);
        }
        parser.deserialize_any(self)
    }
}

impl<'de> serde::de::Visitor<'de> for Tree<'_> {
    type Value = Json;

    fn expecting(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str("JSON")
    }

    fn visit_unit<E>(self) -> Result<Json, E> {
        Ok(Json::Null)
    }

    fn visit_bool<E>(self, value: bool) -> Result<Json, E> {
        Ok(Json::Flag(value))
    }

    fn visit_i64<E>(self, value: i64) -> Result<Json, E> {
        Ok(Json::Number(value as f64))
    }

    fn visit_u64<E>(self, value: u64) -> Result<Json, E> {
        Ok(Json::Number(value as f64))
    }

    fn visit_f64<E>(self, value: f64) -> Result<Json, E> {
        Ok(Json::Number(value))
    }

    fn visit_str<E>(self, value: &str) -> Result<Json, E> {
        Ok(Json::Text(value.into()))
    }

    fn visit_seq<A: serde::de::SeqAccess<'de>>(self, mut list: A) -> Result<Json, A::Error> {
        let mut values = Vec::new();
        while let Some(value) = list.next_element_seed(self.inside())? {
            values.push(value);
        }
        Ok(Json::List(values.into()))
    }

    fn visit_map<A: serde::de::MapAccess<'de>>(self, mut map: A) -> Result<Json, A::Error> {
        let mut members = Vec::new();
        while let Some(name) = map.next_key::<Box<str>>()? {
            if &*name == "extras" {
                map.next_value::<serde::de::IgnoredAny>()?;
            } else {
                members.push((name, map.next_value_seed(self.inside())?));
            }
        }
        // Of members with the same name the last one counts, as in other parsers. The sort is stable.
        members.reverse();
        members.sort_by(|(one, _), (other, _)| one.cmp(other));
        members.dedup_by(|(one, _), (other, _)| one == other);
        Ok(Json::Object(members.into()))
    }
}
