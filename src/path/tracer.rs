//! The loop itself: from vertex to vertex.

use std::borrow::Cow;

use glam::{Vec2, Vec3};

use super::background::Background;
use super::body::Body;
use super::light_tree::Receiver;
use super::lights::LocalLights;
use super::limits::{self, CutOff, MAX_INTERFACES, PathLimits};
use super::looks::{FirstHit, Looks};
use super::splitting::{MIN_NARROW, MIN_SHARED_NARROW, UseOfVertices};
use super::vertex::{Aim, MediumScatterer, Onward, Scatterer, SurfaceScatterer, Vertex};
use super::world::World;
use crate::bsdf::{Bsdf, Hero};
use crate::bvh::{Hit, Ray, offset_origin};
use crate::environment::Environment;
use crate::light_grid::cells::SphericalGrid;
use crate::light_grid::{LearningGrid, LightGrid, WHOLE_MAP};
use crate::math::balance_heuristic;
use crate::medium::Fog;
use crate::radiance_cache::RadianceCache;
use crate::sampler::Sampler;
use crate::scene::needs::SceneFeatures;
use crate::scene::surface::{Sides, SurfacePoint};

/// All that a path reads.
#[derive(Clone, Copy)]
pub struct PathTracer<'a> {
    /// Scene and BVH.
    pub world: &'a World,
    /// The map.
    pub environment: &'a Environment,
    /// The lights inside the scene that count.
    pub lights: &'a LocalLights,
    /// How NEE chooses tiles; `None` samples the map by the BSDF alone.
    pub grid: Option<&'a LightGrid>,
    /// Where it is counted what samples of the map see.
    pub counts: Option<&'a LearningGrid>,
    /// Where paths end once they have spread wide enough; `None` follows them all.
    pub cache: Option<&'a RadianceCache>,
    /// What lies between surfaces; `None` is clear air.
    pub fog: Option<Fog>,
    /// What the camera sees where it sees no surface.
    pub background: Background,
    /// When paths end.
    pub limits: PathLimits,
    /// Whether it is asked for what the camera sees first ([`PathResult::first_hit`]).
    pub layers: bool,
}

/// What one camera path brought back.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct PathResult {
    /// Radiance along the camera ray; finite.
    pub radiance: Vec3,
    /// Rays traced, shadow rays included.
    pub rays: u32,
    /// Whether the radiance was not finite and therefore left out.
    pub was_invalid: bool,
    /// The first surface, if any was hit and it is asked for.
    pub first_hit: Option<FirstHit>,
    /// Whether it went the way that carries less at a mirror or smooth glass before that surface: then it tells
    /// nothing of what is seen first, and nothing is in `first_hit`.
    pub is_minor: bool,
}

impl PathTracer<'_> {
    /// Radiance along a camera ray.
    pub fn radiance(&self, ray: Ray, sampler: Sampler) -> PathResult {
        let mut path = Path::new(self, ray, sampler);
        path.run();
        path.result()
    }

    /// What limits take of a camera path.
    pub(crate) fn cut_off(&self, ray: Ray, sampler: Sampler) -> CutOff {
        let mut path = Path::new(self, ray, sampler);
        let mut own_bsdf = None;
        while let Some(vertex) = path.next_vertex(&mut own_bsdf) {
            let carried = path.throughput.max_element();
            if !path.counts_vertex() {
                return CutOff { by_bounces: carried, by_interfaces: 0.0 };
            }
            if !path.scatter(&vertex) || !path.survives() {
                return CutOff::default();
            }
        }
        let is_caught = path.interfaces > MAX_INTERFACES;
        let by_interfaces = if is_caught { path.throughput.max_element() } else { 0.0 };
        CutOff { by_bounces: 0.0, by_interfaces }
    }

    /// Where the cells lie: what is counted and what was learned have the same ones.
    fn cells(&self) -> Option<&SphericalGrid> {
        self.counts.map(|counts| &counts.grid).or(self.grid.and_then(LightGrid::grid))
    }

    /// Tile distribution of NEE in a cell; it is fetched.
    fn distribution(&self, cell: Option<u32>) -> u32 {
        let Some((grid, cell)) = self.grid.zip(cell) else { return WHOLE_MAP };
        let distribution = grid.distribution_of_cell(cell);
        grid.distributions().prefetch(distribution);
        distribution
    }
}

