//! Random changes of files: most of them are then wrong somewhere.

use fastrand::Rng;
use serde_json::{Value, json};

use super::builder::{Builder, glb};

/// The bytes of a file with some random changes, of its JSON, of its buffer, or of all its bytes.
pub fn mutated(builder: &Builder, rng: &mut Rng) -> Vec<u8> {
    let mut json = builder.json.clone();
    let mut binary = builder.binary.clone();
    json["buffers"] = json!([{"byteLength": binary.len()}]);
    let kind = rng.u8(..8);
    if kind < 6 {
        for _ in 0..rng.usize(1..4) {
            change_json(&mut json, rng);
        }
    }
    if kind >= 5 && !binary.is_empty() {
        for _ in 0..rng.usize(1..8) {
            let at = rng.usize(..binary.len());
            binary[at] = [0, 1, 0x7f, 0x80, 0xff, rng.u8(..)][rng.usize(..6)];
        }
    }
    let mut bytes = glb(&json, &binary);
    if kind == 7 {
        if rng.bool() {
            bytes.truncate(rng.usize(..bytes.len()));
        } else {
            let at = rng.usize(..bytes.len());
            bytes[at] = rng.u8(..);
        }
    }
    bytes
}

/// Removes a value, or replaces it by one of another type or an extreme one.
fn change_json(json: &mut Value, rng: &mut Rng) {
    let mut paths = Vec::new();
    collect(json, String::new(), &mut paths);
    let path = &paths[rng.usize(..paths.len())];
    if rng.u8(..4) == 0 {
        let (parent, member) = path.rsplit_once('/').unwrap_or(("", ""));
        match json.pointer_mut(parent) {
            Some(Value::Object(members)) => _ = members.remove(member),
            Some(Value::Array(values)) => {
                if let Some(index) = member.parse::<usize>().ok().filter(|&index| index < values.len()) {
                    values.remove(index);
                }
            }
            _ => {}
        }
        return;
    }
    let other = json.pointer(&paths[rng.usize(..paths.len())]).cloned().unwrap_or_default();
    if let Some(value) = json.pointer_mut(path) {
        *value = match (rng.u8(..10), value.as_f64()) {
            (0..4, Some(number)) => near(number, rng),
            (4, _) => other,
            _ => extreme(rng),
        };
    }
}

fn near(number: f64, rng: &mut Rng) -> Value {
    match rng.u8(..6) {
        0 => json!(number as i64 + 1),
        1 => json!(number as i64 - 1),
        2 => json!(-number),
        3 => json!(number * 1000.0),
        4 => json!(number + 0.5),
        _ => json!(number as i64 * 2),
    }
}

fn extreme(rng: &mut Rng) -> Value {
    let values = [
        json!(null),
        json!(true),
        json!("a\u{1b}[31m\u{7}\u{202e}\u{2028}"),
        json!({}),
        json!([]),
        json!([0]),
        json!([0, 0]),
        json!(0),
        json!(-1),
        json!(1.0),
        json!(7),
        json!(1 << 20),
        json!(177_999_999),
        json!(u32::MAX),
        json!(i64::MIN),
        json!(u64::MAX),
        json!(1e39),
        json!(1e308),
        json!(-1e308),
        json!(1e-308),
        json!(f64::from(f32::MAX)),
        json!([1e38, 1e38, 1e38]),
        json!([0, 0, 0, 0]),
        json!({"index": 0}),
    ];
    values[rng.usize(..values.len())].clone()
}

/// The paths of all values but the root.
fn collect(json: &Value, path: String, paths: &mut Vec<String>) {
    if !path.is_empty() {
        paths.push(path.clone());
    }
    match json {
        Value::Object(members) => {
            members.iter().for_each(|(name, value)| collect(value, format!("{path}/{name}"), paths))
        }
        Value::Array(values) => {
            values.iter().enumerate().for_each(|(index, value)| collect(value, format!("{path}/{index}"), paths));
        }
        _ => {}
    }
}
