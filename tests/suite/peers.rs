//! Pictures against references that another renderer (Mitsuba 3) made of the same scenes and maps.
//!
//! The quick test tells whether our error is what our own noise explains; the ignored one goes deep:
//! `cargo test --release --test suite peers:: -- --ignored --nocapture`.

use lightgrid::color::luminance;
use lightgrid::environment::{Environment, EnvironmentOptions};
use lightgrid::image::{Image, read_map, read_picture};
use lightgrid::path::World;
use lightgrid::render::film::{Film, Pixel};
use lightgrid::render::{Sampling, View};
use lightgrid::scene::gltf;

use crate::estimator::{mean, render, view};
use crate::shared::shared;

/// Scenes and maps that there are references of.
pub(crate) const PEERS: [&str; 6] =
    ["exterior day", "living day", "living sunset", "office day", "office night", "open day"];

/// A scene, a map, and the picture they make.
pub(crate) struct Peer {
    pub(crate) world: World,
    pub(crate) environment: Environment,
    reference: Image,
    /// relMSE of the reference itself.
    reference_noise: f64,
}

impl Peer {
    /// `None`, said on stderr, where the shared data is absent.
    pub(crate) fn load(scene: &str, map: &str) -> Option<Self> {
        let glb = shared(&format!("peers/{scene}.glb"))?;
        let exr = shared(&format!("peers/{map}.exr"))?;
        let picture = shared(&format!("peers/ref/{scene}_{map}.exr"))?;
        let json = shared(&format!("peers/ref/{scene}_{map}.json"))?;
        let facts: serde_json::Value =
            serde_json::from_slice(&std::fs::read(json).expect("readable")).expect("JSON");
        let map = read_map(&exr).expect("a map").image;
        Some(Self {
            world: World::new(gltf::load(&glb).expect("a scene")),
            environment: Environment::new(map, &EnvironmentOptions::default()).expect("sound"),
            reference: read_picture(&picture).expect("a picture"),
            reference_noise: facts["noise_relmse"].as_f64().expect("a number"),
        })
    }

    /// Luminance of each pixel of the reference.
    fn luminances(&self) -> Vec<f64> {
        let of = |pixel: &[f32; 3]| f64::from(luminance((*pixel).into()));
        self.reference.pixels.iter().map(of).collect()
    }

    /// Mean luminance of the reference.
    pub(crate) fn reference_mean(&self) -> f64 {
        let luminances = self.luminances();
        luminances.iter().sum::<f64>() / luminances.len() as f64
    }

    fn render(&self, sampling: Sampling, samples: u32) -> Film {
        let view = View {
            width: self.reference.width,
            height: self.reference.height,
            learning_paths: 1 << 16,
            ..view(self.world.scene.cameras[0].clone(), sampling, 5)
        };
        render(&self.world, &self.environment, view, samples)
    }

    fn compare(&self, film: &Film) -> Report {
        let (reference, reference_mean) = (self.luminances(), self.reference_mean());
        let relative = |squared_error: &dyn Fn(&Pixel, f64) -> f64| {
            let floor = 0.01 * reference_mean * reference_mean;
            let pixels = film.pixels().iter().zip(&reference);
            trimmed_mean(pixels.map(|(p, &r)| squared_error(p, r) / (r * r + floor)).collect())
        };
        let found = mean(film);
        Report {
            mean_ratio: found.luminance / reference_mean,
            ratio_error: found.standard_error / reference_mean,
            error: relative(&|p, r| (p.mean_luminance() - r).powi(2)),
            own_noise: relative(&|p, _| p.variance_of_mean()),
            reference_noise: self.reference_noise,
        }
    }
}

/// Mean without the largest thousandth.
fn trimmed_mean(mut values: Vec<f64>) -> f64 {
    values.sort_unstable_by(f64::total_cmp);
    values.truncate(values.len() - values.len() / 1000);
    values.iter().sum::<f64>() / values.len() as f64
}

/// A picture beside its reference, in luminance; errors are trimmed relMSE.
#[derive(Debug)]
struct Report {
    mean_ratio: f64,
    /// Standard error of `mean_ratio`, from our samples' spread.
    ratio_error: f64,
    error: f64,
    /// What our samples' spread says the error should be; low-discrepancy samples do better.
    own_noise: f64,
    reference_noise: f64,
}

impl Report {
    fn line(&self, what: &str) -> String {
        format!(
            "{what:32} mean ratio {:.5} +- {:.5}, relMSE {:.3e}, own noise {:.3e}, reference {:.1e}",
            self.mean_ratio, self.ratio_error, self.error, self.own_noise, self.reference_noise
        )
    }

    /// Whether the means agree within half a percent, or within four standard errors.
    fn has_the_mean(&self) -> bool {
        (self.mean_ratio - 1.0).abs() <= (4.0 * self.ratio_error).max(0.005)
    }
}

#[test]
fn pictures_are_as_near_to_the_references_as_their_noise_says() {
    for (scene, map) in [("exterior", "day"), ("open", "day"), ("office", "day")] {
        let Some(peer) = Peer::load(scene, map) else { return };
        let report = peer.compare(&peer.render(Sampling::Adaptive, 24));
        eprintln!("{}", report.line(&format!("{scene} {map}")));
        assert!(report.has_the_mean(), "{scene} {map}: {report:?}");
        let explained = 1.5 * report.own_noise + report.reference_noise;
        assert!(report.error <= explained, "{scene} {map}: {report:?}");
    }
}

#[test]
#[ignore = "an hour of CPU time; run it in release"]
fn long_renders_converge_to_the_references() {
    let mut failures = Vec::new();
    for name in PEERS {
        let (scene, map) = name.split_once(' ').expect("scene and map");
        let Some(peer) = Peer::load(scene, map) else { return };
        for sampling in [Sampling::Plain, Sampling::Talk, Sampling::Adaptive] {
            let report = peer.compare(&peer.render(sampling, 4096));
            let line = report.line(&format!("{name} {sampling:?}"));
            println!("{line}");
            let joint_noise = report.own_noise + report.reference_noise;
            if (report.mean_ratio - 1.0).abs() > 0.005 || report.error > 3.0 * joint_noise {
                failures.push(line);
            }
        }
    }
    assert!(failures.is_empty(), "off the reference:\n{}", failures.join("\n"));
}
