//! Second vertices shared between the pixels of a tile.
//!
//! Most of the noise of a path is that of the one radiance estimate behind its second vertex. So some
//! pixels' second vertices get good estimates, and every pixel of the tile is connected with all of
//! them: a shadow ray between neighbours costs a fraction of a path (Bekaert, Sbert, Halton,
//! *Accelerating Path Tracing by Re-Using Paths*, EGRW 2002).
//!
//! A second vertex y is drawn by pixel k with the density `q_k p_k(y) V_k(y)`: the probability that the
//! pixel keeps its own, the density per area of its BSDF (and of aiming), and whether nothing is in the way; in fog, with
//! the density of flying so far, per volume if y lies in the fog ([`Crossing`]). All pixels
//! are weighted by the sum of that over the tile, so each gets the integral it would get alone. That
//! holds if it depends on x_k, the lobe, the segment and y alone whether a pair takes part, the same for
//! all pixels; whatever does not goes on as a path of its own.
//!
//! Of a varnished surface only the broad lobes are shared. Their probability at y is the same for all pixels: the
//! weight of the part cancels it, so it is not in the density.

use std::ops::Range;

use glam::Vec3;

use super::aim_targets::Aiming;
use super::shadows::SHADOW_RAY_SHARE;
use super::splitting::{MIN_SHARED_ALPHA, MIN_WHOLE_ALPHA, UseOfVertices};
use super::tracer::{Path, PathResult, PathTracer};
use super::vertex::{Arriving, Scatterer, SurfaceScatterer, Vertex};
use crate::bsdf::Bsdf;
use crate::bvh::{Ray, offset_origin};
use crate::medium::{Crossing, Phase};
use crate::sampler::{Sampler, hash};

/// How the pixels of a tile share.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SharedTile {
    /// Pixels along an edge; even.
    pub side: u32,
    /// Of each square of so many pixels along an edge one keeps its second vertex.
    pub owner_side: u32,
    /// Radiance estimates behind a second vertex.
    pub continuations: u32,
}

impl SharedTile {
    /// One pixel in four keeps its own, which gets four estimates: most for the time.
    pub const LARGE: Self = Self { side: 8, owner_side: 2, continuations: 4 };
    /// All keep their own: less noise is shared.
    pub const SMALL: Self = Self { side: 4, owner_side: 1, continuations: 1 };

    /// Samples of the map at the first vertex.
    pub(crate) const MAP_SAMPLES: u32 = 3;

    /// Most samples of the map that one path takes, with `bounces` vertices.
    pub fn most_map_samples(&self, bounces: u32) -> u32 {
        Self::MAP_SAMPLES + self.continuations * bounces.saturating_sub(1)
    }

    /// The tiles of sample `sample` of each pixel: elsewhere for each, so that no edge of a tile shows.
    pub(crate) fn tiling(&self, size: [u32; 2], seed: u32, sample: u32) -> Tiling {
        let seed = hash(seed ^ hash(sample ^ TILE_SEED));
        let before = [seed, seed >> 16].map(|bits| bits % self.side);
        Tiling { side: self.side, size, before, seed }
    }

    /// Whether a pixel keeps its second vertex.
    fn is_owner(&self, [x, y]: [u32; 2], seed: u32) -> bool {
        let side = self.owner_side;
        let square = (y / side) * self.side.div_ceil(side) + x / side;
        let chosen = hash(seed.wrapping_add(square)) % (side * side);
        (y % side) * side + x % side == chosen
    }
}

/// Where the path of a pixel begins.
pub struct Start<'a> {
    /// The pixel's place in the tile.
    pub place: [u32; 2],
    /// Through the pixel.
    pub ray: Ray,
    /// Its random numbers.
    pub sampler: Sampler,
    /// What it reads, and where it counts.
    pub tracer: &'a PathTracer<'a>,
}

/// A normal is seen as it is where the viewer's cosine with it is at least this share of that with the geometric
/// normal: beyond where bending begins, so that what is bent is not taken for true.
pub(crate) const TRUE_COSINE_SHARE: f32 = 0.1;
/// And where the mirrored viewer's cosine with the geometric normal is at least this share of the viewer's...
pub(crate) const TRUE_MIRROR_SHARE: f32 = 0.95;
/// ...or as large as this.
pub(crate) const TRUE_MIRROR_COSINE: f32 = 0.02;

/// Keeps the places of tiles apart from other random numbers.
pub(crate) const TILE_SEED: u32 = 0x7469_6c65;

/// A first vertex that other pixels' second vertices are connected with.
struct First<'v> {
    vertex: Vertex<'v>,
    throughput: Vec3,
    /// How its pixel may have aimed.
    aiming: Option<&'v Aiming>,
}

