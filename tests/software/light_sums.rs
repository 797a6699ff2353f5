//! Many small contributions of light add up.

use drawloom::backend::SoftwareSubmission;
use drawloom::process::Deferred;
use drawloom::quality::RadianceSum;
use drawloom_testing::light_sums::{SUMS, SumScene, blended_scenes, light_scenes, quality};

use crate::Fixture;

fn radiance(submission: &SoftwareSubmission) -> Vec<[f64; 3]> {
    let numbers = submission.numbers(0, "radiance").unwrap();
    numbers.iter().map(|pixel| [0, 1, 2].map(|channel| pixel[channel])).collect()
}

/// Draws each scene with each value of the knob.
fn expect_sums(scenes: &[SumScene]) {
    for sum in SUMS {
        let mut fixture = Fixture::new(1, |builder| builder.pipeline(Deferred::new()).quality(quality(sum)));
        for scene in scenes {
            let error = scene.error(&radiance(&fixture.draw(&scene.scene)));
            assert!(error <= scene.bound(sum), "{sum:?}: {}: {error}", scene.name);
            assert!(sum != RadianceSum::Shader || error <= 1e-3, "{}: {error}", scene.name);
        }
    }
}

#[test]
fn lights_add_up_within_the_bounds_of_their_sum() {
    expect_sums(&light_scenes());
}

#[test]
fn blended_objects_add_up_within_the_bounds_of_their_sum() {
    expect_sums(&blended_scenes());
}

/// What the knob is for: in half floats, a sum ends where its terms are less than half a step.
#[test]
fn half_floats_lose_the_light_of_ten_thousand_lights() {
    let mut fixture = Fixture::new(1, |builder| builder.pipeline(Deferred::new()));
    let scenes = light_scenes();
    let many = scenes.iter().find(|scene| scene.name == "10000 lights of one brightness").unwrap();
    assert!(many.error(&radiance(&fixture.draw(&many.scene))) > 0.5);
}
