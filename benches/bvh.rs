//! Benches of bvh: rays per second beside the CWBVH of obvhs, on one thread.
//!
//! A table of ratios comes first, measured in turns so that other load on the machine cancels out.

use std::cell::OnceCell;
use std::f32::consts::{PI, TAU};
use std::hint::black_box;
use std::time::{Duration, Instant};

use criterion::{BenchmarkId, Criterion, Throughput};
use glam::{Vec3, Vec3A};
use lightgrid::bvh::{Bvh, Hit, Ray, offset_origin};
use lightgrid::math::Frame;
use lightgrid::sampler::SplitMix;
use obvhs::BvhBuildParams;
use obvhs::cwbvh::{CwBvh, builder::build_cwbvh_from_tris};
use obvhs::ray::RayHit;
use obvhs::rt_triangle::RtTriangle;
use obvhs::triangle::Triangle;

const WIDTH: usize = 512;
const HEIGHT: usize = 256;
const KINDS: [&str; 3] = ["primary", "diffuse", "occlusion"];
const ROUNDS: usize = 9;

type Mesh = (Vec<Vec3>, Vec<[u32; 3]>);

pub(crate) fn bench(criterion: &mut Criterion) {
    let scene = OnceCell::new();
    let mut group = criterion.benchmark_group("bvh");
    group.sample_size(10).throughput(Throughput::Elements((WIDTH * HEIGHT) as u64));
    for (kind, name) in KINDS.into_iter().enumerate() {
        group.bench_function(BenchmarkId::new("lightgrid", name), |bencher| {
            let scene = scene.get_or_init(Scene::with_table);
            bencher.iter(|| scene.ours(kind, &scene.rays[kind]));
        });
        group.bench_function(BenchmarkId::new("obvhs", name), |bencher| {
            let scene = scene.get_or_init(Scene::with_table);
            bencher.iter(|| scene.theirs(kind, &scene.rays[kind]));
        });
    }
    group.finish();
    let mut group = criterion.benchmark_group("bvh/build");
    let (positions, triangles) = displaced_room(289);
    group.sample_size(10).throughput(Throughput::Elements(triangles.len() as u64));
    group.bench_function("1M triangles", |bencher| {
        bencher.iter(|| Bvh::build(&positions, &triangles));
    });
    group.finish();
}

/// The same triangles in both trees and the rays of each kind.
struct Scene {
    ours: Bvh,
    theirs: CwBvh,
    /// In the order of `theirs.primitive_indices`, as obvhs advises for speed.
    their_triangles: Vec<RtTriangle>,
    rays: [Vec<Ray>; 3],
}

impl Scene {
    fn with_table() -> Self {
        let scene = Self::new(displaced_room(140));
        println!("\n{}", scene.ours.simd_name());
        println!(
            "{:>10} {:>12} {:>12} {:>12}",
            "rays", "ours Mray/s", "obvhs Mray/s", "ours/obvhs"
        );
        for (kind, name) in KINDS.into_iter().enumerate() {
            let mut rounds: Vec<_> = (0..ROUNDS).map(|_| scene.round(kind)).collect();
            rounds.sort_by(|a, b| (a[1] / a[0]).total_cmp(&(b[1] / b[0])));
            let rate = |seconds: f64| scene.rays[kind].len() as f64 / seconds * 1e-6;
            let [ours, theirs] = rounds[ROUNDS / 2].map(rate);
            println!("{name:>10} {ours:>12.2} {theirs:>12.2} {:>12.2}", ours / theirs);
        }
        scene
    }

    fn new((positions, triangles): Mesh) -> Self {
        let start = Instant::now();
        let ours = Bvh::build(&positions, &triangles);
        println!(
            "\n{} triangles: {:.0} MB, built in {:.2} s",
            triangles.len(),
            ours.memory_bytes() as f64 * 1e-6,
            start.elapsed().as_secs_f64(),
        );
        let corners = |t: &[u32; 3]| t.map(|i| Vec3A::from(positions[i as usize]));
        let list: Vec<_> = triangles
            .iter()
            .map(|t| {
                let [v0, v1, v2] = corners(t);
                Triangle { v0, v1, v2 }
            })
            .collect();
        let medium = BvhBuildParams::medium_build();
        let theirs = build_cwbvh_from_tris(&list, medium, &mut Duration::default());
        let their_triangles =
            theirs.primitive_indices.iter().map(|&i| RtTriangle::from(&list[i as usize])).collect();
        let rays = rays(&ours, &positions, &triangles);
        Self { ours, theirs, their_triangles, rays }
    }

    /// Seconds of ours and theirs for all rays of a kind, in turns of a few thousand.
    fn round(&self, kind: usize) -> [f64; 2] {
        let mut seconds = [0.0; 2];
        for part in self.rays[kind].chunks(4096) {
            let start = Instant::now();
            let ours = black_box(self.ours(kind, part));
            let middle = Instant::now();
            let theirs = black_box(self.theirs(kind, part));
            seconds[0] += (middle - start).as_secs_f64();
            seconds[1] += middle.elapsed().as_secs_f64();
            assert!(ours.abs_diff(theirs) <= 16, "{ours} and {theirs} hits of {}", part.len());
        }
        seconds
    }

