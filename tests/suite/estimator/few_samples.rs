//! What is told of a picture's noise by very few samples.

use std::sync::atomic::AtomicBool;

use lightgrid::environment::{Environment, EnvironmentOptions, sky};
use lightgrid::metrics::compare;
use lightgrid::path::World;
use lightgrid::render::{Sampling, Sharing, StopRule, View};
use lightgrid::scene::builtin;

use super::{learned, render};

/// Scenes whose light is found easily, and their skies. Of others, few samples have met too little to tell: `evening`,
/// `office` and `crack` have twice the noise that two samples tell, and more.
const SCENES: [(&str, &str); 3] = [("open", "day"), ("exterior", "day"), ("fog", "sunset")];

#[test]
fn the_noise_of_two_to_four_samples_is_told_where_light_is_found_easily() {
    for (scene, map) in SCENES {
        let map = sky::build(map, 256, 128).expect("a sky");
        let environment =
            Environment::new(map, &EnvironmentOptions::default()).expect("a sound map");
        let world = World::new(builtin::build(scene).expect("built in"));
        let view = |seed| View {
            sampling: Sampling::Adaptive,
            sharing: Sharing::Off,
            seed,
            ..View::new(world.scene.cameras[0].clone(), [48, 32])
        };
        let reference = render(&world, &environment, view(9), 128).image();
        let mut sessions: Vec<_> =
            (1..5).map(|seed| learned(&world, &environment, view(seed))).collect();
        for samples in 2..=4 {
            let rule = StopRule { samples: Some(samples), ..StopRule::default() };
            let (mut told, mut found) = (0.0, 0.0);
            for session in &mut sessions {
                while !rule.is_met(session) {
                    let pass = rule.next_pass(session);
                    session.advance(pass, &AtomicBool::new(false)).expect("no GPU");
                }
                told += session.noise().powi(2);
                let image = session.film().image();
                found += compare(&image, &reference).expect("of a size").trimmed_rel_mse;
            }
            let ratio = (told / found).sqrt();
            eprintln!("{scene}, {samples} samples: {ratio:.2} of the noise is told");
            assert!((1.0 / 1.5..1.5).contains(&ratio), "{scene}, {samples} samples: {ratio}");
        }
    }
}
