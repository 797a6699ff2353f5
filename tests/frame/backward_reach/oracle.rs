//! The oracle: every process that could exist, with what it reads and writes, and a walk backwards from the outputs to
//! a fixpoint.

use drawloom::process::InjectionPoint;

use super::spec::{CameraSpec, LightKindSpec, LightSpec, OwnProcess, PLACES, Pipeline, World};

/// What a frame has, sorted.
#[derive(Debug, Default, PartialEq, Eq)]
pub struct Frame {
    /// The view and the process of each pass. The views of a light's shadow maps have the name of the light.
    pub passes: Vec<(String, String)>,
    /// The kind of views and the name of each target.
    pub targets: Vec<(String, String)>,
    /// One for each shadow map.
    pub shadow_views: Vec<String>,
    /// The first view for which there is no process: that frame is an error, and has nothing.
    pub refused: Option<String>,
}

impl Frame {
    pub fn sort(&mut self) {
        self.passes.sort();
        self.targets.sort();
        self.shadow_views.sort();
    }
}

const KINDS: [&str; 3] = ["main", "reflection", "shadow"];
const MAP: &str = "shadow map";

/// A process in views of one kind.
#[derive(Clone, Debug, Default)]
struct Node {
    name: String,
    kind: &'static str,
    creates: Vec<String>,
    /// Changes what earlier processes wrote.
    changes: Vec<String>,
    reads: Vec<String>,
    histories: Vec<String>,
    of_mirror: Vec<String>,
    reads_maps: bool,
    is_kept: bool,
}

impl Node {
    fn writes(&self, target: &str) -> bool {
        self.creates.iter().chain(&self.changes).any(|written| written == target)
    }
}

/// What one frame of the pipeline draws of a world.
pub fn predict(pipeline: &Pipeline, world: &World) -> Frame {
    let nodes = nodes_of(pipeline, world);
    let reached = reach(&nodes, pipeline);
    let reached: Vec<&Node> = nodes.iter().zip(reached).filter_map(|(node, reached)| reached.then_some(node)).collect();
    let is_refused = |camera: &&CameraSpec| reached.iter().all(|node| node.kind != world.kind_of(camera.name));
    let refused = world.cameras.iter().find(is_refused).map(|camera| camera.name.to_owned());
    let mut frame = Frame { refused, ..Frame::default() };
    if frame.refused.is_some() {
        return frame;
    }
    for node in &reached {
        let targets = node.creates.iter().cloned();
        let copies = node.histories.iter().map(|target| format!("{target} of the frame before"));
        frame.targets.extend(targets.chain(copies).map(|target| (node.kind.to_owned(), target)));
        if node.reads_maps {
            // A texture has to be bound even if no map is drawn.
            frame.targets.push(("shadow".to_owned(), MAP.to_owned()));
        }
    }
    frame.targets.sort();
    frame.targets.dedup();
    if reached.iter().any(|node| node.kind == "shadow") {
        frame.shadow_views = shadow_views(world);
    }
    let cameras = world.cameras.iter().map(|camera| (world.kind_of(camera.name), camera.name.to_owned()));
    for (kind, view) in cameras.chain(frame.shadow_views.iter().map(|view| ("shadow", view.clone()))) {
        let drawn = reached.iter().filter(|node| node.kind == kind);
        frame.passes.extend(drawn.map(|node| (view.clone(), node.name.clone())));
    }
    frame.sort();
    frame
}

