//! Memory stays within its budget, and odd input gives a sensible picture.

use glam::Vec3;
use lightgrid::environment::{Environment, EnvironmentOptions, sky};
use lightgrid::image::Image;
use lightgrid::light_grid::MEMORY_BUDGET_BYTES;
use lightgrid::path::{World, WorldBuilder};
use lightgrid::render::{Sampling, View};
use lightgrid::scene::{Camera, builtin};

use super::scenes::{lambert, room};
use super::{MODES, environment, expect, expect_same_mean, learned, mean, render, view};

fn is_black(film: &lightgrid::render::film::Film) -> bool {
    assert_eq!(film.invalid_samples(), 0);
    film.pixels().iter().all(|p| p.mean() == [0.0; 3])
}

#[test]
fn learning_stays_within_the_budget_in_every_scene() {
    let environment = environment(sky::build("day", 1024, 512).expect("a sky"));
    for name in builtin::names() {
        let world = World::new(builtin::build(name).expect("a scene"));
        let camera = world.scene.cameras[0].clone();
        let view = View {
            width: 64,
            height: 36,
            learning_paths: 1 << 17,
            ..view(camera, Sampling::Adaptive, 4)
        };
        let session = learned(&world, &environment, view);
        let figures = session.figures();
        eprintln!(
            "{name}: peak {} B, then {} B, {} of {} cells",
            figures.grid_peak_bytes,
            figures.grid_bytes,
            figures.learned_cells,
            figures.visited_cells
        );
        assert_eq!(figures.learning_paths, 1 << 17);
        assert!(figures.learned_cells > 0, "{name}: {figures:?}");
        assert!(figures.grid_peak_bytes <= MEMORY_BUDGET_BYTES, "{name}: {figures:?}");
        assert!(figures.grid_bytes <= figures.grid_peak_bytes, "{name}: {figures:?}");
    }
}

#[test]
fn a_fine_grid_and_many_tiles_stay_within_the_budget() {
    let (world, camera) = room(0.7, None);
    for (grid_columns, tiles) in [(512, 32), (2, 256), (128, 128)] {
        let options =
            EnvironmentOptions { tile_columns: tiles, tile_rows: tiles, ..Default::default() };
        let map = sky::build("day", 512, 256).expect("a sky");
        let environment = Environment::new(map, &options).expect("a sound map");
        for sampling in [Sampling::Talk, Sampling::Adaptive] {
            let view = View { grid_columns, ..view(camera.clone(), sampling, 3) };
            let session = learned(&world, &environment, view);
            let figures = session.figures();
            assert!(figures.grid_peak_bytes <= MEMORY_BUDGET_BYTES, "{tiles} tiles: {figures:?}");
        }
    }
}

#[test]
fn a_sealed_room_learns_nothing_and_is_black() {
    let (low, high) = (Vec3::splat(-1.0), Vec3::ONE);
    let world = WorldBuilder::default().faces(&lambert(0.8), low, high, 0..6).build();
    let camera = Camera::look_at(Vec3::ZERO, Vec3::new(0.5, -0.2, -1.0), 1.0);
    let environment = environment(sky::build("day", 128, 64).expect("a sky"));
    for sampling in [Sampling::Talk, Sampling::Adaptive] {
        let view = view(camera.clone(), sampling, 4);
        let figures = learned(&world, &environment, view.clone()).figures();
        assert!(figures.visited_cells > 0);
        assert_eq!(figures.learned_cells, 0, "{sampling:?}");
        assert!(is_black(&render(&world, &environment, view, 8)), "{sampling:?}");
    }
}

#[test]
fn a_black_map_is_black_without_shadow_rays() {
    let (world, camera) = room(0.7, None);
    for sampling in MODES {
        let view = view(camera.clone(), sampling, 4);
        let environment = environment(Image::filled(8, 4, [0.0; 3]));
        let mut session = learned(&world, &environment, view);
        session
            .advance(8, &std::sync::atomic::AtomicBool::new(false))
            .expect("the CPU does not fail");
        let figures = session.figures();
        assert!(is_black(session.film()), "{sampling:?}");
        assert_eq!(figures.learning_rays, 0, "{sampling:?}: there is nothing to learn");
        assert!(figures.rays <= 5 * figures.samples, "{sampling:?}: {figures:?}");
    }
}

#[test]
fn the_smallest_maps_light_alike_in_every_mode() {
    let (world, camera) = room(0.7, None);
    for (width, height) in [(1, 1), (2, 1), (3, 2)] {
        let map = Image::from_fn(width, height, |x, y| [1.0 + x as f32 + 3.0 * y as f32; 3]);
        let environment = environment(map);
        let film = |sampling, seed| {
            render(&world, &environment, View { seed, ..view(camera.clone(), sampling, 2) }, 512)
        };
        let reference = film(Sampling::Bsdf, 0);
        for (seed, mode) in (1..).zip([Sampling::Plain, Sampling::Talk, Sampling::Adaptive]) {
            expect_same_mean(
                &format!("{width}x{height} {mode:?}"),
                &reference,
                &film(mode, seed),
                0.06,
            );
        }
    }
}

#[test]
fn one_pixel_maps_are_uniform_light() {
    let world = WorldBuilder::default().sphere(&lambert(0.8), Vec3::ZERO, 1.0).build();
    let camera = Camera::look_at(Vec3::new(1.0, 2.0, 3.0), Vec3::ZERO, 0.3);
    let environment = environment(Image::filled(1, 1, [1.5; 3]));
    for mode in MODES {
        let film = render(&world, &environment, view(camera.clone(), mode, 1), 256);
        expect(&format!("{mode:?}"), &film, 1.2, 0.02);
    }
}

#[test]
fn an_empty_scene_shows_the_map() {
    let world = WorldBuilder::default().build();
    let camera = Camera::look_at(Vec3::ZERO, Vec3::X, 1.0);
    for mode in MODES {
        let film = render(&world, &super::constant(0.5), view(camera.clone(), mode, 3), 4);
        assert!((mean(&film).luminance - 0.5).abs() < 1e-6, "{mode:?}");
    }
}
