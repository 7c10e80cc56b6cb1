//! Maps: densities integrate to 1, samples follow them, every lit point can be sampled, and a floor under the map
//! has the irradiance of f64 quadrature.

use std::f64::consts::{PI, TAU};

use glam::{DVec3, Vec2, Vec3};
use rayon::prelude::*;

use super::case::{Entry, On, Setting};
use super::outcome::Outcome;
use super::scenes::{SIGMAS, deviation, lambert, mean, render, view};
use crate::environment::{Environment, EnvironmentOptions, sky};
use crate::error::{Error, Notices, Result};
use crate::image::{Image, sanitise};
use crate::math::texel_solid_angle;
use crate::metrics::hypothesis::chi_square_test;
use crate::path::WorldBuilder;
use crate::render::film::Film;
use crate::render::{Sampling, View};
use crate::sampler::SplitMix;
use crate::scene::Camera;

pub(super) const CASES: &[Entry] = &[
    ("constant", On::Any, |s| check(s, Image::filled(64, 32, [0.25, 0.5, 2.0]))),
    ("black", On::Any, black),
    ("1x1", On::Any, |s| check(s, Image::filled(1, 1, [1.0; 3]))),
    ("2x1", On::Any, |s| check(s, Image::from_fn(2, 1, |x, _| [1.0 - x as f32, x as f32, 9.0]))),
    ("1xN", On::Any, |s| check(s, noise(1, 97, |u| u))),
    ("lit-at-the-seam", On::Any, |s| check(s, lit(64, 32, &[(0, 9), (63, 20)]))),
    ("lit-at-the-poles", On::Any, |s| check(s, lit(64, 32, &[(17, 0), (40, 31)]))),
    ("lit-at-the-corners", On::Any, |s| check(s, lit(64, 32, &[(0, 0), (63, 31)]))),
    ("sun-of-1e9", On::Any, |s| check(s, sun(96, 48, 1e9))),
    ("sun-of-1e-30", On::Any, |s| check(s, scaled(sun(96, 48, 1e9), 1e-39))),
    ("subnormal", On::Any, subnormal),
    ("half-overflow", On::Any, half_overflow),
    ("nan-inf-negative", On::Any, nan_inf_negative),
    ("extreme-contrast", On::Any, |s| check(s, noise(128, 64, |u| 10.0_f32.powf(60.0 * u - 30.0)))),
    ("16384-wide", On::Any, |s| check(s, noise(16_384, 24, |u| u * u))),
    ("8192-high", On::Any, |s| check(s, noise(24, 8192, |u| u * u))),
    ("16384x8192", On::Any, |s| large(s, "day", 16_384, 8192)),
    ("15000x7500", On::Any, |s| large(s, "sunset", 15_000, 7500)),
];

/// Random pixels: each channel is `f` of a uniform number.
fn noise(width: u32, height: u32, f: impl Fn(f32) -> f32) -> Image {
    let mut random = SplitMix(7);
    Image::from_fn(width, height, |_, _| [0; 3].map(|_| f(random.next_f32())))
}

fn lit(width: u32, height: u32, texels: &[(u32, u32)]) -> Image {
    let rgb = |is_lit: bool| if is_lit { [3.0, 2.0, 1.0] } else { [0.0; 3] };
    Image::from_fn(width, height, |x, y| rgb(texels.contains(&(x, y))))
}

/// A dim noisy sky with a sun of one texel above the horizon.
pub(super) fn sun(width: u32, height: u32, radiance: f32) -> Image {
    let mut map = noise(width, height, |u| u);
    map.pixels[(height / 4 * width + width / 3) as usize] = [radiance; 3];
    map
}

pub(super) fn scaled(mut map: Image, factor: f64) -> Image {
    for value in map.pixels.as_flattened_mut() {
        *value = (f64::from(*value) * factor) as f32;
    }
    map
}

/// A black map: no tile can be sampled, pictures are black, and no division by zero occurs.
fn black(setting: &Setting) -> Result<Outcome> {
    let map = Image::filled(40, 20, [0.0; 3]);
    let environment = Environment::new(map, &EnvironmentOptions::default())?;
    let mut random = SplitMix(1);
    let mut draw = |tile| environment.sample_in_tile(tile, random.next_words());
    let drawn = (0..environment.tile_count()).filter_map(&mut draw).count();
    let outcome =
        Outcome::default().at_most("tiles of a black map that can be sampled", drawn as f64, 0.0);
    let film = floor(setting, &environment, 4)?;
    Ok(outcome.sound(&film).at_most("light from a black map", mean(&film).luminance, 0.0))
}