/// All nodes that a frame of this world could have, those of a kind of views in the order in which they draw.
fn nodes_of(pipeline: &Pipeline, world: &World) -> Vec<Node> {
    let is_left_out = |name: &str| pipeline.left_out.contains(&name);
    let is_kept = |name: &str| pipeline.kept.contains(&name);
    let has_maps = !is_left_out("shadow casters");
    let lights = || world.lights.iter().filter(|light| is_valid(light));
    // Without maps a light that would cast shadows is one that casts none.
    let has_lights = |kind: LightKindSpec, shadowed: bool| {
        lights().any(|light| light.kind == kind && (light.casts_shadow && has_maps) == shadowed)
    };
    let lights: Vec<(String, bool)> = LIGHTS
        .into_iter()
        .map(|(kind, shadowed, name)| (name, shadowed, has_lights(kind, shadowed)))
        .filter(|(name, shadowed, has_lights)| (*has_lights || is_kept(name)) && (has_maps || !shadowed))
        .map(|(name, shadowed, _)| (name.to_owned(), shadowed))
        .collect();
    let draws_maps = has_maps && (is_kept("shadow casters") || lights.iter().any(|(_, shadowed)| *shadowed));
    let has_glass = world.objects.iter().any(|object| object.blended && !object.has_type);

    let mut shipped: Vec<(InjectionPoint, Node)> = Vec::new();
    let node = |name: &str| Node { name: name.to_owned(), is_kept: is_kept(name), ..Node::default() };
    let geometry = InjectionPoint::BeforeGeometry;
    if pipeline.depth_pre_pass {
        shipped.push((geometry, Node { creates: named(&["depth"]), ..node("depth pre-pass") }));
    }
    for share in 0..pipeline.geometry_shares {
        let of_several = format!("geometry buffer {} of {}", share + 1, pipeline.geometry_shares);
        let mut buffer = node(if pipeline.geometry_shares == 1 { "geometry buffer" } else { &of_several });
        let colors = named(&["normal", "diffuse", "radiance"]);
        if share == 0 { &mut buffer.creates } else { &mut buffer.changes }.extend(colors);
        match (pipeline.depth_pre_pass, share) {
            (true, _) => buffer.reads.push("depth".to_owned()),
            (false, 0) => buffer.creates.push("depth".to_owned()),
            (false, _) => buffer.changes.push("depth".to_owned()),
        }
        shipped.push((geometry, buffer));
    }
    for (name, reads_maps) in lights.iter().filter(|(name, _)| !is_left_out(name)) {
        let (reads, changes) = (named(&["depth", "normal", "diffuse"]), named(&["radiance"]));
        shipped.push((InjectionPoint::AfterGeometry, Node { reads, changes, reads_maps: *reads_maps, ..node(name) }));
    }
    if (has_glass || is_kept("transparency")) && !is_left_out("transparency") {
        let (reads, changes) = (named(&["depth"]), named(&["radiance"]));
        shipped.push((
            InjectionPoint::AfterLighting,
            Node { reads, changes, reads_maps: draws_maps, ..node("transparency") },
        ));
    }
    let shown = named(&[if pipeline.shows_diffuse { "diffuse" } else { "radiance" }]);
    let first = named(&[if pipeline.anti_aliasing { "post-processed 1" } else { "picture" }]);
    shipped.push((
        InjectionPoint::AfterTransparency,
        Node { reads: shown, creates: first.clone(), ..node("tone mapping") },
    ));
    if pipeline.anti_aliasing {
        shipped.push((
            InjectionPoint::AfterTransparency,
            Node { reads: first, creates: named(&["picture"]), ..node("fxaa") },
        ));
    }

    let mut nodes = Vec::new();
    if draws_maps {
        nodes.push(Node { kind: "shadow", creates: named(&[MAP]), ..node("shadow casters") });
    }
    for kind in ["main", "reflection"] {
        if kind == "reflection" && !world.cameras.iter().any(|camera| camera.is_reflection) {
            continue;
        }
        for place in PLACES {
            let own = pipeline.own.iter().filter(|own| own.place == place);
            let own = own.filter(|own| if kind == "main" { own.in_main } else { own.in_reflections });
            nodes.extend(own.map(|own| own_node(own, kind)));
            let here = shipped.iter().filter(|(begins, _)| *begins == place);
            // The pipeline's processes are kept where the engine sees them.
            nodes.extend(here.map(|(_, node)| Node { kind, is_kept: node.is_kept && kind == "main", ..node.clone() }));
        }
    }
    nodes
}

/// In the order in which they are drawn.
const LIGHTS: [(LightKindSpec, bool, &str); 8] = [
    (LightKindSpec::Directional, false, "directional lights"),
    (LightKindSpec::Directional, true, "shadowed directional lights"),
    (LightKindSpec::Point, false, "point lights"),
    (LightKindSpec::Point, true, "shadowed point lights"),
    (LightKindSpec::Spot, false, "spot lights"),
    (LightKindSpec::Spot, true, "shadowed spot lights"),
    (LightKindSpec::Hemispherical, false, "hemispherical lights"),
    (LightKindSpec::Hemispherical, true, "shadowed hemispherical lights"),
];