    /// Counts hits.
    fn ours(&self, kind: usize, rays: &[Ray]) -> usize {
        let everything = |_: &Hit| true;
        if KINDS[kind] == "occlusion" {
            rays.iter().filter(|ray| self.ours.any_hit(ray, everything)).count()
        } else {
            rays.iter().filter(|ray| self.ours.closest_hit(ray, everything).is_some()).count()
        }
    }

    /// Counts hits.
    fn theirs(&self, kind: usize, rays: &[Ray]) -> usize {
        let intersect = |ray: &obvhs::ray::Ray, i: usize| self.their_triangles[i].intersect(ray);
        let hits = |ray: &&Ray| {
            let (o, d) = (ray.origin.into(), ray.direction.into());
            let ray = obvhs::ray::Ray::new(o, d, ray.t_min, ray.t_max);
            if KINDS[kind] == "occlusion" {
                !self.theirs.ray_traverse_miss(ray, intersect)
            } else {
                self.theirs.ray_traverse(ray, &mut RayHit::none(), intersect)
            }
        };
        rays.iter().filter(hits).count()
    }
}

/// Rays of a camera in the room, one cosine-distributed bounce each, and rays from the same points
/// to points in an area light under the ceiling.
fn rays(bvh: &Bvh, positions: &[Vec3], triangles: &[[u32; 3]]) -> [Vec<Ray>; 3] {
    let mut random = SplitMix(1);
    let mut rays = [const { Vec::new() }; 3];
    for pixel in 0..WIDTH * HEIGHT {
        let x = ((pixel % WIDTH) as f32 + 0.5) / WIDTH as f32 * 2.0 - 1.0;
        let y = 1.0 - ((pixel / WIDTH) as f32 + 0.5) / HEIGHT as f32 * 2.0;
        let primary = Ray {
            origin: Vec3::new(-0.8, 0.1, -0.7),
            direction: Vec3::new(1.0 - 0.9 * x, 0.6 * y, 0.8 + 0.9 * x).normalize(),
            t_min: 0.0,
            t_max: f32::INFINITY,
        };
        let hit = bvh.closest_hit(&primary, |_| true).expect("the room is closed");
        let [a, b, c] = triangles[hit.triangle as usize].map(|i| positions[i as usize]);
        let normal = (b - a).cross(c - a).normalize();
        let normal = if normal.dot(primary.direction) > 0.0 { -normal } else { normal };
        let point = primary.origin + primary.direction * hit.t;
        let origin = offset_origin(point, normal);
        let direction = Frame::from_z(normal).world_from_local(cosine_direction(&mut random));
        rays[0].push(primary);
        rays[1].push(Ray { origin, direction, ..primary });
        let light = Vec3::new(random.next_f32() - 0.5, 0.7, random.next_f32() - 0.5);
        rays[2].push(Ray { origin, direction: light - origin, t_max: 1.0, ..primary });
    }
    rays
}

/// A closed bumpy room of `12 n^2` triangles, with 24 spheres inside that have a few percent more.
fn displaced_room(n: usize) -> Mesh {
    let mut mesh: Mesh = Default::default();
    for axis in 0..3 {
        for side in [-1.0, 1.0] {
            grid(&mut mesh, n, n, |u, v| {
                let mut p = Vec3::ZERO;
                p[axis] = side;
                p[(axis + 1) % 3] = 2.0 * u - 1.0;
                p[(axis + 2) % 3] = 2.0 * v - 1.0;
                let wave = (p.x * 23.0).sin() * (p.y * 29.0).sin() * (p.z * 31.0).sin();
                p * (1.0 - 0.04 * wave)
            });
        }
    }
    let mut random = SplitMix(2);
    for _ in 0..24 {
        let centre = Vec3::new(
            random.next_f32() - 0.5,
            random.next_f32() * 0.6 - 0.7,
            random.next_f32() - 0.5,
        );
        let radius = 0.05 + 0.08 * random.next_f32();
        grid(&mut mesh, n / 5, n / 7, |u, v| {
            let ((sin_phi, cos_phi), (sin, cos)) = ((u * TAU).sin_cos(), (v * PI).sin_cos());
            centre + radius * Vec3::new(sin * cos_phi, cos, sin * sin_phi)
        });
    }
    mesh
}

/// Adds `2 width height` triangles over the unit square.
fn grid(mesh: &mut Mesh, width: usize, height: usize, surface: impl Fn(f32, f32) -> Vec3) {
    let first = mesh.0.len();
    for j in 0..=height {
        for i in 0..=width {
            mesh.0.push(surface(i as f32 / width as f32, j as f32 / height as f32));
        }
    }
    for j in 0..height {
        for i in 0..width {
            let corner = |di, dj| (first + (j + dj) * (width + 1) + i + di) as u32;
            let [a, b, c, d] = [corner(0, 0), corner(1, 0), corner(1, 1), corner(0, 1)];
            mesh.1.extend([[a, b, c], [a, c, d]]);
        }
    }
}

/// A direction, cosine-distributed about +Z.
fn cosine_direction(random: &mut SplitMix) -> Vec3 {
    let (r2, phi) = (random.next_f32(), TAU * random.next_f32());
    Vec3::new(r2.sqrt() * phi.cos(), r2.sqrt() * phi.sin(), (1.0 - r2).sqrt())
}
