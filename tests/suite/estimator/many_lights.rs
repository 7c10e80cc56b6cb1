//! Many lamps, of which each vertex samples one.

use std::f64::consts::PI;

use glam::Vec3;
use lightgrid::path::{World, WorldBuilder};
use lightgrid::render::film::Pixel;
use lightgrid::render::{Sampling, View};
use lightgrid::sampler::SplitMix;
use lightgrid::scene::{Camera, Material, PunctualKind, PunctualLight};

use super::scenes::{lambert, lamp, sunlight, unlit};
use super::unbiased::expect_agreement;
use super::{constant, expect, probe, render, view};

/// Directions that spread evenly over the upper hemisphere, the horizon left out.
fn over_hemisphere(count: u32) -> impl Iterator<Item = Vec3> {
    (0..count).map(move |i| {
        let height = 0.1 + 0.88 * (i as f32 + 0.5) / count as f32;
        let (sin, cos) = (2.399_963_2 * i as f32).sin_cos();
        let radius = (1.0 - height * height).sqrt();
        Vec3::new(radius * cos, height, radius * sin)
    })
}

/// Irradiance of the floor at the origin from a one-sided parallelogram.
fn panel_irradiance(radiance: f64, corner: Vec3, a: Vec3, b: Vec3) -> f64 {
    const STEPS: u32 = 8;
    let normal = a.cross(b).as_dvec3();
    let step = |i: u32| (f64::from(i) + 0.5) / f64::from(STEPS);
    let mut sum = 0.0;
    for (i, j) in (0..STEPS).flat_map(|i| (0..STEPS).map(move |j| (i, j))) {
        let place = corner.as_dvec3() + a.as_dvec3() * step(i) + b.as_dvec3() * step(j);
        let squared = place.length_squared();
        sum += place.y * (-normal.dot(place)).max(0.0) / (squared * squared);
    }
    radiance * sum / f64::from(STEPS * STEPS)
}

#[test]
fn lamps_of_all_kinds_light_by_their_sum() {
    let mut random = SplitMix(5);
    let mut between = |low: f32, high: f32| low + (high - low) * random.next_f32();
    let floor = || WorldBuilder::default().floor(&lambert(0.6), [0.0; 3], 10.0);
    // The sun is overhead, where no lamp is.
    let mut stages = [floor(), floor().light(sunlight(Vec3::NEG_Y, 5.0))];
    let mut irradiance = 0.0;
    for (i, direction) in over_hemisphere(450).enumerate() {
        let distance = between(1.0, 4.0);
        let place = direction * distance;
        let strength = 10.0_f32.powf(between(-2.0, 1.0));
        let point = PunctualLight { position: place, ..sunlight(-direction, strength) };
        let falloff = f64::from(strength * direction.y / (distance * distance));
        let mut add = |to: &dyn Fn(WorldBuilder) -> WorldBuilder| {
            stages = std::mem::take(&mut stages).map(to);
        };
        match i % 6 {
            0 => {
                let kind = PunctualKind::Point;
                add(&|builder| builder.light(PunctualLight { kind, ..point.clone() }));
                irradiance += falloff;
            }
            1 => {
                // Every other one looks away.
                let looks_away = i % 12 == 1;
                let kind = PunctualKind::Spot { inner_radians: 0.2, outer_radians: 0.5 };
                let direction = if looks_away { direction } else { -direction };
                add(&|builder| builder.light(PunctualLight { kind, direction, ..point.clone() }));
                irradiance += if looks_away { 0.0 } else { falloff };
            }
            _ => {
                let tilt = Vec3::new(between(-0.5, 0.5), between(-0.5, 0.5), 0.2);
                let a = 0.06 * (direction + tilt).any_orthonormal_vector();
                let b = a.cross(direction + tilt).normalize() * 0.06;
                let material = Material { double_sided: i % 6 == 2, ..lamp(100.0 * strength) };
                add(&|builder| builder.quad(&material, place, a, b));
                let front = panel_irradiance(100.0 * f64::from(strength), place, a, b);
                let back = panel_irradiance(100.0 * f64::from(strength), place, b, a);
                irradiance += front + if material.double_sided { back } else { 0.0 };
            }
        }
    }
    let view = view(probe([0.1, 0.5, 0.15], [0.0; 3]), Sampling::Plain, 1);
    for (builder, sun) in stages.into_iter().zip([0.0, 5.0]) {
        let film = render(&builder.build(), &constant(0.0), view.clone(), 1024);
        expect(&format!("sun {sun}"), &film, 0.6 / PI * (irradiance + sun), 0.01);
    }
}