/// Subnormal radiance, which f32 holds with few digits.
fn subnormal(setting: &Setting) -> Result<Outcome> {
    let map = noise(64, 32, |u| f32::from_bits((u * 4e6) as u32 + 1));
    if setting.gpu.is_some() {
        // WGSL allows devices to flush subnormal numbers to zero, and the map is packed to 8 bits of exponent:
        // black is correct there.
        let film = floor(setting, &Environment::new(map, &EnvironmentOptions::default())?, 16)?;
        let light = mean(&film).luminance;
        let what = "light from a map of at most 6e-39";
        return Ok(Outcome::default().sound(&film).at_most(what, light, 2e-38));
    }
    check(setting, map)
}

/// Infinite pixels, as a half-float file has for a sun above 65504: they are repaired and counted.
fn half_overflow(setting: &Setting) -> Result<Outcome> {
    let mut map = scaled(sun(64, 32, 1.0), 65_504.0);
    map.pixels[500] = [f32::INFINITY, 65_504.0, f32::INFINITY];
    repaired(setting, map, &["1 infinite"])
}

fn nan_inf_negative(setting: &Setting) -> Result<Outcome> {
    let mut map = sun(64, 32, 1e4);
    map.pixels[3] = [f32::NAN, 1.0, 2.0];
    map.pixels[70] = [f32::INFINITY, 1.0, 0.0];
    map.pixels[900] = [-1.0, f32::NEG_INFINITY, 0.5];
    map.pixels[901] = [0.5, -1e30, 0.5];
    repaired(setting, map, &["1 NaN", "1 infinite", "2 negative"])
}

/// The renderer refuses such a map; `sanitise`, which readers of files call, reports its repairs and makes it
/// valid.
fn repaired(setting: &Setting, mut map: Image, told: &[&str]) -> Result<Outcome> {
    let refused = Environment::new(map.clone(), &EnvironmentOptions::default()).is_err();
    let notices: Notices = sanitise(&mut map);
    let said: Vec<&str> = notices.iter().collect();
    let silent = told.iter().filter(|part| !said.iter().any(|s| s.contains(**part))).count();
    Ok(Outcome::default()
        .at_least("unrepaired map refused", f64::from(u8::from(refused)), 1.0)
        .at_most("repairs that are not told", silent as f64, 0.0)
        .and(check(setting, map)?))
}

/// Maps of a gigabyte.
fn large(setting: &Setting, name: &str, width: u32, height: u32) -> Result<Outcome> {
    if !setting.nightly {
        return Ok(Outcome::skipped("takes 3 GB and a minute: --nightly"));
    }
    check(setting, sky::build(name, width, height)?)
}

/// Rotation of the maps, by which tile edges, texel edges and the seam do not coincide.
const ROTATION: f32 = 1.2345;

/// Checks densities, samples, irradiance and a rendered floor.
fn check(setting: &Setting, map: Image) -> Result<Outcome> {
    let options = EnvironmentOptions { rotation_radians: ROTATION, ..Default::default() };
    let environment = Environment::new(map, &options)?;
    let (off, unreachable) = densities(&environment);
    let tiles = environment.tile_energies().iter().filter(|energy| **energy > 0.0).count();
    let outcome = Outcome::default()
        // f32 densities of up to 10,000 texels a tile, each rounded.
        .at_most(format!("densities of {tiles} tiles: integral off 1"), off, 2e-5)
        .at_most("lit points that no sample reaches", unreachable as f64, 0.0)
        .at_least("samples against density: p of chi-square", chi_square(&environment)?, 1e-5)
        .at_most("irradiance sampled: standard errors off", irradiance_error(&environment), SIGMAS);
    let film = floor(setting, &environment, setting.count(64, 1024))?;
    // The floor's texels are seen from 8 x 8 pixels in a thousandth of a radian.
    let expected = quadrature(&environment, DVec3::Y, false).dot(LUMINANCE) / PI;
    let off = deviation(mean(&film), expected, 1e-3);
    Ok(outcome.sound(&film).at_most("lit floor rendered: standard errors off", off, SIGMAS))
}

const LUMINANCE: DVec3 = DVec3::new(0.2126, 0.7152, 0.0722);

