//! How good denoised pictures are: FLIP and levels of the built-in filter beside Open Image Denoise, where its library
//! is found, after few and many samples.
//!
//! FLIP through the ACES curve at the reference's automatic exposure; root mean square of 8-bit levels through AgX
//! at the same. References share second vertices, are of another seed, and keep some noise: both figures have a
//! floor.

use lightgrid::denoise::Denoiser;
use lightgrid::environment::{Environment, EnvironmentOptions};
use lightgrid::image::Image;
use lightgrid::metrics::compare;
use lightgrid::path::World;
use lightgrid::render::{Session, Sharing, View};
use lightgrid::scene::builtin;
use lightgrid::sources;
use lightgrid::tone::{ToneCurve, display_rgb8};

use super::advance;

const SIZE: [u32; 2] = [480, 270];
const SAMPLES: [u32; 4] = [1, 4, 16, 64];
const REFERENCE_SAMPLES: u32 = 256;
const REFERENCE_SEED: u32 = 1000;

/// Prints the table, of the built-in scenes that are named or of all.
pub(crate) fn report() {
    let chosen: Vec<&str> = builtin::names()
        .iter()
        .filter(|name| std::env::args().any(|argument| argument == **name))
        .copied()
        .collect();
    let scenes = if chosen.is_empty() { builtin::names() } else { &chosen };
    println!("{:12} {:8} FLIP and levels after {SAMPLES:?} samples", "scene", "filter");
    for scene in scenes {
        let world = World::new(builtin::build(scene).expect("built in"));
        let (map, _) = sources::map(builtin::sky(scene)).expect("built in");
        let environment =
            Environment::new(map, &EnvironmentOptions::default()).expect("a finite map");
        let view = View { layers: true, ..View::new(world.scene.cameras[0].clone(), SIZE) };
        let of = View { seed: REFERENCE_SEED, ..view.clone() };
        let mut session = Session::new(&world, &environment, of);
        advance(&mut session, REFERENCE_SAMPLES);
        let reference = session.film().image();

        let view = View { sharing: Sharing::Off, ..view };
        let mut session = Session::new(&world, &environment, view);
        let mut filters = vec![None, Some(Denoiser::ATrous), Some(Denoiser::Oidn)];
        filters.retain(|filter| filter.is_none_or(|filter| filter.check().is_ok()));
        let name = |filter: &Option<Denoiser>| filter.map_or("none", Denoiser::name).to_owned();
        let mut lines: Vec<String> = filters.iter().map(name).collect();
        for samples in SAMPLES {
            let more = samples - session.samples();
            advance(&mut session, more);
            for (filter, line) in filters.iter().zip(&mut lines) {
                let picture = match filter {
                    None => Ok(session.film().image()),
                    Some(filter) => filter.finish(session.film(), None),
                };
                line.push_str(&differences(&picture.expect("it is usable"), &reference));
            }
        }
        lines.iter().for_each(|line| println!("{scene:12} {line}"));
    }
}

fn differences(picture: &Image, reference: &Image) -> String {
    let compared = compare(picture, reference).expect("finite pictures of a size");
    let levels = |image: &Image| display_rgb8(image, compared.flip_exposure_ev, ToneCurve::Agx);
    let (shown, wanted) = (levels(picture).pixels, levels(reference).pixels);
    let pairs = shown.as_flattened().iter().zip(wanted.as_flattened());
    let sum: f64 = pairs.map(|(a, b)| f64::from(a.abs_diff(*b)).powi(2)).sum();
    let rms = (sum / (3 * shown.len()) as f64).sqrt();
    let flip = compared.flip.map_or("-".to_owned(), |flip| format!("{flip:.3}"));
    format!("  {flip} {rms:.1}")
}