/// The density of what is hit is that of what is sampled: lamps that are sampled and lamps that are
/// only hit light the same.
#[test]
fn sampled_lamps_agree_with_lamps_that_are_found() {
    let shiny = Material { metallic: 1.0, roughness: 0.4, ..lambert(0.8) };
    for (floor, precision) in [(lambert(0.6), 0.03), (shiny, 0.03)] {
        let film = |material: &Material, seed| {
            let mut builder = WorldBuilder::default().floor(&floor, [0.0; 3], 10.0);
            for (i, direction) in over_hemisphere(80).enumerate() {
                let a = 0.25 * direction.any_orthonormal_vector();
                let b = a.cross(direction);
                let place = direction * (1.5 + (i % 3) as f32);
                builder = builder.quad(material, place - 0.5 * (a + b), a, b);
            }
            let camera = Camera::look_at(Vec3::new(0.3, 1.0, 0.8), Vec3::ZERO, 0.8);
            let view = View { seed, ..view(camera, Sampling::Plain, 1) };
            render(&builder.build(), &constant(0.0), view, 2048)
        };
        let one_sided = Material { double_sided: false, ..lamp(0.9) };
        let found = film(&unlit(0.9), 1);
        expect_agreement("one side", &found, &film(&one_sided, 2), precision);
        expect_agreement("both sides", &found, &film(&lamp(0.9), 3), precision);
    }
}

/// A hall of 60 x 20 metres with lamps below its ceiling, whose powers differ by a factor of 1000:
/// panels of a hand's size that look down or aside, and in every fourth place a point.
fn hall(lamps: u32) -> (World, Camera) {
    let mut random = SplitMix(lamps.into());
    let mut between = |low: f32, high: f32| low + (high - low) * random.next_f64() as f32;
    let (low, high) = (Vec3::new(-30.0, 0.0, -10.0), Vec3::new(30.0, 6.0, 10.0));
    let mut builder = WorldBuilder::default().faces(&lambert(0.6), low, high, 2..6);
    for index in 0..lamps {
        let place = Vec3::new(between(-29.0, 29.0), between(4.5, 5.8), between(-9.5, 9.5));
        let power = 20_000.0 / lamps as f32 * 10.0_f32.powf(between(-2.0, 1.0));
        if index % 4 == 3 {
            builder = builder.light(PunctualLight {
                kind: PunctualKind::Point,
                position: place,
                ..sunlight(Vec3::NEG_Y, power / (4.0 * std::f32::consts::PI))
            });
        } else {
            let side = Vec3::new(between(-1.0, 1.0), 0.0, between(-1.0, 1.0)).normalize();
            let across = side.cross(Vec3::new(between(-0.3, 0.3), 1.0, between(-0.3, 0.3)));
            let radiance = power / (std::f32::consts::PI * 0.01);
            let material = Material { double_sided: false, ..lamp(radiance) };
            builder = builder.quad(&material, place, 0.1 * side, 0.1 * across.normalize());
        }
    }
    let eye = Vec3::new(-27.0, 1.7, -6.0);
    (builder.build(), Camera::look_at(eye, Vec3::new(0.0, 1.5, 2.0), 0.9))
}

/// Half of the pixels have a relative variance of 0.19 a sample or less; of 8.9 by power alone.
#[test]
fn a_hall_of_5000_lamps_takes_few_samples() {
    let (world, camera) = hall(5000);
    let film = render(&world, &constant(0.01), view(camera, Sampling::Plain, 1), 64);
    let relative = |p: &Pixel| 64.0 * p.variance_of_mean() / p.mean_luminance().powi(2);
    let mut variances: Vec<f64> = film.pixels().iter().map(relative).collect();
    variances.sort_by(f64::total_cmp);
    let median = variances[variances.len() / 2];
    eprintln!("{median:.3}");
    assert!(median < 0.3, "{median}");
}