/// A second vertex that is shared.
struct Second<'a, 'v> {
    owner: usize,
    vertex: Vertex<'v>,
    /// The path that has arrived there.
    path: Path<'a>,
}

/// Radiance that arrives at a second vertex, divided by its density.
struct Incident {
    /// Unit, in the shading frame of a surface, else in the world.
    wi: Vec3,
    light: Vec3,
}

/// What a second vertex sends back.
enum Outgoing<'v> {
    /// The same everywhere.
    Lambert(Vec3),
    /// Of a body, before layers take a part of it by direction.
    Body(&'v SurfaceScatterer<'v>, Vec3),
    Directed(&'v SurfaceScatterer<'v>, Vec<Incident>),
    InMedium(Phase, Vec<Incident>),
}

/// One sample of each pixel of a tile, in the order of `starts`. `seed` chooses whose second vertices
/// are kept.
pub fn radiance_of_tile(tile: SharedTile, seed: u32, starts: &[Start<'_>]) -> Vec<PathResult> {
    let mut bsdfs: Vec<[Option<Bsdf>; 2]> = Vec::new();
    bsdfs.resize_with(starts.len(), Default::default);
    let mut firsts = Vec::with_capacity(starts.len());
    let mut seconds = Vec::new();
    let mut results = Vec::with_capacity(starts.len());
    for (owner, (start, [first_bsdf, second_bsdf])) in starts.iter().zip(&mut bsdfs).enumerate() {
        let mut path = Path::new(start.tracer, start.ray, start.sampler.clone());
        path.use_of_vertices = UseOfVertices::Shared;
        let mut first = None;
        if let Some(vertex) = path.next_vertex(first_bsdf) {
            let shares = path.is_in_air() && vertex.scatterer.is_alike_nearby();
            if shares {
                path.map_samples = SharedTile::MAP_SAMPLES;
            } else {
                path.use_of_vertices = UseOfVertices::alone(start.tracer.cache.is_some());
            }
            let (throughput, aiming) = (path.throughput, path.tracer.aiming_from(&vertex));
            if path.visit(&vertex)
                && let is_lifted = vertex.scatterer.lifts(path.ray.direction)
                && let Some(second) = path.next_vertex(second_bsdf)
            {
                if !(shares && !is_lifted && path.is_found_alike(&second)) {
                    if path.visit(&second) {
                        path.run();
                    }
                } else if tile.is_owner(start.place, seed) {
                    seconds.push(Second { owner, vertex: second, path: path.clone() });
                }
            }
            first = shares.then_some(First { vertex, throughput, aiming });
        }
        results.push(path.result());
        firsts.push(first);
    }
    let mut connections = Vec::with_capacity(starts.len());
    for second in seconds {
        second.connect(&tile, &firsts, &mut connections, &mut results);
    }
    results
}

/// How a picture is cut into tiles for one sample of its pixels.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Tiling {
    /// Pixels along an edge of a tile.
    pub side: u32,
    /// Size of the picture.
    pub size: [u32; 2],
    /// Columns and rows of the first tile that are left of and above the picture.
    pub before: [u32; 2],
    seed: u32,
}

impl Tiling {
    /// Number of tiles.
    pub(crate) fn count(&self) -> u64 {
        let [columns, rows] = self.tiles();
        u64::from(columns) * u64::from(rows)
    }

    /// Seed of the choices in a tile; they are numbered row after row.
    pub(crate) fn seed_of(&self, tile: u32) -> u32 {
        hash(self.seed.wrapping_add(tile))
    }

    /// Pixels of the picture in these tiles.
    pub(crate) fn pixels(&self, tiles: Range<u64>) -> u64 {
        let [columns, rows] = self.tiles().map(u64::from);
        let length = |axis: usize, index: u64| {
            let (side, before) = (u64::from(self.side), u64::from(self.before[axis]));
            let end = ((index + 1) * side - before).min(u64::from(self.size[axis]));
            end - (index * side).saturating_sub(before)
        };
        let tiles = tiles.start..tiles.end.min(columns * rows);
        tiles.map(|tile| length(0, tile % columns) * length(1, tile / columns)).sum()
    }

    fn tiles(&self) -> [u32; 2] {
        [0, 1].map(|axis| (self.size[axis] + self.before[axis]).div_ceil(self.side))
    }
}

impl Scatterer<'_> {
    /// Whether it scatters much the same to and from places side by side.
    fn is_alike_nearby(&self) -> bool {
        self.surface().is_none_or(|surface| {
            let bsdf = surface.bsdf();
            let min_alpha = if bsdf.is_whole() { MIN_WHOLE_ALPHA } else { MIN_SHARED_ALPHA };
            !surface.refracts && bsdf.is_broad(min_alpha)
        })
    }

    /// Whether a viewer in this direction sees it as all do.
    fn is_true_from(&self, to_viewer: Vec3) -> bool {
        self.surface().is_none_or(|surface| surface.is_true_from(to_viewer))
    }
}