fn named(names: &[&str]) -> Vec<String> {
    names.iter().map(|name| (*name).to_owned()).collect()
}

fn own_node(own: &OwnProcess, kind: &'static str) -> Node {
    Node {
        name: own.name(),
        kind,
        creates: vec![own.target()],
        changes: own.draws_over.clone(),
        reads: own.samples.clone(),
        histories: own.histories.clone(),
        of_mirror: own.of_mirror.clone(),
        reads_maps: own.samples_shadow_maps,
        is_kept: own.keep,
    }
}

/// For each node, whether an output or a kept node depends on it.
fn reach(nodes: &[Node], pipeline: &Pipeline) -> Vec<bool> {
    let mut reached: Vec<bool> = nodes.iter().map(|node| node.is_kept).collect();
    let all = nodes.len();
    let own = pipeline.own.iter().filter(|own| own.is_output).map(OwnProcess::target);
    for output in own.chain(["picture".to_owned()]) {
        need(&mut reached, nodes, all, "main", &output);
        // Where a process of reflections alone writes it, it is an output of those too.
        if pipeline.own.iter().any(|own| !own.in_main && own.draws_over.contains(&output)) {
            need(&mut reached, nodes, all, "reflection", &output);
        }
    }
    loop {
        let before = reached.clone();
        for (index, node) in nodes.iter().enumerate().filter(|(index, _)| before[*index]) {
            for target in node.reads.iter().chain(&node.changes) {
                need(&mut reached, nodes, index, node.kind, target);
            }
            for target in &node.histories {
                need(&mut reached, nodes, all, node.kind, target);
            }
            for target in &node.of_mirror {
                need(&mut reached, nodes, all, "reflection", target);
            }
            if node.reads_maps {
                need(&mut reached, nodes, all, "shadow", MAP);
            }
        }
        if reached == before {
            return reached;
        }
    }
}

/// Reaches what writes a target of a kind of views before the node at an index.
fn need(reached: &mut [bool], nodes: &[Node], before: usize, kind: &str, target: &str) {
    for (index, node) in nodes.iter().enumerate().take(before) {
        reached[index] |= node.kind == kind && node.writes(target);
    }
}

fn is_valid(light: &LightSpec) -> bool {
    light.is_on && (light.range > 0.0 || light.kind == LightKindSpec::Directional)
}

/// The shadow maps, each by its light: those of the lights that reach what a camera may see.
fn shadow_views(world: &World) -> Vec<String> {
    let mut views = Vec::new();
    for (index, light) in world.lights.iter().enumerate().filter(|(_, light)| light.casts_shadow && is_valid(light)) {
        let is_seen =
            light.kind == LightKindSpec::Directional || world.cameras.iter().any(|camera| sees(camera, light));
        let maps = match light.kind {
            _ if !is_seen => 0,
            LightKindSpec::Point => 6,
            _ => 1,
        };
        views.extend((0..maps).map(|_| format!("shadow of light {index}")));
        // Further main cameras have maps of their own.
        let main = world.cameras.iter().filter(|camera| !camera.is_reflection).skip(1);
        let main = main.filter(|_| light.kind == LightKindSpec::Directional);
        views.extend(main.map(|camera| format!("shadow of light {index} for {}", camera.name)));
    }
    views
}

/// Whether a camera sees a part of the ball around a light: the light is ahead of it, and beside its axis by less than
/// it is far.
fn sees(camera: &CameraSpec, light: &LightSpec) -> bool {
    let [x, y, z] = light.position;
    let ahead = if camera.looks_down { camera.z - z } else { z - camera.z };
    ahead > 0.0 && x.abs().max(y.abs()) < ahead
}

#[test]
fn kinds_have_the_names_of_the_crate() {
    use drawloom::scene::ViewKind;
    assert_eq!([ViewKind::Main, ViewKind::Reflection, ViewKind::Shadow].map(ViewKind::name), KINDS);
}
