//! What probes run on: scenes with one of everything, and maps of several sizes.

use std::f32::consts::PI;

use glam::{Affine2, DAffine3, DMat3, DQuat, DVec3, Quat, UVec2, Vec2, Vec3, Vec4};

use super::cases::Random;
use crate::bvh::Ray;
use crate::environment::{Environment, EnvironmentOptions};
use crate::image::{Image, Texels};
use crate::light_grid::LightGrid;
use crate::light_grid::cells::SphericalGrid;
use crate::path::camera::CameraRays;
use crate::path::{PathLimits, PathTracer, World};
use crate::render::filter::PixelFilter;
use crate::render::gpu::layout::{pack_radiance, unpack_radiance};
use crate::render::{Sampling, Sharing, View};
use crate::sampler::Sampler;
use crate::scene::{
    AlphaMode, Camera, Instance, Instances, Material, Medium, Placing, Projection, PunctualKind,
    PunctualLight, Scene, Texture, TextureImage, TextureRef, TextureSlot, Wrap,
};

/// A scene, a map, a view and distributions.
pub(in super::super) struct Fixture {
    pub(in super::super) world: World,
    pub(in super::super) environment: Environment,
    pub(in super::super) view: View,
    pub(super) rays: CameraRays,
    pub(super) grid: LightGrid,
}

/// The one with everything.
pub(in super::super) fn foggy_one() -> Fixture {
    let [fixture, ..] = all();
    fixture
}

/// The one with everything, most of it in instances.
pub(in super::super) fn instanced_one() -> Fixture {
    let [.., fixture] = all();
    fixture
}

/// First the one with everything; then three with other cameras, filters and cells; then the widest and the
/// tallest map; then the first one with instances.
pub(super) fn all() -> [Fixture; 7] {
    use PixelFilter::{BlackmanHarris, Box, Gauss};
    use Sampling::{Adaptive, Plain, Talk};
    let thin_lens = Camera { lens_radius: 0.1, focus_distance: 5.0, ..camera() };
    let parallel = Projection::Orthographic { half_height: 3.0 };
    let fixture = |scene: Scene, environment: Environment, camera, filter, sampling| {
        let world = World::new(scene);
        let view = view(camera, filter, sampling);
        let rays = CameraRays::new(&view.camera, view.width, view.height);
        let energies = environment.tile_energies();
        let faces = sampling == Adaptive;
        let cells = SphericalGrid {
            center: rays.position,
            columns: 64,
            rows: 32,
            faces,
            medium: world.scene.medium.is_some(),
        };
        let grid = if sampling == Plain {
            LightGrid::whole_map(energies)
        } else {
            LightGrid::with_garbage_distributions(cells, energies, 7)
        };
        let grid = grid.expect("the map is not black");
        Fixture { world, environment, view, rays, grid }
    };
    let map = || environment((61, 37));
    [
        fixture(foggy(scene(300)), map(), thin_lens, BlackmanHarris, Adaptive),
        fixture(scene(1), map(), camera(), Box, Talk),
        fixture(scene(1), map(), Camera { projection: parallel, ..camera() }, Gauss, Adaptive),
        fixture(scene(1), map(), camera(), Gauss, Plain),
        fixture(scene(1), environment((16384, 8)), camera(), Box, Plain),
        fixture(scene(1), environment((8, 8192)), camera(), Box, Plain),
        fixture(foggy(instanced(scene(300))), map(), camera(), BlackmanHarris, Adaptive),
    ]
}

/// Two thirds of the triangles as two meshes, placed by maps that turn, mirror and shear.
pub(in super::super) fn instanced(scene: Scene) -> Scene {
    let mut random = Random::default();
    let all = scene.triangles.len() as u32;
    let meshes = vec![all / 3..all / 2, all / 2..all];
    let instances = (0..9).map(|number| {
        let turn = DQuat::from_rotation_y(f64::from(random.between(0.0, 6.0)));
        let side = if number % 2 == 0 { 0.4 } else { -0.6 };
        let size = DMat3::from_diagonal(DVec3::new(side, 0.5, 0.3));
        let shear = DMat3::from_cols(DVec3::X, DVec3::new(0.3, 1.0, 0.0), DVec3::Z);
        let place = (2.5 * random.in_cube()).as_dvec3();
        let map = DMat3::from_quat(turn) * size * shear;
        let placing = Placing::new(DAffine3::from_mat3_translation(map, place));
        Instance { mesh: number % 2, placing }
    });
    Scene { instances: Instances::new(meshes, instances.collect()), ..scene }
}

impl Fixture {
    /// A sample's camera ray and random numbers, as `render::cpu` starts it.
    pub(super) fn start_sample(&self, pixel: UVec2, index: u32) -> (Ray, Sampler) {
        let mut sampler = Sampler::of_pixel(self.view.seed, pixel.to_array(), index);
        let offset = self.view.filter.sample(Vec2::from(sampler.next_pair()));
        let lens = if self.rays.has_lens() { Vec2::from(sampler.next_pair()) } else { Vec2::ZERO };
        (self.rays.ray(pixel.as_vec2() + 0.5 + offset, lens), sampler)
    }

