//! The quick half of the stability suite, a test for each case, so that a failure names it.

use lightgrid::render::gpu::Gpu;
use lightgrid::stability::{On, Setting, Verdict, cases, run};

fn setting(gpu: Option<Gpu>) -> Setting {
    Setting { gpu, nightly: false }
}

fn expect(title: &str, setting: &Setting) {
    let case = cases().find(|case| case.title() == title).expect("a case of this name");
    let report = run(case, setting);
    eprintln!("{}", report.line());
    if report.outcome.verdict() == Verdict::Skipped {
        eprintln!("SKIPPED: {title}: {}", report.outcome.remarks.join("; "));
    }
    assert_ne!(report.outcome.verdict(), Verdict::Failed, "{}", report.to_json());
}

macro_rules! on_the_cpu {
    ($($test:ident: $title:literal),+ $(,)?) => {
        $(#[test]
        fn $test() {
            expect($title, &setting(None));
        })+

        #[test]
        fn every_case_is_a_test() {
            let tests = [$($title),+];
            let cases: Vec<String> =
                cases().filter(|case| case.on != On::Gpu).map(|case| case.title()).collect();
            assert_eq!(cases, tests);
        }
    };
}

on_the_cpu! {
    maps_constant: "maps/constant",
    maps_black: "maps/black",
    maps_1x1: "maps/1x1",
    maps_2x1: "maps/2x1",
    maps_1xn: "maps/1xN",
    maps_lit_at_the_seam: "maps/lit-at-the-seam",
    maps_lit_at_the_poles: "maps/lit-at-the-poles",
    maps_lit_at_the_corners: "maps/lit-at-the-corners",
    maps_sun_of_1e9: "maps/sun-of-1e9",
    maps_sun_of_1e_30: "maps/sun-of-1e-30",
    maps_subnormal: "maps/subnormal",
    maps_half_overflow: "maps/half-overflow",
    maps_nan_inf_negative: "maps/nan-inf-negative",
    maps_extreme_contrast: "maps/extreme-contrast",
    maps_16384_wide: "maps/16384-wide",
    maps_8192_high: "maps/8192-high",
    maps_16384x8192: "maps/16384x8192",
    maps_15000x7500: "maps/15000x7500",
    tables_tile_local: "tables/tile-local",
    tables_u32: "tables/u32",
    tables_f32: "tables/f32",
    tables_f64: "tables/f64",
    grid_cells: "grid/cells",
    grid_camera_on_a_wall: "grid/camera-on-a-wall",
    grid_camera_inside_a_mesh: "grid/camera-inside-a-mesh",
    grid_camera_at_1e6_m: "grid/camera-at-1e6-m",
    grid_sealed_room: "grid/sealed-room",
    grid_crack_of_2_cm: "grid/crack-of-2-cm",
    grid_crack_of_0_2_mm: "grid/crack-of-0.2-mm",
    grid_empty_cells: "grid/empty-cells",
    grid_counters_after_2_32_hits: "grid/counters-after-2^32-hits",
    grid_moving_camera: "grid/moving-camera",
    grid_1_learning_path: "grid/1-learning-path",
    grid_1e8_learning_paths: "grid/1e8-learning-paths",
    geometry_degenerate_and_duplicate: "geometry/degenerate-and-duplicate",
    geometry_slivers_1e6_to_1: "geometry/slivers-1e6-to-1",
    geometry_coplanar_overlaps: "geometry/coplanar-overlaps",
    geometry_room_of_1e_4_m: "geometry/room-of-1e-4-m",
    geometry_room_of_1e6_m: "geometry/room-of-1e6-m",
    geometry_rays_along_shared_edges: "geometry/rays-along-shared-edges",
    geometry_rays_anywhere: "geometry/rays-anywhere",
    geometry_paths_in_a_closed_room: "geometry/paths-in-a-closed-room",
    geometry_1e_3_m_room_on_1e4_m_ground: "geometry/1e-3-m-room-on-1e4-m-ground",
    materials_roughness_0_to_1e_4: "materials/roughness-0-to-1e-4",
    materials_ior_1_and_3: "materials/ior-1-and-3",
    materials_white_room_1000_bounces: "materials/white-room-1000-bounces",
    materials_normals_under_the_surface: "materials/normals-under-the-surface",
    materials_near_grazing: "materials/near-grazing",
    materials_nested_glass: "materials/nested-glass",
    materials_optical_depths: "materials/optical-depths",
    materials_media_of_all_depths: "materials/media-of-all-depths",
    materials_random_materials: "materials/random-materials",
    materials_overflow_is_counted: "materials/overflow-is-counted",
    film_1e7_samples_in_a_pixel: "film/1e7-samples-in-a-pixel",
    film_1e_8_beside_1e8: "film/1e-8-beside-1e8",
    film_1e7_samples_rendered: "film/1e7-samples-rendered",
    film_1e_8_rendered: "film/1e-8-rendered",
    film_1e8_rendered: "film/1e8-rendered",
    devices_f32_against_f64: "devices/f32-against-f64",
}

/// The cases about the GPU and one of each other group: software Vulkan takes seconds to compile a
/// kernel, and all of them are a command away.
#[test]
fn a_few_cases_on_the_gpu() {
    let gpu = match Gpu::open(None) {
        Ok(gpu) => gpu,
        Err(reason) => {
            eprintln!("SKIPPED: {reason}");
            return;
        }
    };
    let setting = setting(Some(gpu));
    for title in [
        "maps/black",
        "geometry/coplanar-overlaps",
        "materials/overflow-is-counted",
        "film/1e8-rendered",
        "devices/f32-against-f64",
        "devices/gpu-against-cpu",
        "devices/device-lost",
        "devices/out-of-gpu-memory",
    ] {
        expect(title, &setting);
    }
}
