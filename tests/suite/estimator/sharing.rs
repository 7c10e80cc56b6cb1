//! Second vertices shared between pixels: the same picture, only sooner.

use std::sync::OnceLock;
use std::sync::atomic::AtomicBool;

use glam::Vec3;
use lightgrid::environment::{Environment, EnvironmentOptions, sky};
use lightgrid::light_grid::LightGrid;
use lightgrid::light_grid::cells::SphericalGrid;
use lightgrid::metrics::relative_rms_error;
use lightgrid::path::{PathLimits, World};
use lightgrid::render::film::{Film, Pixel};
use lightgrid::render::{Sampling, Session, Sharing, View};
use lightgrid::sampler::{hash, unit_from_bits};
use lightgrid::scene::{
    AlphaMode, Camera, Material, Medium, Scene, Texture, TextureImage, TextureRef, TextureSlot,
    Wrap, builtin,
};
use rayon::prelude::*;

use super::scenes::{black, blended, lambert, lamp, painted, pane, room, varnish};
use super::{environment, mean, view};
use crate::z_test::{Mean, pixels, z_test};

const SHARED: [Sharing; 2] = [Sharing::Small, Sharing::Large];

/// A picture that begins and ends in the middle of a tile.
fn picture(camera: &Camera, sampling: Sampling, sharing: Sharing, seed: u32) -> View {
    View {
        width: 27,
        height: 21,
        seed,
        sharing,
        limits: PathLimits { bounces: 4, russian_roulette: true },
        ..view(camera.clone(), sampling, 4)
    }
}

fn render(world: &World, environment: &Environment, view: View, samples: u32) -> Film {
    let mut session = super::learned(world, environment, view);
    session.advance(samples, &AtomicBool::new(false)).expect("the CPU does not fail");
    session.film().clone()
}

/// Pictures of one view, each with a seed of its own.
struct Pictures(Vec<Film>);

impl Pictures {
    fn of_seeds(seeds: u32, picture: impl Fn(u32) -> Film + Send + Sync) -> Self {
        Self((0..seeds).into_par_iter().map(picture).collect())
    }

    /// Mean of the pictures' means, and its standard error: pixels that share vary together, so their own spread does
    /// not tell it.
    fn mean(&self) -> (f64, f64) {
        let means: Vec<f64> = self.0.iter().map(|film| mean(film).luminance).collect();
        let count = means.len() as f64;
        let mean = means.iter().sum::<f64>() / count;
        let variance = means.iter().map(|m| (m - mean).powi(2)).sum::<f64>() / (count - 1.0);
        (mean, (variance / count).sqrt())
    }

    /// Mean luminance of each pixel over the pictures, and the variance of that, which is at least as [`pixels`] has it.
    fn pixels(&self) -> Vec<Mean> {
        let count = self.0.len() as f64;
        let of_films: Vec<Vec<Mean>> = self.0.iter().map(pixels).collect();
        let pixel = |i: usize| {
            let of_pixel = of_films.iter().map(|film| film[i]);
            of_pixel.fold((0.0, 0.0), |(mean, variance), (of_mean, of_variance)| {
                (mean + of_mean / count, variance + of_variance / count.powi(2))
            })
        };
        (0..of_films[0].len()).map(pixel).collect()
    }
}

/// A world, the map above it and where it is seen from.
type Place<'a> = (&'a World, &'a Environment, &'a Camera);

/// Asserts that sharing changes no pixel's expectation, and none of the picture's mean, whose error over so
/// many seeds is below `precision`.
fn expect_unbiased(what: &str, (world, map, camera): Place<'_>, seeds: u32, precision: f64) {
    let pictures = |sharing, first: u32| {
        Pictures::of_seeds(seeds, |seed| {
            render(world, map, picture(camera, Sampling::Plain, sharing, first + seed), 32)
        })
    };
    let alone = pictures(Sharing::Off, 1000);
    let (mean_alone, error_alone) = alone.mean();
    for (seed, sharing) in (2..).zip(SHARED) {
        let shared = pictures(sharing, 2000 * seed);
        let test = z_test(&alone.pixels(), &shared.pixels(), 1e-3);
        assert!(test.passed(), "{what}, {sharing:?}: {test:?}");
        let (mean, error) = shared.mean();
        let (off, noise) = (mean / mean_alone - 1.0, error.hypot(error_alone) / mean_alone);
        eprintln!("{what}, {sharing:?}: {:+.3} % +- {:.3}", 100.0 * off, 100.0 * noise);
        assert!(noise < precision, "{what}, {sharing:?}: {noise} is too noisy to tell");
        assert!(off.abs() < 4.0 * noise, "{what}, {sharing:?}: {off} +- {noise}");
    }
}