impl Path<'_> {
    /// Whether the vertex that the path has arrived at is found by other pixels in the same way.
    fn is_found_alike(&self, vertex: &Vertex<'_>) -> bool {
        self.is_clear
            && self.interfaces == 0
            && self.departure.pdf_solid_angle.is_finite()
            && self.bounces < self.tracer.limits.bounces
            && vertex.scatterer.is_alike_nearby()
            && vertex.scatterer.is_true_from(-self.ray.direction)
    }

    /// Estimates what arrives at the vertex, `times` times over. Its perfect reflections, which no other
    /// pixel sees, are none.
    fn incident(&mut self, vertex: &Vertex<'_>, times: u32) -> Vec<Incident> {
        let share = 1.0 / times as f32;
        let mut incident = Vec::with_capacity(3 * times as usize);
        let mut add = |direction: Vec3, light: Vec3| {
            let (wi, agrees) = vertex.scatterer.surface().map_or((direction, true), |surface| {
                let wi = surface.shading_frame.local_from_world(direction);
                (wi, (wi.z > 0.0) == surface.sides.is_above(direction))
            });
            if agrees && light != Vec3::ZERO {
                incident.push(Incident { wi, light });
            }
        };
        self.bounces += 1;
        self.interfaces = 0;
        self.rays = 0;
        self.throughput_before *= self.throughput.max_element();
        self.throughput = Vec3::ONE;
        let arrived = self.clone();
        for time in 0..times {
            *self = Self { rays: self.rays, ..arrived.clone() };
            self.sampler = arrived.sampler.of_estimate(times, time);
            let lights = self.choose_lights(vertex);
            let onward = self.choose_onward(vertex);
            let mut take = |arriving: Arriving| add(arriving.direction, arriving.light * share);
            self.for_arriving(vertex, &lights, &mut take);
            if !onward.is_some_and(|onward| self.go_on(vertex, &onward)) {
                continue;
            }
            let density =
                self.departure.pdf_solid_angle * self.departure.probability_of_bsdf(self.tracer);
            let direction = self.ray.direction;
            let weight = self.throughput;
            let Some(survival) = self.survival() else { continue };
            self.throughput = Vec3::ONE;
            self.throughput_before *= weight.max_element() / survival;
            self.radiance = Vec3::ZERO;
            self.run();
            add(direction, self.radiance * (share / (survival * density)));
        }
        incident
    }
}

impl SurfaceScatterer<'_> {
    /// Whether a viewer in this direction sees its normals as they are, not bent into sight
    /// ([`crate::scene::surface::SurfacePoint`]).
    fn is_true_from(&self, to_viewer: Vec3) -> bool {
        let geometric = self.sides.geometric_normal;
        let geometric_cos = geometric.dot(to_viewer);
        let is_true = |normal: Vec3| {
            let cos = normal.dot(to_viewer);
            let mirrored = 2.0 * cos * normal.dot(geometric) - geometric_cos;
            geometric_cos > 0.0
                && cos >= TRUE_COSINE_SHARE * geometric_cos
                && mirrored >= (TRUE_MIRROR_SHARE * geometric_cos).min(TRUE_MIRROR_COSINE)
        };
        let coat = self.bsdf().coat_normal().map(|n| self.shading_frame.world_from_local(n));
        is_true(self.shading_frame.z) && coat.is_none_or(is_true)
    }
}

/// A pixel's way to a second vertex.
struct Connection {
    pixel: usize,
    /// Unit, from the second vertex to the first.
    direction: Vec3,
    /// What of the second vertex's radiance reaches the pixel, before it is divided by the density.
    weight: Vec3,
}

