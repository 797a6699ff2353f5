//! Random pipelines and worlds, as plain data.

use drawloom::process::InjectionPoint;
use drawloom_testing::random::Random;

/// A deferred pipeline and an engine's own processes.
#[derive(Debug)]
pub struct Pipeline {
    pub depth_pre_pass: bool,
    /// The number of processes of the geometry buffer.
    pub geometry_shares: u32,
    /// Whether the picture shows diffuse colours, so that no light leads to it.
    pub shows_diffuse: bool,
    pub anti_aliasing: bool,
    pub left_out: Vec<&'static str>,
    pub kept: Vec<&'static str>,
    pub own: Vec<OwnProcess>,
}

/// A process of the engine's own. It creates a target of its own, `target 0` and so on.
#[derive(Clone, Debug)]
pub struct OwnProcess {
    pub index: usize,
    pub in_main: bool,
    pub in_reflections: bool,
    pub place: InjectionPoint,
    pub samples: Vec<String>,
    pub draws_over: Vec<String>,
    /// The targets whose content of the frame before it reads.
    pub histories: Vec<String>,
    /// The targets of the views called `mirror` that it samples.
    pub of_mirror: Vec<String>,
    pub samples_shadow_maps: bool,
    pub keep: bool,
    pub is_output: bool,
}

impl OwnProcess {
    pub fn name(&self) -> String {
        format!("own {}", self.index)
    }

    pub fn target(&self) -> String {
        format!("target {}", self.index)
    }
}

pub const PLACES: [InjectionPoint; 5] = [
    InjectionPoint::BeforeGeometry,
    InjectionPoint::AfterGeometry,
    InjectionPoint::AfterLighting,
    InjectionPoint::AfterTransparency,
    InjectionPoint::AfterPostProcessing,
];

/// Those that a scene may lack.
const OPTIONAL: [&str; 10] = [
    "directional lights",
    "shadowed directional lights",
    "point lights",
    "shadowed point lights",
    "spot lights",
    "shadowed spot lights",
    "hemispherical lights",
    "shadowed hemispherical lights",
    "transparency",
    "shadow casters",
];

fn some(random: &mut Random, one_in: usize) -> Vec<&'static str> {
    OPTIONAL.into_iter().filter(|_| random.below(one_in) == 0).collect()
}

impl Pipeline {
    pub fn random(random: &mut Random) -> Self {
        let mut places: Vec<usize> = (0..random.below(7)).map(|_| random.below(PLACES.len())).collect();
        places.sort_unstable();
        let mut own: Vec<OwnProcess> = Vec::new();
        for (index, place) in places.into_iter().enumerate() {
            own.push(OwnProcess::random(random, index, place, &own));
        }
        // Of itself or of any other.
        for index in 0..own.len() {
            let of = own[random.below(own.len())].clone();
            if random.below(4) == 0 && of.is_wherever(&own[index]) {
                own[index].histories.push(of.target());
            }
        }
        // What a frame without reflections does not write has no format, so only what each frame writes is sampled.
        let outputs: Vec<_> =
            own.iter().filter(|own| own.is_output && own.in_reflections).map(OwnProcess::target).collect();
        for own in own.iter_mut().filter(|_| !outputs.is_empty()) {
            if random.below(4) == 0 {
                own.of_mirror.push(outputs[random.below(outputs.len())].clone());
            }
        }
        let one_in = [3, 12][random.below(2)];
        let mut left_out = some(random, 12);
        // Without their process there is no map to sample.
        left_out.retain(|name| *name != "shadow casters" || own.iter().all(|own| !own.samples_shadow_maps));
        Self {
            depth_pre_pass: random.below(2) == 0,
            geometry_shares: 1 + random.below(2) as u32,
            shows_diffuse: random.below(4) == 0,
            anti_aliasing: random.below(2) == 0,
            left_out,
            kept: some(random, one_in),
            own,
        }
    }
}