    pub(super) fn tracer(&self) -> PathTracer<'_> {
        self.view.tracer((&self.world, &self.environment), Some(&self.grid))
    }
}

/// The scene in a box of coloured fog.
fn foggy(scene: Scene) -> Scene {
    let medium = Medium {
        scattering: Vec3::new(0.05, 0.08, 0.1),
        absorption: Vec3::new(0.02, 0.0, 0.01),
        anisotropy: 0.4,
        bounds: Some([Vec3::new(-3.0, -2.0, -4.0), Vec3::new(4.0, 3.0, 5.0)]),
    };
    Scene { medium: Some(medium), ..scene }
}

fn camera() -> Camera {
    Camera::look_at(Vec3::new(1.0, 2.0, 7.0), Vec3::new(0.3, 0.1, 0.0), 0.9)
}

fn view(camera: Camera, filter: PixelFilter, sampling: Sampling) -> View {
    View {
        filter,
        sampling,
        limits: PathLimits { bounces: 6, russian_roulette: true },
        seed: 11,
        sharing: Sharing::Off,
        learning_paths: 0,
        layers: true,
        ..View::new(camera, [50, 40])
    }
}

/// A view of a scene, of which only what it asks of the kernels matters.
pub(in super::super) fn view_of(world: &World, sampling: Sampling) -> View {
    let camera = world.scene.cameras.first().cloned().unwrap_or_else(camera);
    view(camera, PixelFilter::Box, sampling)
}

/// Tiles of unequal size, one of them black, dim ones beside a sun. Radiance is what the device can
/// hold, so that packing (which has a test of its own) is no part of what is compared.
fn environment((width, height): (u32, u32)) -> Environment {
    let mut random = Random::default();
    let map = Image::from_fn(width, height, |x, y| {
        let radiance = match (x, y) {
            (40, 12) => Vec3::new(9e3, 8e3, 6e3),
            (17..=27, 7..=16) => Vec3::ZERO,
            _ => random.unit3() * random.magnitude(1e-2, 4.0),
        };
        unpack_radiance(pack_radiance(radiance.to_array()))
    });
    let options = EnvironmentOptions {
        tile_columns: 7,
        tile_rows: 5,
        rotation_radians: 2.0,
        intensity: 1.7,
        ..EnvironmentOptions::default()
    };
    Environment::new(map, &options).expect("a sound map")
}

/// A soup of triangles, a third of them flat, with all materials in turn; the last triangle has no
/// area.
fn scene(triangles: u32) -> Scene {
    let mut random = Random::default();
    let mut scene = Scene { materials: materials(), ..Scene::default() };
    add_textures(&mut scene, &mut random);
    for index in 0..triangles {
        let middle = 3.5 * random.in_cube();
        let corners = [(); 3].map(|()| middle + random.in_cube());
        let normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]).normalize();
        let is_flat = random.below(3) == 0;
        let handedness = if random.below(2) == 0 { 1.0 } else { -1.0 };
        let first = scene.positions.len() as u32;
        for corner in corners {
            let bent = (normal + 0.4 * random.in_cube()).normalize();
            let tangent = bent.any_orthonormal_vector() + 0.1 * random.in_cube();
            scene.positions.push(corner);
            scene.normals.push(if is_flat { Vec3::ZERO } else { bent });
            scene.tangents.push(tangent.normalize().extend(handedness));
            scene.uvs.iter_mut().for_each(|uvs| uvs.push(random.unit2() * 4.0 - 1.5));
            scene.colors.push((random.unit3() * 0.5 + 0.6).extend(random.between(0.4, 1.1)));
        }
        scene.triangles.push([first, first + 1, first + 2]);
        scene.triangle_materials.push(index % scene.materials.len() as u32);
    }
    scene.triangles.push([0, 1, 1]);
    scene.triangle_materials.push(0);
    scene.lights = lights();
    scene
}

