//! Places at which paths scatter light.

use glam::{Vec2, Vec3};

use super::body::Body;
use super::light_tree::Receiver;
use crate::bsdf::{Bsdf, ViewedBsdf};
use crate::math::Frame;
use crate::medium::Phase;
use crate::scene::surface::Sides;

/// A place at which light is scattered.
pub(super) struct Vertex<'v> {
    pub(super) position: Vec3,
    /// Cell of the Light Grid it lies in; `None` without one.
    pub(super) cell: Option<u32>,
    /// Tile distribution of NEE here.
    pub(super) distribution: u32,
    pub(super) scatterer: Scatterer<'v>,
}

impl Vertex<'_> {
    /// What lights are chosen for. What lets light through is lit from behind as well.
    pub(super) fn receiver(&self) -> Receiver {
        let opaque = self.scatterer.surface().filter(|surface| !surface.transmits);
        let normal = opaque.map_or(Vec3::ZERO, |surface| surface.shading_frame.z);
        Receiver { position: self.position, normal }
    }
}

/// Light that next event estimation has found.
pub(super) struct Arriving {
    /// Unit, to where it comes from.
    pub(super) direction: Vec3,
    /// What of it goes on along the path: BSDF times cosine, or phase function.
    pub(super) f: Vec3,
    /// Its radiance over the sum of all densities that it may be found with.
    pub(super) light: Vec3,
}

/// Whether a ray was aimed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) enum Aim {
    /// It could not be.
    #[default]
    None,
    /// It could have been, but was not.
    Free,
    /// At this triangle.
    At(u32),
}

/// What scatters light at a vertex.
pub(super) enum Scatterer<'v> {
    Surface(SurfaceScatterer<'v>),
    Medium(MediumScatterer),
}

#[derive(Clone, Copy)]
pub(super) struct MediumScatterer {
    pub(super) phase: Phase,
    /// In which direction the path came, unit.
    pub(super) travel: Vec3,
}

pub(super) struct SurfaceScatterer<'v> {
    pub(super) triangle: u32,
    /// Above is where the path came from.
    pub(super) sides: Sides,
    pub(super) shading_frame: Frame,
    /// Towards where the path came from, in the shading frame.
    pub(super) bsdf: ViewedBsdf<'v>,
    /// What lies behind the surface; `None` if it is what lies before it.
    pub(super) behind: Option<&'v Body>,
    /// Whether light comes through the surface.
    pub(super) transmits: bool,
    /// Whether some of that is refracted or goes on inside of a body.
    pub(super) refracts: bool,
    /// Whether it is of smooth solid glass that shadow rays follow.
    pub(super) is_clear: bool,
}

impl<'v> Scatterer<'v> {
    /// The surface; `None` in a medium.
    #[inline(always)]
    pub(super) fn surface(&self) -> Option<&SurfaceScatterer<'v>> {
        if let Self::Surface(surface) = self { Some(surface) } else { None }
    }

    /// What share of light from `direction` goes on along the path, and the density with which
    /// the path chooses that direction; `None` if it is no light.
    pub(super) fn scattered(&self, direction: Vec3) -> Option<(Vec3, f32)> {
        match self {
            Self::Surface(surface) => surface.scattered(direction),
            Self::Medium(medium) => {
                let density = medium.pdf_solid_angle(direction);
                Some((Vec3::splat(density), density))
            }
        }
    }

    /// Whether next event estimation can find light.
    pub(super) fn gathers(&self) -> bool {
        self.surface().is_none_or(|surface| surface.bsdf().gathers())
    }

    /// Whether rays in this direction do not start from the vertex itself ([`Sides::lifts`]).
    pub(super) fn lifts(&self, direction: Vec3) -> bool {
        self.surface().is_some_and(|surface| surface.sides.lifts(direction))
    }

    /// Where a ray from `position` in this direction begins.
    #[inline]
    pub(super) fn origin_toward(&self, position: Vec3, direction: Vec3) -> Vec3 {
        self.surface().map_or(position, |surface| surface.sides.origin_toward(position, direction))
    }
}

impl MediumScatterer {
    /// Where a path goes on by two uniform numbers.
    pub(super) fn onward(&self, u: Vec2) -> Onward {
        let direction = self.phase.sample(self.travel, u).normalize();
        let pdf_solid_angle = self.pdf_solid_angle(direction);
        Onward { direction, weight: Vec3::ONE, pdf_solid_angle, is_through: false, aim: Aim::None }
    }

    fn pdf_solid_angle(&self, direction: Vec3) -> f32 {
        self.phase.pdf_solid_angle(self.travel.dot(direction))
    }
}

impl<'v> SurfaceScatterer<'v> {
    /// The scattering towards everywhere.
    pub(super) fn bsdf(&self) -> &'v Bsdf {
        self.bsdf.bsdf
    }

    /// BSDF times cosine and the BSDF's density for light from `direction`; `None` where it is
    /// black, or where shading and geometric normal disagree about the side.
    pub(super) fn scattered(&self, direction: Vec3) -> Option<(Vec3, f32)> {
        let wi = self.shading_frame.local_from_world(direction);
        if (wi.z > 0.0) != self.sides.is_above(direction) {
            return None;
        }
        let (f, pdf_solid_angle) = self.bsdf.eval_pdf(wi);
        (f.max_element() > 0.0).then_some((f, pdf_solid_angle))
    }

    /// Where a path goes on by three uniform numbers; `None` if it ends, as where shading and geometric
    /// normal disagree about the side.
    pub(super) fn onward(&self, u: Vec3) -> Option<Onward> {
        let sample = self.bsdf.sample(u)?;
        let direction = self.shading_frame.world_from_local(sample.wi).normalize();
        let is_through = sample.is_transmission;
        let pdf_solid_angle = if sample.is_delta { f32::INFINITY } else { sample.pdf_solid_angle };
        let weight = sample.weight;
        let onward = Onward { direction, weight, pdf_solid_angle, is_through, aim: Aim::None };
        (self.sides.is_above(direction) != is_through).then_some(onward)
    }
}

/// Where a path goes on.
pub(super) struct Onward {
    /// Unit.
    pub(super) direction: Vec3,
    /// BSDF times cosine over density; 1 in a medium.
    pub(super) weight: Vec3,
    /// Infinite if no NEE competes with it.
    pub(super) pdf_solid_angle: f32,
    /// Whether it goes through the surface.
    pub(super) is_through: bool,
    /// Whether the direction was aimed.
    pub(super) aim: Aim,
}