impl OwnProcess {
    fn random(random: &mut Random, index: usize, place: usize, earlier: &[Self]) -> Self {
        let (in_main, in_reflections) = [(true, false), (false, true), (true, true)][random.below(3)];
        let mut own = Self {
            index,
            in_main,
            in_reflections,
            place: PLACES[place],
            samples: Vec::new(),
            draws_over: Vec::new(),
            histories: Vec::new(),
            of_mirror: Vec::new(),
            samples_shadow_maps: random.below(8) == 0,
            keep: random.below(6) == 0,
            // The outputs of an engine are those of its own views.
            is_output: in_main && random.below(4) == 0,
        };
        for other in earlier {
            match random.below(4) {
                0 if other.is_wherever(&own) => own.samples.push(other.target()),
                1 if other.is_wherever(&own) => own.draws_over.push(other.target()),
                _ => {}
            }
        }
        let is_after_geometry = own.place != InjectionPoint::BeforeGeometry;
        let is_last = own.place == InjectionPoint::AfterPostProcessing;
        for target in ["depth", "normal", "diffuse"] {
            if is_after_geometry && random.below(8) == 0 {
                own.samples.push(target.to_owned());
            }
        }
        let changed = if is_last { "picture" } else { "radiance" };
        match random.below(3) {
            0 if is_after_geometry => own.samples.push(changed.to_owned()),
            1 if is_after_geometry => own.draws_over.push(changed.to_owned()),
            _ => {}
        }
        for target in ["radiance", "depth", "picture"] {
            if random.below(10) == 0 {
                own.histories.push(target.to_owned());
            }
        }
        for target in ["radiance", "normal", "picture"] {
            if random.below(6) == 0 {
                own.of_mirror.push(target.to_owned());
            }
        }
        own
    }

    /// Whether it draws in all views in which another process draws.
    fn is_wherever(&self, other: &Self) -> bool {
        (self.in_main || !other.in_main) && (self.in_reflections || !other.in_reflections)
    }
}

/// What a frame draws.
#[derive(Debug)]
pub struct World {
    pub objects: Vec<Object>,
    /// Materials of the assets that no object has.
    pub unused: Vec<Object>,
    pub lights: Vec<LightSpec>,
    pub cameras: Vec<CameraSpec>,
}

/// The material of an object.
#[derive(Clone, Copy, Debug)]
pub struct Object {
    pub blended: bool,
    /// Whether its material has a material type, which leaves it to the engine's processes.
    pub has_type: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LightKindSpec {
    Directional,
    Point,
    Spot,
    Hemispherical,
}

#[derive(Clone, Copy, Debug)]
pub struct LightSpec {
    pub kind: LightKindSpec,
    pub casts_shadow: bool,
    pub is_on: bool,
    /// 0 makes it invalid.
    pub range: f32,
    pub position: [f64; 3],
}

/// A camera on the z axis that looks along it.
#[derive(Clone, Debug)]
pub struct CameraSpec {
    pub name: &'static str,
    pub is_reflection: bool,
    pub z: f64,
    /// Whether it looks towards smaller z.
    pub looks_down: bool,
}

/// Among all cameras, behind those that look up, behind those that look down, and beside all of them.
const POSITIONS: [[f64; 3]; 4] = [[0.0; 3], [0.0, 0.0, -500.0], [0.0, 0.0, 500.0], [1e5, 0.0, 0.0]];
const REFLECTIONS: [&str; 7] =
    ["main/mirror", "main/mirror/mirror", "other/mirror", "mirror", "mirror/0", "mirror/1", "window"];

impl World {
    pub fn random(random: &mut Random) -> Self {
        let objects = random.below(6);
        let blended_in = [1, 3, 50][random.below(3)];
        let mut object = |_| Object { blended: random.below(blended_in) == 0, has_type: random.below(3) == 0 };
        let (objects, unused) = ((0..objects).map(&mut object).collect(), (0..2).map(&mut object).collect());
        let kinds =
            [LightKindSpec::Directional, LightKindSpec::Point, LightKindSpec::Spot, LightKindSpec::Hemispherical];
        let count = [0, 1, 3, 8][random.below(4)];
        let light = |_| LightSpec {
            kind: kinds[random.below(4)],
            casts_shadow: random.below(2) == 0,
            is_on: random.below(5) > 0,
            range: if random.below(6) == 0 { 0.0 } else { 10.0 },
            position: POSITIONS[random.below(POSITIONS.len())],
        };
        let lights = (0..count).map(light).collect();
        let mut cameras = vec![CameraSpec { name: "main", is_reflection: false, z: 50.0, looks_down: true }];
        if random.below(3) == 0 {
            cameras.push(CameraSpec { name: "other", is_reflection: false, z: 40.0, looks_down: true });
        }
        let one_in = [3, 20][random.below(2)];
        for name in REFLECTIONS {
            if random.below(one_in) == 0 {
                let camera = CameraSpec { name, is_reflection: true, z: -50.0, looks_down: false };
                cameras.insert(random.below(cameras.len() + 1), camera);
            }
        }
        Self { objects, unused, lights, cameras }
    }

    /// The name of the kind of a camera's view.
    pub fn kind_of(&self, view: &str) -> &'static str {
        let is_reflection = self.cameras.iter().any(|camera| camera.name == view && camera.is_reflection);
        if is_reflection { "reflection" } else { "main" }
    }
}