fn materials() -> Vec<Material> {
    let plain = Material { metallic: 0.0, double_sided: true, ..Material::default() };
    let color = Vec4::new(0.7, 0.5, 0.3, 1.0);
    let glass = Material { transmission: 1.0, roughness: 0.0, ..plain.clone() };
    let solid = Material {
        thickness: 1.0,
        attenuation_color: Vec3::new(0.3, 0.6, 0.9),
        attenuation_distance: 0.7,
        ..glass.clone()
    };
    let coated = Material { clearcoat: 0.8, clearcoat_roughness: 0.1, ..plain.clone() };
    vec![
        Material { base_color: color, double_sided: false, ..plain.clone() },
        Material { base_color: color, roughness: 0.3, ..plain.clone() },
        Material { base_color: color, specular: 0.0, ..plain.clone() },
        Material { base_color: color, metallic: 1.0, roughness: 0.2, ..plain.clone() },
        Material { metallic: 0.4, roughness: 0.5, ior: 2.4, ..plain.clone() },
        Material { metallic: 1.0, roughness: 0.0, ..plain.clone() },
        Material {
            sheen_color: Vec3::new(0.3, 0.9, 0.5),
            sheen_roughness: 0.6,
            base_color: color,
            ..plain.clone()
        },
        Material {
            diffuse_transmission: 0.6,
            diffuse_transmission_color: Vec3::new(0.9, 0.4, 0.6),
            sheen_color: Vec3::splat(0.2),
            ..plain.clone()
        },
        Material { iridescence: 1.0, ..glass.clone() },
        Material { iridescence: 0.8, iridescence_ior: 1.8, base_color: color, ..plain.clone() },
        Material { dispersion: 5.0, ..solid.clone() },
        Material { dispersion: 2.0, roughness: 0.4, iridescence: 0.5, ..solid.clone() },
        Material { diffuse_transmission: 0.7, transmission: 0.2, ..solid.clone() },
        Material { metallic: 1.0, roughness: 0.3, anisotropy: 0.8, ..plain.clone() },
        Material {
            roughness: 0.4,
            anisotropy: 1.0,
            anisotropy_rotation: 1.0,
            base_color: color,
            ..plain.clone()
        },
        Material { clearcoat_normal_scale: 0.5, ..coated.clone() },
        Material { base_color: color, clearcoat_roughness: 0.0, ..coated },
        Material { roughness: 0.3, ..solid.clone() },
        Material { ior: 1.0, ..solid.clone() },
        solid,
        Material { roughness: 0.4, base_color: color, ..glass.clone() },
        Material { base_color: color, ..glass },
        Material { alpha_mode: AlphaMode::Mask { cutoff: 0.5 }, ..plain.clone() },
        Material { alpha_mode: AlphaMode::Blend, roughness: 0.6, ..plain.clone() },
        Material { emissive: Vec3::new(3.0, 2.0, 1.0), ..plain.clone() },
        Material { emissive: Vec3::splat(5.0), double_sided: false, ..plain.clone() },
        Material { unlit: true, base_color: color, ..plain.clone() },
        Material { specular_color: Vec3::new(1.0, 0.4, 0.2), ior: 0.0, ..plain },
    ]
}

/// Images down to none and of both depths, every wrap mode, and a texture in every other place of every material.
fn add_textures(scene: &mut Scene, random: &mut Random) {
    for (width, height, channels) in [(8, 5, 4), (1, 1, 1), (0, 0, 4), (3, 7, 3)] {
        let bytes = (0..width * height * channels).map(|_| random.word() as u8).collect();
        let texels = Texels::new(channels as usize, bytes);
        scene.images.push(TextureImage { width, height, texels });
    }
    let values: Vec<u16> = (0..5 * 4 * 4).map(|_| random.word() as u16).collect();
    scene.images.push(TextureImage { width: 5, height: 4, texels: Texels::deep(4, &values) });
    let wraps = [Wrap::Repeat, Wrap::MirroredRepeat, Wrap::ClampToEdge];
    for index in 0..18_u32 {
        let wrap = |i: u32| wraps[i as usize % 3];
        scene.textures.push(Texture {
            image: if index % 6 == 5 {
                index / 6
            } else {
                [0, 3, 4][(index + index / 3) as usize % 3]
            },
            wrap_u: wrap(index),
            wrap_v: wrap(index / 3),
            nearest: index % 5 == 0,
            srgb: index % 4 < 2,
        });
    }
    let mut reference = || {
        let (texture, uv_set) = (random.below(18), random.below(2) as u8);
        let (scale, angle) = (random.unit2() + 0.5, random.between(-PI, PI));
        let transform = Affine2::from_scale_angle_translation(scale, angle, random.unit2());
        random.below(2).eq(&0).then_some(TextureRef { texture, uv_set, transform }.into())
    };
    for material in &mut scene.materials {
        let was_clear = material.is_clear_solid();
        material.textures.iter_mut().for_each(|texture| *texture = reference());
        if was_clear {
            material.textures[TextureSlot::Transmission as usize] = None;
        }
    }
}

fn lights() -> Vec<PunctualLight> {
    let spot = PunctualKind::Spot { inner_radians: 0.3, outer_radians: 0.7 };
    let light = |kind, place: Vec3, range| PunctualLight {
        name: String::new(),
        kind,
        position: place,
        direction: Quat::from_rotation_z(0.3) * -place.normalize(),
        intensity: Vec3::new(30.0, 20.0, 10.0),
        range,
    };
    vec![
        light(PunctualKind::Point, Vec3::new(2.0, 3.0, 1.0), 6.0),
        light(PunctualKind::Point, Vec3::new(-4.0, 1.0, 2.0), f32::INFINITY),
        light(spot, Vec3::new(0.5, 4.0, -3.0), f32::INFINITY),
        light(PunctualKind::Directional, Vec3::new(1.0, 2.0, 0.5), f32::INFINITY),
    ]
}
