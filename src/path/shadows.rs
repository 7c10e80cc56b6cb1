//! Rays towards lights: what of the light arrives at a vertex, straight on or refracted by smooth glass.
//!
//! The integral at a vertex is over directions there. NEE draws one by what it would show without glass, and the
//! estimate follows the chain of perfect refractions that a path goes in this direction: `f T(w) L(w')` over the
//! sum of all densities of `w`. A path that has only been refracted since it left the vertex is weighed by the
//! density of the direction it left in, so that all is counted once; chains with a reflection are found by paths
//! alone. Where the straight ray is blocked by more than glass, NEE finds nothing, and its density is 0.

use glam::Vec3;

use super::body::Body;
use super::light_tree::Receiver;
use super::limits::{MAX_INTERFACES, MAX_PASSES};
use super::tracer::{Departure, Path, PathTracer};
use super::vertex::Vertex;
use crate::bvh::{Ray, offset_origin};
use crate::scene::needs::SceneFeatures;

/// Share of the way to a light, or to a vertex, that a shadow ray goes: it stops short of that surface.
pub(crate) const SHADOW_RAY_SHARE: f32 = 1.0 - 1e-4;

/// What lies between a vertex and a light.
pub(super) enum Sight {
    /// No glass; so much of the light arrives.
    Straight(Vec3),
    /// Smooth glass, and nothing that blocks the straight ray: where that begins.
    ThroughGlass(Ray, Body),
}

/// How a walk through glass goes on at an interface.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Course {
    /// As light does.
    Refracted,
    /// As if there were no refraction, though as much is reflected.
    Straight,
}

/// What was found on a walk through glass.
pub(super) struct GlassWalk {
    /// Rays traced.
    pub(super) rays: u32,
    /// Share of radiance that comes from its end; zero if it ends on a surface.
    pub(super) transmittance: Vec3,
    /// Unit, in which it has ended.
    pub(super) direction: Vec3,
    /// Radiance of emissive triangles behind glass that arrives.
    pub(super) emitted: Vec3,
    /// Density in solid angle with which emissive triangles behind glass are chosen in the direction of departure,
    /// if that was asked for.
    pub(super) lamp_pdf: f32,
}

impl Path<'_> {
    /// What lies on the way of `distance` metres from a vertex.
    pub(super) fn sight(&mut self, vertex: &Vertex<'_>, direction: Vec3, distance: f32) -> Sight {
        let world = self.tracer.world;
        let surface = vertex.scatterer.surface();
        let below = surface.filter(|surface| !surface.sides.is_above(direction));
        let body = below.and_then(|surface| surface.behind).copied().unwrap_or(self.body);
        let origin = vertex.scatterer.origin_toward(vertex.position, direction);
        let ray = Ray { origin, direction, t_min: 0.0, t_max: distance * SHADOW_RAY_SHARE };
        let stretch = body.stretch(self.tracer.fog.as_ref(), &ray, distance);
        let left =
            stretch.map_or(Vec3::ONE, |(interior, from, to)| interior.transmittance(to - from));
        let has_glass = world.needs.has(SceneFeatures::CLEAR_SOLIDS);
        if left == Vec3::ZERO && !has_glass {
            return Sight::Straight(left);
        }
        self.rays += 1;
        if !has_glass {
            return Sight::Straight(world.transmittance(&ray) * left);
        }
        let (transmittance, meets_glass) = world.transmittance_but_for_glass(&ray);
        if meets_glass && transmittance != Vec3::ZERO {
            return Sight::ThroughGlass(ray, body);
        }
        Sight::Straight(transmittance * left)
    }

    /// Share of the map's light that arrives at a vertex, and the direction it comes from if glass refracts it.
    pub(super) fn share_of_map(
        &mut self,
        vertex: &Vertex<'_>,
        direction: Vec3,
    ) -> (Vec3, Option<Vec3>) {
        match self.sight(vertex, direction, f32::INFINITY) {
            Sight::Straight(share) => (share, None),
            Sight::ThroughGlass(ray, body) => {
                let walk = GlassWalk::new(self.tracer, ray, body, Course::Refracted, None);
                self.rays += walk.rays;
                (walk.transmittance, Some(walk.direction))
            }
        }
    }
}

impl Departure {
    /// Sums the densities with which NEE chooses emissive triangles behind glass in the direction of departure.
    pub(super) fn straight_walk(&self, tracer: &PathTracer<'_>) -> GlassWalk {
        GlassWalk::new(tracer, self.ray, Body::AIR, Course::Straight, Some(&self.receiver))
    }
}

impl GlassWalk {
    /// Follows a ray through any number of smooth glass interfaces, as far as it reaches. With a receiver, densities
    /// of lamps there are summed.
    pub(super) fn new(
        tracer: &PathTracer<'_>,
        mut ray: Ray,
        mut body: Body,
        course: Course,
        receiver: Option<&Receiver>,
    ) -> Self {
        let world = tracer.world;
        let mut interfaces = 0;
        // What is left where only surfaces that are passed straight through count.
        let mut uncovered = Vec3::ONE;
        let mut walk = Self {
            rays: 0,
            transmittance: Vec3::ONE,
            direction: ray.direction,
            emitted: Vec3::ZERO,
            lamp_pdf: 0.0,
        };
        for _ in 0..MAX_PASSES {
            walk.rays += 1;
            let hit = world.closest_hit(&ray, false);
            let distance = hit.map_or(ray.t_max, |hit| hit.t);
            if let Some((interior, from, to)) = body.stretch(tracer.fog.as_ref(), &ray, distance) {
                walk.transmittance *= interior.transmittance(to - from);
            }
            let Some(hit) = hit else { return walk };
            let point = world.point(&hit, ray.direction);
            if interfaces > 0 && world.needs.has(SceneFeatures::EMITTERS) {
                let emitted = tracer.lights.emitted(&world.scene, &point, -ray.direction);
                walk.emitted += walk.transmittance * emitted;
                if let Some(receiver) = receiver.filter(|_| emitted.max_element() > 0.0) {
                    let (lights, scene) = (tracer.lights, &world.scene);
                    let way = (ray.direction, receiver.position.distance(point.position));
                    walk.lamp_pdf +=
                        lights.sample_pdf_solid_angle(scene, hit.triangle, receiver, way);
                }
            }
            let material = world.material(point.material);
            if material.passing.clear {
                interfaces += 1;
                let wo = point.shading_frame.local_from_world(-ray.direction);
                if course == Course::Straight {
                    let [_, transmitted] =
                        material.bsdf_from(&point, true).viewed_from(wo).smooth_shares();
                    walk.transmittance *= transmitted;
                } else {
                    let refracted = material.bsdf(&point).refracted(wo);
                    let refracted = refracted.filter(|_| interfaces <= MAX_INTERFACES);
                    let Some((wi, weight)) = refracted else { break };
                    walk.transmittance *= weight;
                    ray.direction = point.shading_frame.world_from_local(wi).normalize();
                    if point.geometric_normal.dot(ray.direction) > 0.0 {
                        break;
                    }
                    walk.direction = ray.direction;
                }
                body = material.behind(&point).copied().unwrap_or(body);
            } else {
                let through = world.straight_through(&point, ray.direction);
                walk.transmittance *= through;
                uncovered *= through;
            }
            let left = if course == Course::Straight { uncovered } else { walk.transmittance };
            if left.max_element() <= 0.0 {
                break;
            }
            ray.origin = offset_origin(point.position, -point.geometric_normal);
            ray.t_max -= hit.t;
        }
        walk.transmittance = Vec3::ZERO;
        walk
    }
}
