struct Particle {
    position: vec3<f32>,
    age: f32,
    velocity: vec3<f32>,
    end: f32,
}

struct Arguments {
    vertices: u32,
    instances: atomic<u32>,
    first_vertex: u32,
    first_instance: u32,
}

@group(2) @binding(0) var<uniform> frame: vec4<u32>;
@group(2) @binding(1) var<storage, read_write> particles: array<Particle>;
@group(2) @binding(2) var<storage, read_write> alive: array<u32>;
@group(2) @binding(3) var<storage, read_write> arguments: Arguments;

const SECONDS: f32 = 1.0 / 30.0;
const FOUNTAIN: vec3<f32> = vec3<f32>(0.0, 1.0, 25.0);
const GRAVITY: vec3<f32> = vec3<f32>(0.0, -6.0, 0.0);

@compute @workgroup_size(64)
fn compute(@builtin(global_invocation_id) id: vec3<u32>) {
    let index = id.x;
    var particle = particles[index];
    particle.age += SECONDS;
    if particle.age >= particle.end {
        // All begin dead, and a few are born in each frame, one after the other.
        let is_born = index % 64u == frame.x % 64u;
        particle = born(index, is_born);
    } else {
        particle.velocity += GRAVITY * SECONDS;
        particle.position += particle.velocity * SECONDS;
        if particle.position.y < -1.5 && particle.velocity.y < 0.0 {
            particle.velocity *= vec3<f32>(0.7, -0.45, 0.7);
        }
    }
    particles[index] = particle;
    if particle.age < particle.end {
        alive[atomicAdd(&arguments.instances, 1u)] = index;
    }
}

fn born(index: u32, is_born: bool) -> Particle {
    let angle = random(index, 1u) * 6.2831853;
    let spread = 0.4 + 2.2 * random(index, 2u);
    let up = 7.0 + 2.5 * random(index, 3u);
    let velocity = vec3<f32>(cos(angle) * spread, up, sin(angle) * spread);
    return Particle(FOUNTAIN, 0.0, velocity, select(0.0, 2.0 + 2.0 * random(index, 4u), is_born));
}

// From 0 to 1, another for each particle, frame and purpose (Jarzynski and Olano 2020, PCG).
fn random(index: u32, purpose: u32) -> f32 {
    var state = (index * 747796405u + frame.x * 2891336453u + purpose * 277803737u) * 747796405u + 2891336453u;
    state = ((state >> ((state >> 28u) + 4u)) ^ state) * 277803737u;
    return f32((state >> 22u) ^ state) / 4294967296.0;
}
