//! Every public number that an engine sets has a case in [`numbers`](super::numbers), or is listed here with the reason
//! why it needs none.

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

use libtest_mimic::Failed;

use crate::Case;
use crate::fixture::ensure;
use crate::numbers;

pub const CASES: &[Case] = &[("every_public_number_has_a_case", every_number)];

/// Types of arguments and fields that are numbers, or made of them.
const NUMBERS: [&str; 19] = [
    "u8", "u16", "u32", "u64", "usize", "i8", "i16", "i32", "i64", "f32", "f64", "Duration", "Vec2", "Vec3", "Vec4",
    "DVec2", "DVec3", "Quat", "DQuat",
];

/// Paths that begin with one of these are read by the engine and set by the crate.
const RESULTS: &[&str] = &[
    // What a frame, a backend or an import has found.
    "FinishedFrame::",
    "FrameStatistics::",
    "FrameTimes::",
    "LevelStatistics::",
    "StaticGroupStatistics::",
    "StageTimes::",
    "ViewQueue::",
    "ViewStatistics::",
    "backend::Device",
    "backend::TargetMemory::",
    "backend::StreamingStatistics::",
    "backend::ViewQueue::",
    "backend::WgpuPassStatistics::",
    "backend::WgpuResources::",
    "drawloom_async_post::AsyncPostStatistics::",
    "drawloom_async_post::StepFrame::",
    "fence::FenceWait::",
    "graph::ModeChoice::",
    "handle::StaleHandle::",
    "raster::CulledTriangles::",
    "scene::Arrivals::",
    "scene::ChunkInUse::",
    "drawloom_obj::IgnoredKeyword::",
    "drawloom_obj::Imported::",
    "drawloom_obj::ObjWarning::",
    "timeline::Chunk::",
    "timeline::Counter::",
    "timeline::DeviceLog::",
    "timeline::DevicePass::",
    "timeline::Frame::",
    "timeline::Idle::",
    "timeline::Log::",
    "timeline::Run::",
    "timeline::Span::",
    "timeline::Tuning",
    "timeline::Worker",
    "report::PathShare::",
    "report::QueueWait::",
    "report::ReplayedFrame::",
    "report::Slack::",
    "report::Step::",
    "report::WhatIf::",
    "report::WorkerReport::",
    "report::FrameReport::began",
    "report::FrameReport::duration",
    "report::FrameReport::frame",
    "report::FrameReport::on_workers",
    "report::FrameReport::replayed",
    "timeline::JobSize::",
    "timeline::NodeInfo::",
    "alloc::sync::Arc::",
    "f32::",
    "f64::",
    "view::SceneIssue::",
    // What the crate hands to backends, nodes, raw passes and shaders, which is checked before.
    "backend::FrameFence::",
    "backend::FrameRequest::",
    "backend::PassRequest::",
    "backend::Backend::",
    "backend::FrameRecorder::",
    "backend::BackendLayer::",
    // Each layer.
    "L::",
    "backend::SoftwareBackend::",
    "backend::NullBackend::",
    "backend::WgpuBackend::",
    "CpuNode::run",
    "graph::Node::run",
    "graph::Closure::run",
    "alloc::boxed::Box::",
    "process::FullScreenPixel::",
    "process::Materials::",
    "process::ObjectPixel::",
    "process::Pass::",
    "process::PassInputs::",
    "process::RawPassResources::",
    "process::SampledTexture::",
    "process::Shader",
    "process::FramePlan::",
    "fence::DeviceProgress::advance",
    // Keys and versions are only compared. The extremes of bounds are in `tests/frame/items.rs`.
    "process::Items::",
    // The index of a bind group, whose extremes are in `tests/pictures/item_data.rs`.
    "process::ItemContext::",
    // Bits of a pipeline's own, which tell its plans apart and nothing else.
    "process::Requirements::with_own",
    // Layouts of types, made by constructors that check them.
    "process::BufferOffset::",
    "NodeResource::Buffer::",
];

/// Paths that begin with one of these are tools below the renderer for engines that build their own, or loaders of
/// files. They document what an index that is not there does, and their own tests have their extremes.
const TOOLS: &[&str] = &["command::", "drawloom_gltf::", "raster::", "view::"];

/// Bytes that shaders read unconverted.
const BYTES: &[&str] = &["parameters"];

/// Numbers of a scene that `tests/extremes` draws on every backend: in `numbers`, `cameras`, `positions`, `lights` and
/// `qualities`.
const EXTREMES: &[&str] = &[
    "scene::Light::",
    "scene::Projection::",
    "scene::Bounds::",
    "scene::Camera::far",
    "scene::Camera::near",
    "scene::Camera::orientation",
    "scene::Camera::position",
    "scene::Camera::shift",
    "scene::Camera::looking_at",
    // In `tests/frame/camera_matrices.rs`.
    "scene::Camera::from_matrices",
    "scene::WholePicture::",
    "scene::ClipPlane::",
    "scene::Material::",
    "scene::RenderObject::",
    "scene::Scene::ambient",
    "scene::Scene::background",
    "scene::SceneRef::",
    "scene::Vertex::",
    "scene::WrittenColumn",
    "quality::DepthCurve::",
    "quality::DepthPrecision::bits",
    "quality::Quality::",
    "quality::ShadowQuality::",
    "process::ClearColor::Value",
];