impl Second<'_, '_> {
    /// Adds what the vertex sends to every pixel of the tile.
    fn connect(
        mut self,
        tile: &SharedTile,
        firsts: &[Option<First<'_>>],
        connections: &mut Vec<Connection>,
        results: &mut [PathResult],
    ) {
        let scatterer = &self.vertex.scatterer;
        let incident = self.path.incident(&self.vertex, tile.continuations);
        results[self.owner].rays += self.path.rays;
        let outgoing = Outgoing::new(scatterer, incident);
        let tracer = self.path.tracer;

        connections.clear();
        let position = self.vertex.position;
        let surface = scatterer.surface();
        let normal = surface.map(|surface| surface.sides.geometric_normal);
        let target = normal.map_or(position, |normal| offset_origin(position, normal));
        let mut density = 0.0;
        for (pixel, first) in firsts.iter().enumerate() {
            let Some(first) = first else { continue };
            let to_second = position - first.vertex.position;
            let squared = to_second.length_squared();
            let distance = squared.sqrt();
            let direction = to_second / distance;
            let cosine = normal.map_or(1.0, |normal| -normal.dot(direction));
            // Connections start from the vertex.
            if !(cosine > 0.0 && squared > 0.0) || first.vertex.scatterer.lifts(direction) {
                continue;
            }
            let scattered = first.vertex.scatterer.scattered(direction);
            let Some((f, pdf_solid_angle)) = scattered else { continue };
            let pdf_solid_angle = match (first.aiming, surface) {
                (Some(aiming), Some(surface)) => {
                    let at = (surface.triangle, distance);
                    let receiver = first.vertex.receiver();
                    let scene = &tracer.world.scene;
                    aiming.pdf_solid_angle(scene, at, &receiver, direction, pdf_solid_angle)
                }
                (Some(aiming), None) => aiming.probability_of_bsdf() * pdf_solid_angle,
                (None, _) => pdf_solid_angle,
            };
            let carried = first.throughput * f;
            if carried.max_element() <= 0.0 {
                continue;
            }
            if pixel != self.owner {
                if !scatterer.is_true_from(-direction) {
                    continue;
                }
                results[pixel].rays += 1;
                if !first.sees(target, direction, tracer) {
                    continue;
                }
            }
            let crossing = tracer.fog.as_ref().map_or(Crossing::CLEAR, |fog| {
                let stretch = fog.stretch(first.vertex.position, direction, distance);
                let length = stretch.map_or(0.0, |(from, to)| to - from);
                fog.interior.crossing(carried, length, surface.is_none())
            });
            let area = cosine / squared;
            let owner_probability = 1.0 / (tile.owner_side * tile.owner_side) as f32;
            density += owner_probability * pdf_solid_angle * area * crossing.density;
            let weight = carried * area * crossing.weight;
            connections.push(Connection { pixel, direction: -direction, weight });
        }
        if density <= 0.0 {
            return;
        }
        for connection in connections.iter() {
            let radiance = outgoing.radiance(connection.direction);
            results[connection.pixel].add(connection.weight * radiance / density);
        }
    }
}

impl First<'_> {
    /// Whether nothing at all is between this vertex and `target`, in about this direction.
    fn sees(&self, target: Vec3, direction: Vec3, tracer: &PathTracer<'_>) -> bool {
        let origin = self.vertex.scatterer.origin_toward(self.vertex.position, direction);
        let way = target - origin;
        let distance = way.length();
        let t_max = distance * SHADOW_RAY_SHARE;
        let ray = Ray { origin, direction: way / distance, t_min: 0.0, t_max };
        tracer.world.transmittance(&ray) == Vec3::ONE
    }
}

impl<'v> Outgoing<'v> {
    fn new(scatterer: &'v Scatterer<'v>, incident: Vec<Incident>) -> Self {
        let surface = match scatterer {
            Scatterer::Medium(medium) => return Self::InMedium(medium.phase, incident),
            Scatterer::Surface(surface) => surface,
        };
        let bsdf = surface.bsdf();
        if !bsdf.is_body_only() {
            return Self::Directed(surface, incident);
        }
        let upward = bsdf.viewed_from(Vec3::Z);
        let radiance: Vec3 = incident.iter().map(|i| upward.eval(i.wi) * i.light).sum();
        match bsdf.left(Vec3::Z) {
            _ if bsdf.is_lambert => Self::Lambert(radiance),
            left if left > 0.0 => Self::Body(surface, radiance / left),
            _ => Self::Directed(surface, incident),
        }
    }

    /// Radiance towards a world direction.
    fn radiance(&self, direction: Vec3) -> Vec3 {
        match self {
            Self::Lambert(radiance) => *radiance,
            Self::Body(surface, radiance) => {
                let wo = surface.shading_frame.local_from_world(direction);
                if wo.z > 0.0 { *radiance * surface.bsdf().left(wo) } else { Vec3::ZERO }
            }
            Self::Directed(surface, incident) => {
                let wo = surface.shading_frame.local_from_world(direction);
                let viewed = surface.bsdf().viewed_from(wo);
                incident.iter().map(|i| viewed.eval(i.wi) * i.light).sum()
            }
            Self::InMedium(phase, incident) => {
                let turned = |i: &Incident| phase.pdf_solid_angle(-i.wi.dot(direction));
                incident.iter().map(|i| turned(i) * i.light).sum()
            }
        }
    }
}

impl PathResult {
    /// Adds radiance, unless it is not finite.
    fn add(&mut self, radiance: Vec3) {
        let sum = self.radiance + radiance;
        if sum.is_finite() {
            self.radiance = sum;
        } else {
            self.was_invalid = true;
        }
    }
}