/// Worst deviation from 1 of a tile's integral, and lit points without density. A density is linear
/// along a patch both ways, so that its integral is its value in the middle times the solid angle.
fn densities(environment: &Environment) -> (f64, usize) {
    const PLACES: [(f32, f32); 5] = [(0.5, 0.5), (0.1, 0.2), (0.9, 0.3), (0.2, 0.8), (0.7, 0.9)];
    let brightest = environment.map().pixels.as_flattened().iter().copied().fold(0.0, f32::max);
    // Radiance too small for f32 beside the brightest is left to other samplers.
    let least = 1e-30 * brightest;
    let tiles = environment.tile_count() as usize;
    let (columns, rows) = environment.patch_grid();
    let (integrals, unreachable) = (0..rows)
        .into_par_iter()
        .fold(
            || (vec![0.0; tiles], 0),
            |(mut integrals, mut unreachable), y| {
                let solid_angle = f64::from(environment.patch_solid_angle(y));
                for x in 0..columns {
                    for (place, (dx, dy)) in PLACES.into_iter().enumerate() {
                        let at = environment.direction_in_patch((x, y), Vec2::new(dx, dy));
                        let (radiance, tile, pdf) = environment.radiance_and_tile_pdf(at);
                        if place == 0 {
                            integrals[tile as usize] += f64::from(pdf) * solid_angle;
                        }
                        let dark = environment.tile_energies()[tile as usize] <= 0.0;
                        let is_lit = radiance.max_element() > least;
                        unreachable += usize::from(is_lit && (pdf <= 0.0 || dark));
                    }
                }
                (integrals, unreachable)
            },
        )
        .reduce(
            || (vec![0.0; tiles], 0),
            |(mut a, count), (b, more)| {
                a.iter_mut().zip(b).for_each(|(a, b)| *a += b);
                (a, count + more)
            },
        );
    let lit = integrals.iter().zip(environment.tile_energies()).filter(|(_, e)| **e > 0.0);
    (lit.map(|(integral, _)| (integral - 1.0).abs()).fold(0.0, f64::max), unreachable)
}

/// p-value of samples against the reported densities, with equally many samples from each lit tile. Patches are
/// merged to at most 128 x 64 bins.
fn chi_square(environment: &Environment) -> Result<f64> {
    const SAMPLES: usize = 200_000;
    let (width, height) = environment.patch_grid();
    let (columns, rows) = (width.min(128), height.min(64));
    let bin = |(x, y): (u32, u32)| {
        let of =
            |i: u32, bins: u32, all: u32| (u64::from(i) * u64::from(bins) / u64::from(all)) as u32;
        (of(y, rows, height) * columns + of(x, columns, width)) as usize
    };
    let is_lit = |tile: &u32| environment.tile_energies()[*tile as usize] > 0.0;
    let lit: Vec<u32> = (0..environment.tile_count()).filter(is_lit).collect();
    let per_tile = SAMPLES / lit.len().max(1);
    let mut observed = vec![0.0; (columns * rows) as usize];
    let mut random = SplitMix(31);
    for tile in lit {
        for _ in 0..per_tile {
            let sample = environment.sample_in_tile(tile, random.next_words());
            let sample = sample.ok_or_else(|| Error::new("a lit tile gives no sample"))?;
            observed[bin(environment.patch_of(sample.direction))] += 1.0;
        }
    }
    let mut expected = vec![0.0; observed.len()];
    for y in 0..height {
        let solid_angle = f64::from(environment.patch_solid_angle(y));
        for x in 0..width {
            let at = environment.direction_in_patch((x, y), Vec2::splat(0.5));
            let (_, _, pdf) = environment.radiance_and_tile_pdf(at);
            expected[bin((x, y))] += f64::from(pdf) * solid_angle * per_tile as f64;
        }
    }
    if expected.iter().filter(|count| **count >= 5.0).count() < 2 {
        // A single bin: it must hold all samples.
        let missed: f64 = observed.iter().zip(&expected).map(|(o, e)| (o - e).abs()).sum();
        return Ok(if missed < 1e-3 * SAMPLES as f64 { 1.0 } else { 0.0 });
    }
    Ok(chi_square_test(&observed, &expected, 1e-5)?.p_value)
}