fn overcast() -> Environment {
    environment(sky::build("overcast", 64, 32).expect("a sky"))
}

/// The same scene with its materials and normals changed.
fn changed(world: &World, change: impl FnOnce(&mut Scene)) -> World {
    let mut scene = world.scene.clone();
    change(&mut scene);
    World::new(scene)
}

#[test]
fn in_a_room_open_glazed_and_behind_leaves() {
    let leaf = |material: Material| Material { double_sided: true, ..material };
    let cloth = Material {
        diffuse_transmission: 0.6,
        diffuse_transmission_color: Vec3::new(0.9, 0.8, 0.6),
        ..leaf(lambert(0.8))
    };
    for (what, window, seeds) in [
        ("open", None, 48),
        ("pane", Some(pane()), 48),
        ("veil", Some(blended(leaf(lambert(0.6)), 0.4)), 48),
        ("cloth", Some(cloth), 80),
    ] {
        let (world, camera) = room(0.7, window.as_ref());
        expect_unbiased(what, (&world, &overcast(), &camera), seeds, 0.006);
    }
    // Nothing at all is there, but rays meet it.
    let masked = Material {
        alpha_mode: AlphaMode::Mask { cutoff: 0.5 },
        ..leaf(blended(lambert(0.6), 0.4))
    };
    let (open, camera) = room(0.7, None);
    for nothing in [masked, blended(leaf(lambert(0.6)), 0.0)] {
        for sharing in SHARED {
            let film = |world| {
                render(world, &overcast(), picture(&camera, Sampling::Plain, sharing, 5), 16)
            };
            assert!(film(&room(0.7, Some(&nothing)).0).pixels() == film(&open).pixels());
        }
    }
}

#[test]
fn where_normals_are_bent_and_metal_is_bumpy() {
    let (world, camera) = room(0.7, None);
    for (what, metallic, roughness) in
        [("matte", 0.0, 1.0), ("metal", 1.0, 0.35), ("both", 0.5, 0.2)]
    {
        let world = changed(&world, |scene| {
            for material in &mut scene.materials {
                *material = Material { metallic, roughness, specular: 1.0, ..material.clone() };
            }
            // Up to some 70 degrees off.
            let random = |n: u32| unit_from_bits(hash(n)) - 0.5;
            let positions = scene.positions.len() as u32;
            let mut normals = vec![Vec3::ZERO; scene.positions.len()];
            for corners in &scene.triangles {
                let [a, b, c] = corners.map(|i| scene.positions[i as usize]);
                let normal = (b - a).cross(c - a).normalize();
                for &i in corners {
                    let tilt = Vec3::from_array([0, 1, 2].map(|k| random(i + k * positions)));
                    normals[i as usize] = (normal + 3.0 * tilt).normalize();
                }
            }
            scene.normals = normals;
        });
        expect_unbiased(what, (&world, &overcast(), &camera), 24, 0.01);
    }
}

/// The room with normal maps on paint and varnish that tilt by up to some 40 degrees, each its own way.
fn bumpy(paint: &Material) -> (World, Camera) {
    let (world, camera) = painted(paint);
    let world = changed(&world, |scene| {
        let texel = |n: u32| [0, 1, 2, 3].map(|k| (hash(4 * n + k) >> 24) as u8);
        for first in [0, 64] {
            let texels = (first..first + 64).map(|n| {
                let [x, y, ..] = texel(n);
                [x, y, 240, 255]
            });
            let texels = texels.collect::<Vec<_>>().into();
            scene.images.push(TextureImage { width: 8, height: 8, texels });
            let (image, wrap) = (scene.textures.len() as u32, Wrap::Repeat);
            let texture = Texture { image, wrap_u: wrap, wrap_v: wrap, nearest: true, srgb: false };
            scene.textures.push(texture);
        }
        for material in &mut scene.materials {
            let slots = [TextureSlot::Normal, TextureSlot::ClearcoatNormal];
            *material = slots.into_iter().zip(0..).fold(material.clone(), |material, (slot, n)| {
                let transform = glam::Affine2::IDENTITY;
                material.with_texture(slot, TextureRef { texture: n, uv_set: 0, transform })
            });
        }
        scene.tangents = vec![glam::Vec4::ZERO; scene.positions.len()];
        for corners in &scene.triangles {
            let [a, b, _] = corners.map(|i| scene.positions[i as usize]);
            let tangent = (b - a).normalize().extend(1.0);
            corners.iter().for_each(|&i| scene.tangents[i as usize] = tangent);
        }
    });
    (world, camera)
}

