use glam::Vec3;

use super::*;
use crate::denoise;
use crate::path::{FirstHit, PathResult};
use crate::render::film::Film;
use crate::tone::{DAYLIGHT_KELVIN, Grade, ToneCurve, display_rgb8};

/// Of a device; `None`, which is said, where there is none.
pub(crate) fn developer() -> Option<Developer> {
    let developer = Developer::new(&Gpu::for_test()?);
    developer.inspect_err(|reason| eprintln!("SKIPPED: {reason}")).ok()
}

fn settings(tone: impl Into<Tone>, exposure_ev: f32) -> DevelopSettings {
    let tone = tone.into();
    let white_balance = WhiteBalance::default();
    DevelopSettings { white_balance, exposure_ev, tone, opacity: [0.0; 2] }
}

fn developed(
    developer: &Developer,
    picture: &LinearPicture,
    overlay: Option<&OverlayTexture>,
    settings: &DevelopSettings,
) -> Rgb8 {
    let display = DisplayTexture::new(&developer.gpu, picture.size());
    developer.develop(picture, overlay, settings, &display);
    developer.read(&display).expect("read back")
}

/// A number that looks random, in `[0,1)`.
fn noise(seed: u32) -> f32 {
    let mut x = seed.wrapping_mul(0x9e37_79b9) ^ 0x85eb_ca6b;
    x = (x ^ (x >> 16)).wrapping_mul(0x21f0_aaad);
    x = (x ^ (x >> 15)).wrapping_mul(0x735a_2d97);
    (x ^ (x >> 15)) as f32 / 4_294_967_296.0
}

/// Every pair of extreme channels, then ordinary colours from black to white-hot.
fn extremes() -> Image {
    const VALUES: [f32; 18] = [
        0.0,
        -0.0,
        f32::NAN,
        f32::INFINITY,
        f32::NEG_INFINITY,
        -1e-38,
        -1.0,
        -3e38,
        1.2e-38,
        1e-30,
        1e-10,
        1e-3,
        0.18,
        1.0,
        100.0,
        1e6,
        1e30,
        3e38,
    ];
    Image::from_fn(150, 97, |x, y| {
        let (i, count) = ((y * 150 + x) as usize, VALUES.len());
        if i < count * count * count {
            return [VALUES[i % count], VALUES[i / count % count], VALUES[i / count / count]];
        }
        std::array::from_fn(|c| (noise(3 * i as u32 + c as u32) * 30.0 - 18.0).exp2())
    })
}

/// Largest difference of two levels, and the share of them that differ.
fn difference(a: &Rgb8, b: &Rgb8) -> (u8, f64) {
    assert_eq!((a.width, a.height), (b.width, b.height));
    let pairs = || a.pixels.as_flattened().iter().zip(b.pixels.as_flattened());
    let most = pairs().map(|(a, b)| a.abs_diff(*b)).max().expect("pixels");
    (most, pairs().filter(|(a, b)| a != b).count() as f64 / pairs().count() as f64)
}

#[test]
fn pictures_are_those_of_the_cpu_within_one_level() {
    let Some(developer) = developer() else { return };
    let image = extremes();
    let picture = LinearPicture::of_image(&developer.gpu, &image);
    let balances = [(DAYLIGHT_KELVIN, 0.0), (2000.0, 0.0), (12000.0, -1.0), (3200.0, 1.0)];
    let graded = [("look:punchy", 1.0), ("look:black-and-white", 0.5)].map(|(name, strength)| {
        let lut = Lut::read(name).expect("a look");
        Tone { grade: Some(Grade { lut, strength }), ..Tone::default() }
    });
    let tones: Vec<Tone> = ToneCurve::ALL.into_iter().map(Tone::from).chain(graded).collect();
    for (kelvin, tint) in balances {
        let white_balance = WhiteBalance { kelvin, tint };
        let balanced = white_balance.apply(image.clone());
        for tone in &tones {
            for exposure_ev in [-120.0, -8.0, 0.0, 0.3, 8.0, 100.0, 300.0] {
                let settings =
                    DevelopSettings { white_balance, ..settings(tone.clone(), exposure_ev) };
                let found = developed(&developer, &picture, None, &settings);
                let expected = display_rgb8(&balanced, exposure_ev, tone.clone());
                let (most, share) = difference(&found, &expected);
                let worst = found
                    .pixels
                    .iter()
                    .zip(&expected.pixels)
                    .position(|(a, b)| a.iter().zip(b).any(|(a, b)| a.abs_diff(*b) > 1));
                let worst = worst.map(|i| (image.pixels[i], found.pixels[i], expected.pixels[i]));
                assert!(most <= 1, "{tone:?} {exposure_ev} EV {kelvin} K: {worst:?}");
                assert!(share < 0.005, "{tone:?} {exposure_ev} EV {kelvin} K: {share} differ");
            }
        }
    }
}