/// Error of an estimate of the irradiance on both sides of a tilted surface, in standard errors, in the worst
/// channel.
fn irradiance_error(environment: &Environment) -> f64 {
    const SAMPLES: u32 = 50_000;
    let normal = DVec3::new(-0.3, 0.6, -0.75).normalize();
    let exact = quadrature(environment, normal, true);
    let energies = environment.tile_energies();
    let mut sums = Vec::with_capacity(energies.len());
    let mut total = 0.0;
    for energy in energies {
        total += energy;
        sums.push(total);
    }
    let (mut sum, mut squares, mut random) = (DVec3::ZERO, DVec3::ZERO, SplitMix(2));
    for _ in 0..SAMPLES {
        let target = random.next_f64() * total;
        let tile = sums.partition_point(|sum| *sum <= target);
        let u = random.next_words();
        let Some(sample) = environment.sample_in_tile(tile as u32, u) else { continue };
        let cosine = sample.direction.as_dvec3().dot(normal).abs();
        let pdf = energies[tile] / total * f64::from(sample.pdf_solid_angle);
        let value =
            environment.sampled_radiance(&sample).as_dvec3() * cosine * f64::from(sample.weight)
                / pdf;
        sum += value;
        squares += value * value;
    }
    let count = f64::from(SAMPLES);
    let mean = sum / count;
    (0..3)
        .map(|c| {
            let variance = (squares[c] / count - mean[c] * mean[c]).max(0.0) / count;
            // Rounding of directions and densities to f32, and the quadrature's own error.
            let error = variance.sqrt().hypot(5e-4 * exact[c]);
            if mean[c] == exact[c] { 0.0 } else { (mean[c] - exact[c]).abs() / error }
        })
        // Unlike `max`, this keeps NaN.
        .fold(0.0, |worst, x| if x.is_nan() || x > worst { x } else { worst })
}

/// Irradiance in f64 by the midpoint rule, on one side of a surface or on both together, with about two million
/// points, or one for each texel of larger maps.
fn quadrature(environment: &Environment, normal: DVec3, both_sides: bool) -> DVec3 {
    let map = environment.map();
    let texels = f64::from(map.width) * f64::from(map.height);
    let fine = ((2e6 / texels).sqrt() as u32).clamp(1, 1024);
    let (columns, rows) = (map.width * fine, map.height * fine);
    let azimuths: Vec<(f64, f64)> = (0..columns)
        .map(|x| {
            let u = (f64::from(x) + 0.5) / f64::from(columns);
            ((u - 0.5) * TAU + f64::from(ROTATION)).sin_cos()
        })
        .collect();
    (0..rows)
        .into_par_iter()
        .map(|y| {
            let v = (f64::from(y) + 0.5) / f64::from(rows);
            let (sin_theta, cos_theta) = (v * PI).sin_cos();
            let solid_angle = texel_solid_angle(columns, rows, y);
            let at_v = v * f64::from(map.height) - 0.5;
            let mut sum = DVec3::ZERO;
            for (x, (sin, cos)) in (0..columns).zip(&azimuths) {
                let cosine = DVec3::new(sin_theta * cos, cos_theta, sin_theta * sin).dot(normal);
                let cosine = if both_sides { cosine.abs() } else { cosine.max(0.0) };
                if cosine > 0.0 {
                    let at_u = (f64::from(x) + 0.5) / f64::from(fine) - 0.5;
                    sum += bilinear(map, at_u, at_v) * (cosine * solid_angle);
                }
            }
            sum
        })
        .collect::<Vec<_>>()
        .into_iter()
        .sum()
}

/// Radiance between texel centres, in f64: linear in longitude (wrapped in u) and in the cosine of the
/// polar angle (clamped in v).
pub(super) fn bilinear(map: &Image, x: f64, y: f64) -> DVec3 {
    let y = y.clamp(0.0, f64::from(map.height - 1));
    let (left, top) = (x.floor(), y.floor());
    let cosine = |row: f64| (PI * (row + 0.5) / f64::from(map.height)).cos();
    // There is no row below the last one.
    let is_last = top >= f64::from(map.height - 1);
    let down = (cosine(top) - cosine(y)) / (cosine(top) - cosine(top + 1.0));
    let down = if is_last { 0.0 } else { down };
    let across = x - left;
    let column = |i: i64| i.rem_euclid(i64::from(map.width)) as u32;
    let (a, b) = (column(left as i64), column(left as i64 + 1));
    let (above, below) = (top as u32, (top as u32 + 1).min(map.height - 1));
    let at = |x, y| DVec3::from(map.at(x, y).map(f64::from));
    let upper = at(a, above) * (1.0 - across) + at(b, above) * across;
    let lower = at(a, below) * (1.0 - across) + at(b, below) * across;
    upper * (1.0 - down) + lower * down
}

/// A white floor under the map, on the device under test.
fn floor(setting: &Setting, environment: &Environment, samples: u32) -> Result<Film> {
    let world = WorldBuilder::default().floor(&lambert(1.0), Vec3::ZERO, 10.0).build();
    let camera = Camera::look_at(Vec3::new(0.3, 1.0, 0.2), Vec3::ZERO, 1e-3);
    let view = View { width: 8, height: 8, ..view(camera, Sampling::Plain, 1) };
    render(setting, (&world, environment), view, samples)
}