#[test]
fn where_surfaces_are_polished_or_varnished() {
    for (what, paint) in [
        ("polish", varnish(0.1, 1.0)),
        ("varnish", varnish(0.4, 0.1)),
        ("mirrors over paint", varnish(1.0, 0.0)),
        ("polish under a broad coat", varnish(0.05, 0.4)),
    ] {
        let (world, camera) = painted(&paint);
        expect_unbiased(what, (&world, &overcast(), &camera), 24, 0.01);
    }
    for (what, paint) in [("bumpy polish", varnish(0.1, 1.0)), ("bumpy varnish", varnish(0.5, 0.3))]
    {
        let (world, camera) = bumpy(&paint);
        expect_unbiased(what, (&world, &overcast(), &camera), 24, 0.01);
    }
}

/// What is under the polish is shared.
#[test]
fn polish_and_varnish_keep_what_sharing_gains() {
    for (what, paint) in [("polish", varnish(0.1, 1.0)), ("varnish", varnish(0.4, 0.1))] {
        let (world, camera) = painted(&paint);
        let film = |sharing, seed, samples| {
            let view = picture(&camera, Sampling::Adaptive, sharing, seed);
            render(&world, &overcast(), view, samples)
        };
        let truth = film(Sharing::Off, 1, 1024).image();
        let error = |sharing| -> f64 {
            let of = |seed| {
                let film: Film = film(sharing, seed, 32);
                relative_rms_error(&film.image(), &truth).expect("of a size, and not black").powi(2)
            };
            (10..18).map(of).sum::<f64>() / 8.0
        };
        let gain = error(Sharing::Off) / error(Sharing::Large);
        eprintln!("{what}: variance / {gain:.2}");
        assert!(gain > 1.3, "{what}: {gain}");
    }
}

#[test]
fn with_a_lamp_and_wires() {
    let (world, camera) = room(0.7, None);
    let world = changed(&world, |scene| {
        let first = scene.materials.len() as u32;
        scene.materials.extend([lamp(5.0), black(), lambert(0.9)]);
        let mut quad = |material: u32, corner: Vec3, a: Vec3, b: Vec3| {
            let start = scene.positions.len() as u32;
            scene.positions.extend([corner, corner + a, corner + a + b, corner + b]);
            scene.uvs[0].extend([glam::Vec2::ZERO; 4]);
            scene.triangles.extend([[0, 1, 2], [0, 2, 3]].map(|t| t.map(|i: u32| start + i)));
            scene.triangle_materials.extend([first + material; 2]);
        };
        quad(0, Vec3::new(0.0, 2.4, 0.0), Vec3::X * 0.4, Vec3::Z * 0.4);
        for wire in 0..12 {
            let corner = Vec3::new(0.2, 0.1 + 0.15 * wire as f32, -1.0);
            quad(1 + wire % 2, corner, Vec3::Y * 0.012, Vec3::Z * 1.8);
        }
    });
    expect_unbiased("lamp and wires", (&world, &overcast(), &camera), 48, 0.006);
}

#[test]
fn in_fog_of_all_kinds() {
    let (world, camera) = room(0.7, None);
    let below = Some([Vec3::splat(-9.0), Vec3::new(9.0, 1.3, 9.0)]);
    let haze = Medium { scattering: Vec3::splat(0.3), anisotropy: 0.6, ..Medium::default() };
    let smoke = Medium {
        scattering: Vec3::ZERO,
        absorption: Vec3::new(0.1, 0.3, 0.9),
        ..Medium::default()
    };
    let coloured = Medium {
        scattering: Vec3::new(0.1, 0.4, 1.2),
        absorption: Vec3::new(0.3, 0.0, 0.1),
        anisotropy: -0.4,
        bounds: below,
    };
    for (what, medium) in [("haze", haze), ("smoke", smoke), ("coloured, below", coloured)] {
        let world = changed(&world, |scene| scene.medium = Some(medium));
        expect_unbiased(what, (&world, &overcast(), &camera), 24, 0.01);
    }
}

#[test]
fn in_scenes_of_all_kinds() {
    for (name, map) in [
        ("materials", "overcast"),
        ("living-room", "overcast"),
        ("exterior", "sunset"),
        ("fog", "day"),
    ] {
        let world = World::new(builtin::build(name).expect("a scene"));
        let map = sky::build(map, 256, 128).expect("a sky");
        let map = Environment::new(map, &EnvironmentOptions::default()).expect("a sound map");
        expect_unbiased(name, (&world, &map, &world.scene.cameras[0]), 12, 0.01);
    }
}