/// The vertex a ray left from, as far as MIS asks.
#[derive(Clone, Copy)]
pub(super) struct Departure {
    /// As it left.
    pub(super) ray: Ray,
    /// Density in solid angle of the ray's direction; infinite if no NEE competes with it.
    pub(super) pdf_solid_angle: f32,
    pub(super) receiver: Receiver,
    pub(super) distribution: u32,
    /// Samples of the map that compete with it.
    pub(super) map_samples: u32,
    /// Whether smooth glass has refracted it since.
    pub(super) is_refracted: bool,
    /// Whether the ray was aimed.
    pub(super) aim: Aim,
}

/// Where a ray is not passed on straight.
enum Arrival<'a> {
    InMedium(Vertex<'static>),
    AtSurface(SurfacePoint<'a>),
}

/// A path under construction.
#[derive(Clone)]
pub(super) struct Path<'a> {
    pub(super) tracer: &'a PathTracer<'a>,
    pub(super) sampler: Sampler,
    pub(super) ray: Ray,
    pub(super) departure: Departure,
    pub(super) throughput: Vec3,
    /// What the path carried where `throughput` was set to one; 1 if it was not.
    pub(super) throughput_before: f32,
    pub(super) radiance: Vec3,
    pub(super) body: Body,
    /// Metres gone since the last vertex, passes included.
    pub(super) travelled: f32,
    /// Whether nothing on the way since the last vertex has taken any light.
    pub(super) is_clear: bool,
    /// Metres over which surfaces average what the path would find; kept if there is a cache.
    pub(super) spread: f32,
    /// Vertices so far that scatter light.
    pub(super) bounces: u32,
    /// Perfect reflections and refractions since.
    pub(super) interfaces: u32,
    /// Samples of the map that the next vertex takes.
    pub(super) map_samples: u32,
    pub(super) rays: u32,
    pub(super) looks: Looks,
    pub(super) use_of_vertices: UseOfVertices,
}

impl<'a> Path<'a> {
    pub(super) fn new(tracer: &'a PathTracer<'a>, ray: Ray, sampler: Sampler) -> Self {
        let receiver = Receiver { position: ray.origin, normal: Vec3::ZERO };
        let departure = Departure {
            ray,
            pdf_solid_angle: f32::INFINITY,
            receiver,
            distribution: WHOLE_MAP,
            map_samples: 1,
            is_refracted: false,
            aim: Aim::None,
        };
        Self {
            tracer,
            sampler,
            ray,
            departure,
            throughput: Vec3::ONE,
            throughput_before: 1.0,
            radiance: Vec3::ZERO,
            body: Body::AIR,
            travelled: 0.0,
            is_clear: true,
            spread: 0.0,
            bounces: 0,
            interfaces: 0,
            map_samples: 1,
            rays: 0,
            looks: Looks::default(),
            use_of_vertices: UseOfVertices::alone(tracer.cache.is_some()),
        }
    }

    /// Follows the path to its end.
    pub(super) fn run(&mut self) {
        let mut own_bsdf = None;
        // By reference: a vertex is too large to be moved for nothing.
        while let Some(ref vertex) = self.next_vertex(&mut own_bsdf) {
            if self.ends_in_cache(vertex) || !self.visit(vertex) {
                break;
            }
        }
    }

    /// Gathers light at a vertex, if the path may have one more, and chooses where the path goes on.
    /// `false` if it ends.
    pub(super) fn visit(&mut self, vertex: &Vertex<'_>) -> bool {
        if !self.counts_vertex() {
            return false;
        }
        let lights = vertex.scatterer.gathers().then(|| self.choose_lights(vertex));
        let lights = lights.unwrap_or_default();
        // Meanwhile memory is fetched.
        let onward = self.choose_onward(vertex);
        let mut gathered = Vec3::ZERO;
        self.for_arriving(vertex, &lights, |arriving| gathered += arriving.f * arriving.light);
        self.radiance += self.throughput * gathered;
        onward.is_some_and(|onward| self.go_on(vertex, &onward)) && self.survives()
    }