fn is_listed(name: &str) -> bool {
    let is_error = name.split("::").any(|part| part.contains("Error") || part.ends_with("Problem"));
    let starts = |list: &[&str]| list.iter().any(|start| name.starts_with(start));
    is_error || starts(RESULTS) || starts(TOOLS) || starts(EXTREMES) || BYTES.iter().any(|part| name.contains(part))
}

fn every_number() -> Result<(), Failed> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(".ci/public-api.txt");
    let api = fs::read_to_string(path)?;
    let found: BTreeSet<_> = api.lines().filter_map(number_in).collect();
    let covered: BTreeSet<_> =
        numbers::CASES.iter().copied().flatten().flat_map(|case| case.numbers).copied().collect();
    let missing: Vec<_> = found.iter().filter(|name| !covered.contains(name.as_str()) && !is_listed(name)).collect();
    ensure(missing.is_empty(), format_args!("numbers without a case of their extremes: {missing:#?}"))?;
    // Methods of traits of the engine's return numbers, which the loop above does not see.
    let returned = [
        "task::SchedulerBuilder::timeline_clock",
        "CpuNode::width",
        "CpuNode::items_per_job",
        "graph::Node::width",
        "graph::Node::chunk",
    ];
    let gone: Vec<_> = covered.iter().filter(|name| !found.contains(**name) && !returned.contains(*name)).collect();
    ensure(gone.is_empty(), format_args!("cases of numbers that are not there: {gone:#?}"))?;
    let spare: Vec<_> = [RESULTS, TOOLS, EXTREMES]
        .concat()
        .into_iter()
        .filter(|start| !found.iter().any(|name| name.starts_with(start)))
        .chain(BYTES.iter().copied().filter(|part| !found.iter().any(|name| name.contains(part))))
        .collect();
    ensure(spare.is_empty(), format_args!("lists of numbers that are not there: {spare:#?}"))?;
    ensure(found.len() > 500, format_args!("only {} numbers were found", found.len()))
}

/// The path of a function with a number among its arguments, or of a field or variant that has one.
fn number_in(line: &str) -> Option<String> {
    let line = line.strip_prefix("pub ")?;
    if line.starts_with("const drawloom") || line.starts_with("struct ") {
        return None;
    }
    if let Some(function) = line.strip_prefix("fn ").or_else(|| line.strip_prefix("const fn ")) {
        let (name, arguments) = function.split_at(first_outside(function, '('));
        return has_number(&arguments_of(arguments)).then(|| path_of(name));
    }
    let (name, kind) = line.split_once(": ").or_else(|| line.split_once('('))?;
    let is_item = name.contains(' ') && !name.contains('<');
    (!is_item && has_number(kind)).then(|| path_of(name))
}

/// The position of a character that is not between angle brackets.
fn first_outside(text: &str, wanted: char) -> usize {
    let (mut depth, mut before) = (0, ' ');
    for (position, character) in text.char_indices() {
        match character {
            '<' => depth += 1,
            '>' if before != '-' => depth -= 1,
            other if other == wanted && depth == 0 => return position,
            _ => {}
        }
        before = character;
    }
    text.len()
}

/// What is between the outermost parentheses, without the arguments and results of closures.
fn arguments_of(text: &str) -> String {
    let (mut depth, mut arguments) = (0, String::new());
    for (position, character) in text.char_indices() {
        match character {
            '(' => {
                depth += 1;
                let before = &text[..position];
                if depth > 1 && ["Fn", "FnMut", "FnOnce"].iter().any(|closure| before.ends_with(closure)) {
                    let end = text[position..].find(')').map_or(text.len(), |length| position + length + 1);
                    let rest = text[end..]
                        .strip_prefix(" -> ")
                        .map_or(&text[end..], |rest| &rest[rest.find([' ', ',', ')']).unwrap_or(rest.len())..]);
                    return arguments + &arguments_of(&format!("({rest}"));
                }
            }
            ')' => {
                depth -= 1;
                if depth == 0 {
                    return arguments;
                }
            }
            _ => {}
        }
        arguments.push(character);
    }
    arguments
}

fn has_number(text: &str) -> bool {
    text.split(|character: char| !character.is_alphanumeric() && character != '_').any(|word| NUMBERS.contains(&word))
}

/// A path without generic arguments, and without the name of `drawloom` or of `drawloom-jobs`, whose modules `drawloom`
/// re-exports.
fn path_of(name: &str) -> String {
    let (mut depth, mut before, mut path) = (0, ' ', String::new());
    for character in name.chars() {
        match character {
            '<' => depth += 1,
            '>' if before != '-' => depth -= 1,
            _ if depth == 0 => path.push(character),
            _ => {}
        }
        before = character;
    }
    let crates = ["drawloom_jobs::", "drawloom::"];
    crates.iter().find_map(|name| path.strip_prefix(name)).map_or(path.clone(), str::to_owned)
}