#[test]
fn a_cancelled_pass_and_threads_change_nothing() {
    let (world, camera) = room(0.7, None);
    let environment = overcast();
    let view = picture(&camera, Sampling::Adaptive, Sharing::Large, 5);
    let whole = render(&world, &environment, view.clone(), 7);
    let mut session = super::learned(&world, &environment, view.clone());
    for samples in [3, 4] {
        session.advance(samples, &AtomicBool::new(true)).expect("the CPU does not fail");
        session.advance(samples, &AtomicBool::new(false)).expect("the CPU does not fail");
    }
    let one = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a pool");
    let alone = one.install(|| render(&world, &environment, view, 7));
    assert_eq!(alone, whole);
    assert_eq!(session.film().pixels(), whole.pixels());
}

/// The room with a pane under an overcast sky, nearly without noise.
fn behind_a_pane() -> &'static Film {
    static FILM: OnceLock<Film> = OnceLock::new();
    FILM.get_or_init(|| {
        let (world, camera) = room(0.7, Some(&pane()));
        let view = picture(&camera, Sampling::Plain, Sharing::Off, 1);
        render(&world, &overcast(), view, 1 << 13)
    })
}

/// Error times samples does not rise: there is no floor of bias below the noise.
#[test]
fn the_error_has_no_floor() {
    let (world, camera) = room(0.7, Some(&pane()));
    let environment = overcast();
    let reference = behind_a_pane();
    let error = |samples: u32| -> f64 {
        let film = render(
            &world,
            &environment,
            picture(&camera, Sampling::Plain, Sharing::Large, 2),
            samples,
        );
        let pixels = film.pixels().iter().zip(reference.pixels());
        let of = |(a, b): (&Pixel, &Pixel)| {
            let difference =
                (a.mean_luminance() - b.mean_luminance()).powi(2) - b.variance_of_mean();
            difference / b.mean_luminance().powi(2)
        };
        pixels.map(of).sum::<f64>() / film.pixels().len() as f64
    };
    let (few, many) = (error(64), error(2048));
    eprintln!("error {few:.2e} of 64 samples, {many:.2e} of 2048");
    assert!(many * 2048.0 < 1.5 * few * 64.0, "{many} of 2048 samples, {few} of 64");
}

/// What was learned does not matter for what is shared either.
#[test]
fn with_garbage_in_place_of_what_was_learned() {
    let (world, camera) = room(0.7, Some(&pane()));
    let map = overcast();
    let garbage = |seed| {
        let center = camera.world_from_camera.translation.into();
        let grid = SphericalGrid { center, columns: 32, rows: 16, faces: true, medium: false };
        LightGrid::with_garbage_distributions(grid, map.tile_energies(), seed).expect("light")
    };
    let means = |sharing, first: u32, is_garbage: bool| {
        let pictures = Pictures::of_seeds(48, |seed| {
            let view = picture(&camera, Sampling::Plain, sharing, first + seed);
            let mut session = Session::new(&world, &map, view);
            if is_garbage {
                session.set_grid(garbage(first + seed)).expect("the CPU does not fail");
            }
            session.advance(32, &AtomicBool::new(false)).expect("the CPU does not fail");
            session.film().clone()
        });
        pictures.mean()
    };
    let (alone, error_alone) = means(Sharing::Off, 1000, false);
    for (first, sharing) in (2..).map(|i| 1000 * i).zip(SHARED) {
        let (found, error) = means(sharing, first, true);
        let (off, noise) = (found / alone - 1.0, error.hypot(error_alone) / alone);
        eprintln!("{sharing:?}: {:+.3} % +- {:.3}", 100.0 * off, 100.0 * noise);
        assert!(noise < 0.01, "{sharing:?}: {noise} is too noisy to tell");
        assert!(off.abs() < 4.0 * noise, "{sharing:?}: {off} +- {noise}");
    }
}

/// Pixels that share vary together; each pixel's own samples do not, and they tell its noise.
#[test]
fn the_noise_is_told_as_it_is() {
    let (world, camera) = room(0.7, Some(&pane()));
    let environment = overcast();
    let film = |sharing, seed, samples| {
        let view = picture(&camera, Sampling::Plain, sharing, seed);
        render(&world, &environment, view, samples)
    };
    let truth = behind_a_pane().image();
    let error = |film: &Film| {
        relative_rms_error(&film.image(), &truth).expect("of a size, and not black").powi(2)
    };
    for sharing in [Sharing::Off, Sharing::Small, Sharing::Large] {
        let films: Vec<Film> = (10..26).map(|seed| film(sharing, seed, 32)).collect();
        let root = |of: &dyn Fn(&Film) -> f64| {
            (films.iter().map(of).sum::<f64>() / films.len() as f64).sqrt()
        };
        let (told, found) = (root(&|film| film.noise().powi(2)), root(&error));
        eprintln!("{sharing:?}: {told:.4} told, {found:.4} found");
        // Points of a sequence avoid each other: there is less noise than the samples' spread tells.
        assert!(found < 1.05 * told && told < 1.6 * found, "{sharing:?}: {told} for {found}");
    }
}