/// A film of few samples: two walls with an edge, sky above, noise everywhere, and pixels that show some of each.
fn film(width: u32, height: u32, samples: u32) -> Film {
    let mut film = Film::new(width, height, true);
    for y in 0..height {
        for x in 0..width {
            for sample in 0..samples {
                let seed = (y * width + x) * samples + sample;
                let [right, down] =
                    [7, 8].map(|number| (2.0 * noise((!seed).wrapping_mul(number))) as u32);
                let is_sky = y + down < height / 8;
                let is_left = x + right + y / 3 < width / 2;
                let normal = if is_left { Vec3::X } else { Vec3::new(0.6, 0.8, 0.0) };
                let albedo = if is_left { Vec3::new(0.8, 0.3, 0.1) } else { Vec3::splat(0.5) };
                let light = 8.0 * noise(seed).powi(6);
                let first_hit = FirstHit { albedo, normal, depth: 3.0 + 0.01 * x as f32 };
                let result = PathResult {
                    radiance: if is_sky { Vec3::new(0.5, 0.7, 1.0) } else { albedo * light },
                    rays: 1,
                    first_hit: (!is_sky).then_some(first_hit),
                    ..PathResult::default()
                };
                film.add(x, y, &result);
            }
        }
    }
    film
}

#[test]
fn films_give_their_means_and_the_exposure_of_the_cpu() {
    let Some(developer) = developer() else { return };
    let film = film(201, 77, 5);
    let picture = LinearPicture::of_film(&developer.gpu, &film, false);
    let settings = settings(ToneCurve::Agx, 0.5);
    let found = developed(&developer, &picture, None, &settings);
    let expected = display_rgb8(&film.image(), settings.exposure_ev, settings.tone.clone());
    assert!(difference(&found, &expected).0 <= 1);
    for kelvin in [DAYLIGHT_KELVIN, 3000.0] {
        let white_balance = WhiteBalance { kelvin, tint: 0.2 };
        let found = developer.shrunk(&picture, white_balance).expect("read back");
        let expected = white_balance.apply(film.image()).shrunk(EXPOSURE_WIDTH);
        assert_eq!((found.width, found.height), (expected.width, expected.height));
        for (a, b) in found.pixels.iter().zip(&expected.pixels) {
            let close = Vec3::from(*a).abs_diff_eq(Vec3::from(*b), 1e-5);
            assert!(close, "{a:?} {b:?}");
        }
        let found = developer.auto_exposure_ev(&picture, white_balance).expect("read back");
        assert!((found - auto_exposure_ev(&expected)).abs() < 1e-4);
    }
}

/// Rounding moves the estimate of a pixel's error, hence a little of its filtered radiance: by at
/// most a thousandth of it.
#[test]
fn the_filter_is_that_of_the_cpu() {
    let Some(developer) = developer() else { return };
    for samples in [1, 2, 7] {
        // So narrow that it is not made smaller.
        let film = film(EXPOSURE_WIDTH, 90, samples);
        let picture = developer.denoised(&LinearPicture::of_film(&developer.gpu, &film, true));
        let found = developer.shrunk(&picture, WhiteBalance::default()).expect("read back");
        let expected = denoise::quick(&film, None);
        assert_ne!(expected.pixels, film.image().pixels, "something was filtered");
        for (i, (found, expected)) in found.pixels.iter().zip(&expected.pixels).enumerate() {
            let (found, expected) = (Vec3::from(*found), Vec3::from(*expected));
            let error = (found - expected).length();
            assert!(error <= 1e-3 * expected.length() + 1e-6, "{i}: {found} {expected}");
        }
    }
}

#[test]
fn overlays_are_blended_and_the_rest_steps_back() {
    let Some(developer) = developer() else { return };
    let image = Image::from_fn(40, 30, |x, y| [x as f32 / 40.0, y as f32 / 30.0, 0.2]);
    let picture = LinearPicture::of_image(&developer.gpu, &image);
    let colors: Vec<_> =
        (0..1200_u32).map(|i| (i % 3 > 0).then_some([i as u8, (i / 7) as u8, 200])).collect();
    let overlay = OverlayTexture::of_colors(&developer.gpu, &colors, 40, &picture);
    let plain = settings(ToneCurve::None, 0.0);
    let under = developed(&developer, &picture, None, &plain);
    for opacity in [0.0, 0.35, 0.7, 1.0] {
        let opacity = [opacity, 0.6 * opacity];
        let settings = DevelopSettings { opacity, ..plain.clone() };
        let found = developed(&developer, &picture, Some(&overlay), &settings);
        for ((found, under), color) in found.pixels.iter().zip(&under.pixels).zip(&colors) {
            let share = opacity[usize::from(color.is_none())];
            let color = color.unwrap_or([24, 25, 28]);
            for c in 0..3 {
                let [under, over] = [under[c], color[c]].map(f32::from);
                let expected = (under + (over - under) * share).round() as u8;
                assert!(found[c].abs_diff(expected) <= 1, "{found:?} {expected}");
            }
        }
    }
}

#[test]
fn a_picture_too_large_for_the_device_becomes_smaller() {
    let Some(mut developer) = developer() else { return };
    developer.gpu.limits.max_texture_dimension_2d = 32;
    let picture = LinearPicture::of_film(&developer.gpu, &film(100, 40, 1), true);
    assert_eq!(picture.size(), [32, 12]);
    let colors = vec![Some([7, 8, 9]); 4000];
    let overlay = OverlayTexture::of_colors(&developer.gpu, &colors, 100, &picture);
    let settings = DevelopSettings { opacity: [1.0; 2], ..settings(ToneCurve::Agx, 0.0) };
    let found = developed(&developer, &picture, Some(&overlay), &settings);
    assert!(found.pixels.iter().all(|pixel| *pixel == [7, 8, 9]));
}
