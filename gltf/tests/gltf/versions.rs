//! Files of other versions are refused by name.

use libtest_mimic::Failed;
use serde_json::{Value, json};

use crate::fixture::{AT_REST, expect, load_memory};
use crate::generate::static_scenes::textured_square;

pub const CASES: &[crate::Case] =
    &[("other_versions_are_refused_by_name", versions), ("later_minor_versions_are_drawn", minor)];

fn versions() -> Result<(), Failed> {
    let cases: [(Value, &str); 16] = [
        (json!({"version": "3.0"}), "the `asset.version` 3.0"),
        (json!({"version": "1.0"}), "the `asset.version` 1.0"),
        (json!({"version": "1.1", "minVersion": "2.0"}), "the `asset.version` 1.1"),
        (json!({"version": "20.0"}), "the `asset.version` 20.0"),
        (json!({"version": "99999999999999999999.0"}), "the `asset.version` 4294967295.0"),
        (json!({"version": "2"}), "the `asset.version` \"2\", which is not of the form"),
        (json!({"version": "2.0.1"}), "the `asset.version` \"2.0.1\""),
        (json!({"version": "v2.0\u{1b}[2J"}), "the `asset.version` \"v2.0\\u{1b}[2J\""),
        (json!({"version": "2.-0"}), "the `asset.version` \"2.-0\""),
        (json!({"version": ""}), "the `asset.version` \"\""),
        (json!({"version": 2.0}), "the `asset.version` 2 without quotes"),
        (json!({"version": ["2.0"]}), "the `asset.version` of another type"),
        (json!({"version": "2.1", "minVersion": "2.1"}), "the `asset.minVersion` 2.1"),
        (json!({"version": "2.0", "minVersion": "3.0"}), "the `asset.minVersion` 3.0"),
        (json!({}), "no `asset.version`"),
        (Value::Null, "no `asset`, and so no version"),
    ];
    for (asset, expected) in cases {
        let mut builder = textured_square();
        builder.json["asset"] = asset.clone();
        let error = load_memory("version.glb", builder.glb(), &AT_REST).err().map(|it| it.to_string());
        let is_named = error.as_ref().is_some_and(|it| it.contains(expected) && it.contains("only glTF 2.0 is read"));
        expect(is_named, || format!("{asset}: {error:?}, not {expected:?}"))?;
    }
    let mut glb = textured_square().glb();
    for version in [1_u32, 3, u32::MAX] {
        glb[4..8].copy_from_slice(&version.to_le_bytes());
        let error = load_memory("version.glb", glb.clone(), &AT_REST).err().map(|it| it.to_string());
        let expected = format!("a binary header of version {version}, and only glTF 2.0 is read");
        expect(error.as_ref().is_some_and(|it| it.contains(&expected)), || format!("{error:?}, not {expected:?}"))?;
    }
    Ok(())
}

fn minor() -> Result<(), Failed> {
    for (asset, is_later) in [
        (json!({"version": "2.0", "minVersion": "2.0"}), false),
        (json!({"version": "2.1"}), true),
        (json!({"version": "2.7", "minVersion": "2.0"}), true),
    ] {
        let mut builder = textured_square();
        builder.json["asset"] = asset;
        let world = load_memory("version.glb", builder.glb(), &AT_REST)?;
        let is_said = world.warnings.iter().any(|warning| warning.contains("is read as 2.0"));
        expect(is_said == is_later && world.object_count() == 1, || format!("{:?}", world.warnings))?;
    }
    Ok(())
}