    /// Counts a vertex; `false` if the path may have no more of them.
    pub(super) fn counts_vertex(&mut self) -> bool {
        if self.bounces == self.tracer.limits.bounces {
            return false;
        }
        self.bounces += 1;
        self.interfaces = 0;
        true
    }

    /// Whether nothing has reflected, refracted or scattered it yet.
    fn is_of_camera(&self) -> bool {
        self.bounces + self.interfaces == 0
    }

    /// What it brought back.
    pub(super) fn result(&self) -> PathResult {
        let was_invalid = !self.radiance.is_finite();
        let frame = self.tracer.world.scene.frame;
        let in_metres = |hit: FirstHit| FirstHit { depth: frame.length_in_file(hit.depth), ..hit };
        PathResult {
            radiance: if was_invalid { Vec3::ZERO } else { self.radiance },
            rays: self.rays,
            was_invalid,
            first_hit: self.looks.first_hit().map(in_metres),
            is_minor: self.looks.is_minor,
        }
    }

    /// Follows the ray to the next place that scatters light, by way of what only reflects and refracts it; adds
    /// what is emitted on the way. A BSDF that is of that place alone is put into `own_bsdf`.
    pub(super) fn next_vertex<'v>(&mut self, own_bsdf: &'v mut Option<Bsdf>) -> Option<Vertex<'v>>
    where
        'a: 'v,
    {
        loop {
            // By reference: a point is large, too.
            match self.next_arrival() {
                None => return None,
                Some(Arrival::InMedium(vertex)) => return Some(vertex),
                Some(Arrival::AtSurface(ref point)) => {
                    let bsdf = self.bsdf_at(point)?;
                    if !bsdf.is_delta_only() {
                        let part = self.part_of(point, &bsdf);
                        let bsdf = match (part, bsdf) {
                            (Some(part), _) => own_bsdf.insert(part),
                            (None, Cow::Borrowed(ready)) => ready,
                            (None, Cow::Owned(own)) => own_bsdf.insert(own),
                        };
                        return Some(self.vertex_at(point, bsdf));
                    }
                    let interface = self.vertex_at(point, &bsdf);
                    if !self.passes_interface(&interface) {
                        return None;
                    }
                }
            }
        }
    }

    /// The narrow or the broad lobes of a BSDF, where only the broad ones can be shared or cached.
    fn part_of(&mut self, point: &SurfacePoint<'_>, bsdf: &Bsdf) -> Option<Bsdf> {
        let uses = self.use_of_vertices;
        let min_alpha = uses.min_alpha(self.bounces)?;
        let parameters = &point.parameters;
        if bsdf.is_broad(min_alpha)
            || parameters.transmission > 0.0
            || parameters.diffuse_transmission > 0.0
            || !self.is_known(point.position, point.geometric_normal)
        {
            return None;
        }
        let choice = match uses {
            // The probability must not depend on the pixel that finds the vertex: it is left out of the density.
            UseOfVertices::Shared if self.bounces == 1 => (Vec3::Z, MIN_SHARED_NARROW),
            _ => (point.shading_frame.local_from_world(-self.ray.direction), MIN_NARROW),
        };
        bsdf.split(min_alpha, choice, || self.sampler.next_pair()[0])
    }

    /// Goes on from a perfect interface; `false` if the path ends.
    fn passes_interface(&mut self, interface: &Vertex<'_>) -> bool {
        self.interfaces += 1;
        self.widen(interface);
        let onward = self.choose_onward(interface).filter(|_| self.interfaces <= MAX_INTERFACES);
        let Some(onward) = onward else { return false };
        self.looks.before += self.travelled;
        if self.looks_on()
            && let Scatterer::Surface(surface) = &interface.scatterer
        {
            self.looks.go_by(surface.bsdf.smooth_shares(), onward.is_through);
        }
        self.go_on(interface, &onward) && self.survives()
    }

    /// Whether it is asked for what the camera sees, and nothing has scattered the path yet.
    fn looks_on(&self) -> bool {
        self.tracer.layers && self.bounces == 0
    }

    /// Follows the ray to where it is not passed on straight; adds what is emitted on the way.
    #[inline(always)]
    fn next_arrival(&mut self) -> Option<Arrival<'a>> {
        self.travelled = 0.0;
        self.is_clear = true;
        for _ in 0..limits::MAX_PASSES {
            self.rays += 1;
            let hit = self.tracer.world.closest_hit(&self.ray, self.is_of_camera());
            if let Some(vertex) = self.fly(hit.map_or(f32::INFINITY, |hit| hit.t)) {
                return (!self.departure.is_aimed()).then_some(Arrival::InMedium(vertex));
            }
            if self.has_faded() {
                return None;
            }
            let Some(hit) = hit else {
                if !self.departure.is_aimed() {
                    self.escape();
                }
                return None;
            };
            self.travelled += hit.t;
            let point = self.tracer.world.point(&hit, self.ray.direction);
            if self.tracer.world.needs.has(SceneFeatures::EMITTERS) && !self.departure.is_aimed() {
                self.add_emitted(&hit, &point);
            }
            if !self.passes(&point) {
                if self.departure.aim != Aim::None {
                    self.throughput *= self.departure.weight_at(&point, self.tracer)?;
                    self.departure.aim = Aim::None;
                }
                return Some(Arrival::AtSurface(point));
            }
            self.ray.origin = offset_origin(point.position, -point.geometric_normal);
        }
        None
    }

    /// Whether the path is outside of all bodies.
    pub(super) fn is_in_air(&self) -> bool {
        self.body.interior.is_none()
    }

    /// Whether nothing is left that f32 can weigh.
    fn has_faded(&self) -> bool {
        self.throughput.max_element() < f32::MIN_POSITIVE
    }

    /// Takes the ray through what fills the way of `distance` metres to the next surface: a vertex
    /// if it is scattered there.
    fn fly(&mut self, distance: f32) -> Option<Vertex<'static>> {
        let fog = self.tracer.fog.as_ref();
        let (origin, direction) = (self.ray.origin, self.ray.direction);
        let (interior, from, to) = self.body.stretch(fog, &self.ray, distance)?;
        if !interior.scatters() {
            let left = interior.transmittance(to - from);
            self.throughput *= left;
            if self.looks_on() && !self.is_in_air() {
                self.looks.look_through(left);
            }
            return None;
        }
        if self.has_faded() {
            return None;
        }
        let flight = interior.fly(self.throughput, to - from, self.sampler.next_pair_bits());
        self.throughput *= flight.weight;
        let position = origin + direction * (from + flight.scattered_at?);
        // From inside of a solid the map is not seen: it is not asked in vain, and what fog learns is not spoilt.
        if !self.is_in_air() {
            self.map_samples = 0;
        }
        let cells = self.tracer.cells().filter(|_| self.is_in_air());
        let cell = cells.map(|cells| cells.cell_in_medium(position));
        let distribution = self.tracer.distribution(cell);
        let medium = MediumScatterer { phase: interior.phase, travel: direction };
        Some(Vertex { position, cell, distribution, scatterer: Scatterer::Medium(medium) })
    }

    /// Decides whether the ray goes straight through the surface, and weighs the path accordingly.
    fn passes(&mut self, point: &SurfacePoint<'_>) -> bool {
        let world = self.tracer.world;
        let through = world.straight_through(point, self.ray.direction);
        let probability = through.max_element().min(1.0);
        if probability <= 0.0 {
            return false;
        }
        let passes = probability >= 1.0 || self.sampler.next_pair()[0] < probability;
        self.is_clear &= !passes || through == Vec3::ONE;
        if passes && self.looks_on() && point.parameters.transmission > 0.0 {
            let bsdf = world.material(point.material).bsdf(point);
            let wo = point.shading_frame.local_from_world(-self.ray.direction);
            if bsdf.is_delta_only() {
                self.looks.go_by(bsdf.viewed_from(wo).smooth_shares(), true);
            }
        }
        self.throughput *= if passes {
            through / probability
        } else {
            Vec3::splat(world.coverage(point) / (1.0 - probability))
        };
        passes
    }

    /// How the surface scatters light; `None` if it is unlit: then it is seen as it is.
    #[inline(always)]
    fn bsdf_at(&mut self, point: &SurfacePoint<'_>) -> Option<Cow<'a, Bsdf>> {
        let (world, parameters) = (self.tracer.world, &point.parameters);
        let mut bsdf = world.material(point.material).bsdf(point);
        if parameters.dispersion > 0.0 {
            let hero = Hero::choose(self.throughput, self.sampler.next_pair()[0]);
            bsdf = Cow::Owned(bsdf.of_hero(hero));
        }
        if self.looks_on() {
            self.looks.look_at(point, &bsdf, self.travelled);
        }
        if parameters.unlit {
            let emitted = parameters.emissive * self.tracer.lights.emission_of(point.material);
            self.radiance += self.throughput * emitted;
            return None;
        }
        Some(bsdf)
    }

    /// The surface as a place that scatters.
    fn vertex_at<'v>(&self, point: &SurfacePoint<'_>, bsdf: &'v Bsdf) -> Vertex<'v>
    where
        'a: 'v,
    {
        let cells = self.tracer.cells();
        let cell = cells.map(|cells| cells.cell_of(point.position, point.geometric_normal));
        let distribution = self.tracer.distribution(cell);
        let parameters = &point.parameters;
        let diffuses = parameters.diffuse_transmission > 0.0;
        let material = self.tracer.world.material(point.material);
        let wo = point.shading_frame.local_from_world(-self.ray.direction);
        let scatterer = Scatterer::Surface(SurfaceScatterer {
            triangle: point.triangle,
            sides: Sides::of(point),
            shading_frame: point.shading_frame,
            bsdf: bsdf.viewed_from(wo),
            behind: material.behind(point),
            transmits: parameters.transmission > 0.0 || diffuses,
            refracts: parameters.transmission > 0.0 || (diffuses && !parameters.thin),
            is_clear: material.passing.clear,
        });
        Vertex { position: point.position, cell, distribution, scatterer }
    }

    /// Adds what a surface emits, whether the ray then passes it or not.
    fn add_emitted(&mut self, hit: &Hit, point: &SurfacePoint<'_>) {
        let world = self.tracer.world;
        let emitted = self.tracer.lights.emitted(&world.scene, point, -self.ray.direction);
        if emitted.max_element() <= 0.0 {
            return;
        }
        let from = self.departure;
        let weight = if from.pdf_solid_angle.is_infinite() {
            1.0
        } else if from.is_refracted {
            let walk = from.straight_walk(self.tracer);
            self.rays += walk.rays;
            balance_heuristic(from.pdf_solid_angle, walk.lamp_pdf)
        } else {
            let (lights, receiver) = (self.tracer.lights, &from.receiver);
            let way = (self.ray.direction, receiver.position.distance(point.position));
            let nee = lights.sample_pdf_solid_angle(&world.scene, hit.triangle, receiver, way);
            balance_heuristic(from.pdf_solid_angle, nee)
        };
        self.radiance += self.throughput * emitted * weight;
    }

    /// The ray leaves the scene: adds the map's radiance.
    fn escape(&mut self) {
        let environment = self.tracer.environment;
        if self.is_of_camera() && self.tracer.background != Background::Map {
            let u = Vec2::from(self.sampler.next_pair());
            let background = self.tracer.background;
            self.radiance +=
                self.throughput * background.radiance(environment, self.ray.direction, u);
            return;
        }
        let from = self.departure;
        let Some(grid) = self.tracer.grid.filter(|_| from.pdf_solid_angle.is_finite()) else {
            self.radiance += self.throughput * environment.radiance(self.ray.direction);
            return;
        };
        let (mut radiance, tile, in_tile) = environment.radiance_and_tile_pdf(from.ray.direction);
        let mut nee = from.map_samples as f32 * grid.probability(from.distribution, tile) * in_tile;
        if from.is_refracted {
            radiance = environment.radiance(self.ray.direction);
            self.rays += 1;
            // More than glass is in the way.
            if self.tracer.world.transmittance_but_for_glass(&from.ray).0 == Vec3::ZERO {
                nee = 0.0;
            }
        }
        self.radiance += self.throughput * radiance * balance_heuristic(from.pdf_solid_angle, nee);
    }

    /// Chooses where the path goes on, and goes there. `false` if it ends.
    pub(super) fn scatter(&mut self, vertex: &Vertex<'_>) -> bool {
        self.choose_onward(vertex).is_some_and(|onward| self.go_on(vertex, &onward))
    }

    /// Chooses where the path goes on; `None` if it ends.
    pub(super) fn choose_onward(&mut self, vertex: &Vertex<'_>) -> Option<Onward> {
        match &vertex.scatterer {
            Scatterer::Surface(surface) => {
                let aiming = self.tracer.aiming_from(vertex);
                if let Some(aiming) = aiming.filter(|_| self.is_in_air()) {
                    let choice = self.sampler.next_pair();
                    let bits = self.sampler.next_pair_bits();
                    return aiming.onward(&self.tracer.world.scene, vertex, surface, choice, bits);
                }
                let lobe = if surface.bsdf().is_lambert {
                    self.sampler.skip(1);
                    0.0
                } else {
                    self.sampler.next_pair()[0]
                };
                let [x, y] = self.sampler.next_pair();
                surface.onward(Vec3::new(lobe, x, y))
            }
            Scatterer::Medium(medium) => Some(medium.onward(Vec2::from(self.sampler.next_pair()))),
        }
    }

    /// Goes where was chosen. `false` if nothing goes on.
    pub(super) fn go_on(&mut self, vertex: &Vertex<'_>, onward: &Onward) -> bool {
        self.throughput *= onward.weight;
        if self.throughput.max_element() <= 0.0 || !self.throughput.is_finite() {
            return false;
        }
        let origin = vertex.scatterer.origin_toward(vertex.position, onward.direction);
        if onward.is_through
            && let Scatterer::Surface(surface) = &vertex.scatterer
        {
            self.body = surface.behind.copied().unwrap_or(self.body);
            if surface.is_clear {
                // NEE at the vertex before goes the same way.
                self.departure.is_refracted = true;
                self.ray = Ray { origin, direction: onward.direction, ..self.ray };
                return true;
            }
        }
        self.ray = Ray { origin, direction: onward.direction, t_min: 0.0, t_max: f32::INFINITY };
        self.departure = Departure {
            ray: self.ray,
            pdf_solid_angle: onward.pdf_solid_angle,
            receiver: vertex.receiver(),
            distribution: vertex.distribution,
            map_samples: self.map_samples,
            is_refracted: false,
            aim: onward.aim,
        };
        self.map_samples = 1;
        true
    }

    /// Russian roulette.
    pub(super) fn survives(&mut self) -> bool {
        let Some(probability) = self.survival() else { return false };
        self.throughput /= probability;
        true
    }

    /// With which probability the path has survived; `None` if it has not. By throughput, as it would
    /// be in air: refraction into a body is no loss.
    #[inline]
    pub(super) fn survival(&mut self) -> Option<f32> {
        let is_young = self.bounces + self.interfaces < limits::ROULETTE_AFTER;
        if !self.tracer.limits.russian_roulette || is_young {
            return Some(1.0);
        }
        let in_air = self.throughput.max_element() * self.body.squared_index;
        let carried = self.throughput_before * in_air;
        let probability = (limits::ROULETTE_MILDNESS * carried).clamp(limits::MIN_SURVIVAL, 1.0);
        let survives = probability >= 1.0 || self.sampler.next_pair()[1] < probability;
        survives.then_some(probability)
    }
}
