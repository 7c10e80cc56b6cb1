//! What paths aim at: surfaces that throw light which hardly any ray towards a light finds. Light comes scattered through
//! frosted panes, cloth and lampshades; metals throw that of the sun and of lamps onto what is around them (caustics).
//!
//! A path finds that light only where its BSDF's sample happens to meet such a surface. A path therefore aims at them
//! with a probability `a`: it chooses one of their triangles by a light tree, as if they were lamps, and a point on it.
//! Where a ray arrives at such a triangle, both ways may have led there, and the path is weighed by the sum of their
//! densities, `(1 - a) p_bsdf + a p_aim` (one-sample balance heuristic: Veach and Guibas, *Optimally Combining Sampling
//! Techniques for Monte Carlo Rendering*, SIGGRAPH 1995). A ray that was aimed ends with nothing if something else is
//! in the way.
//!
//! How bright each triangle is for the tree, a few paths say that look at it from either side. How much of the light
//! that the camera sees comes from them decides `a`, and whether there is anything to aim at.

use std::ops::Range;
use std::sync::Arc;

use glam::Vec3;

use super::light_tree::{Light, LightTree, Moments, Receiver};
use super::triangles::{facing, point_on, relate, solid_angle_pdf};
use super::vertex::{Aim, Onward, SurfaceScatterer, Vertex};
use crate::sampler::unit_from_bits;
use crate::scene::{Material, Scene, TextureSlot};

/// Most triangles that paths aim at.
const MAX_TRIANGLES: usize = 1 << 15;
/// Roughness of metals that are aimed at. NEE finds little on smoother ones, and the light of rougher ones is found
/// without.
const METALS: Range<f32> = 0.05..0.6;

/// Triangles that paths aim at, and how one is chosen.
#[derive(Debug, Default)]
pub(crate) struct AimTargets {
    /// Ascending.
    pub(crate) triangles: Vec<u32>,
    pub(crate) tree: LightTree,
}

/// How paths aim.
#[derive(Debug, Clone)]
pub(crate) struct Aiming {
    pub(crate) targets: Arc<AimTargets>,
    /// Probability of aiming at one of them.
    pub(crate) probability: f32,
}

/// Whether light comes through it scattered.
fn is_translucent(material: &Material) -> bool {
    let is_frosted = material.transmission > 0.0 && material.roughness > 0.0;
    (is_frosted || material.diffuse_transmission > 0.0) && !material.unlit
}

/// Whether it is a metal that is neither smooth nor dull.
fn is_polished_metal(material: &Material) -> bool {
    let is_textured = material.texture(TextureSlot::MetallicRoughness).is_some();
    let is_metal = material.metallic > 0.5 && METALS.contains(&material.roughness);
    is_metal && !is_textured && !material.unlit
}

/// A triangle that paths may aim at.
pub(super) struct Facet {
    pub(super) triangle: u32,
    /// Its normal times its area in square metres.
    pub(super) area: Vec3,
}

impl AimTargets {
    /// Triangles of a scene that paths may aim at; without metals if they are too many, none if the others are.
    pub(super) fn facets(scene: &Scene) -> Vec<Facet> {
        let is_target =
            |material: &Material| is_translucent(material) || is_polished_metal(material);
        let few = |facets: &Vec<Facet>| facets.len() <= MAX_TRIANGLES;
        let all = Some(Self::facets_of(scene, is_target)).filter(few);
        all.or_else(|| Some(Self::facets_of(scene, is_translucent)).filter(few)).unwrap_or_default()
    }

    /// Triangles of such materials, or one more than may be.
    fn facets_of(scene: &Scene, is_target: impl Fn(&Material) -> bool) -> Vec<Facet> {
        let chosen: Vec<bool> = scene.materials.iter().map(is_target).collect();
        if !chosen.contains(&true) {
            return Vec::new();
        }
        let facet = |triangle: u32| {
            let is_chosen = chosen[scene.triangle_materials[triangle as usize] as usize];
            let [a, b, c] = if is_chosen { scene.corners(triangle) } else { [Vec3::ZERO; 3] };
            let area = 0.5 * (b - a).cross(c - a);
            (area.length() > 0.0).then_some(Facet { triangle, area })
        };
        scene.own_triangles().filter_map(facet).take(MAX_TRIANGLES + 1).collect()
    }

    /// Of facets with the brightness of radiance that leaves their fronts and backs.
    pub(super) fn new(scene: &Scene, facets: &[Facet], radiances: &[[f32; 2]]) -> Self {
        let light = |(index, (facet, radiance)): (u32, (&Facet, &[f32; 2]))| {
            let intensity =
                radiance.map(|side| (facet.area.length() * side).clamp(1e-30, f32::MAX));
            let front = facing(&scene.corners(facet.triangle), intensity[0]);
            let back = Moments { intensity: intensity[1], axis: -front.axis, ..front };
            Light { index, moments: front.with(&back) }
        };
        let mut lights: Vec<Light> = (0..).zip(facets.iter().zip(radiances)).map(light).collect();
        relate(&mut lights);
        let triangles: Vec<u32> = facets.iter().map(|facet| facet.triangle).collect();
        let tree = LightTree::new(lights, 1.0, &[], triangles.len());
        Self { triangles, tree }
    }

    /// Chooses a point as seen from a place: its triangle and itself.
    fn sample(&self, scene: &Scene, receiver: &Receiver, bits: [u32; 2]) -> (u32, Vec3) {
        let choice = self.tree.sample(receiver, bits[0]);
        let triangle = self.triangles[choice.light as usize];
        let (target, _) = point_on(&scene.corners(triangle), choice.remainder, bits[1]);
        (triangle, target)
    }

    /// Whether a vertex lies on one of them.
    pub(super) fn has(&self, vertex: &Vertex<'_>) -> bool {
        let surface = vertex.scatterer.surface();
        surface.is_some_and(|surface| self.triangles.binary_search(&surface.triangle).is_ok())
    }
}

impl Aiming {
    /// Density in solid angle with which a path arrives at a place of `triangle`, `distance` metres away along unit
    /// `direction`, from where the BSDF has that of `bsdf_pdf`.
    pub(super) fn pdf_solid_angle(
        &self,
        scene: &Scene,
        (triangle, distance): (u32, f32),
        receiver: &Receiver,
        direction: Vec3,
        bsdf_pdf: f32,
    ) -> f32 {
        let way = (direction, distance);
        let AimTargets { triangles, tree } = &*self.targets;
        let aimed = solid_angle_pdf((triangles, tree), scene, triangle, receiver, way);
        (1.0 - self.probability) * bsdf_pdf + self.probability * aimed
    }

    /// Probability with which the BSDF chooses the direction.
    pub(super) fn probability_of_bsdf(&self) -> f32 {
        1.0 - self.probability
    }

    /// Where a path goes on from a vertex by a number for the lobe, one that decides whether it aims, and two more.
    pub(super) fn onward(
        &self,
        scene: &Scene,
        vertex: &Vertex<'_>,
        surface: &SurfaceScatterer<'_>,
        [lobe, aim]: [f32; 2],
        bits: [u32; 2],
    ) -> Option<Onward> {
        let weight = 1.0 / self.probability_of_bsdf();
        if aim >= self.probability {
            let [x, y] = bits.map(unit_from_bits);
            let onward = surface.onward(Vec3::new(lobe, x, y))?;
            return Some(Onward { weight: onward.weight * weight, aim: Aim::Free, ..onward });
        }
        let (triangle, target) = self.targets.sample(scene, &vertex.receiver(), bits);
        // From where the ray begins, or it would miss small triangles.
        let origin = surface.sides.origin_toward(vertex.position, target - vertex.position);
        let direction = (target - origin).normalize();
        let (f, pdf_solid_angle) = vertex.scatterer.scattered(direction)?;
        let weight = f * (weight / pdf_solid_angle);
        let aim = Aim::At(triangle);
        Some(Onward { direction, weight, pdf_solid_angle, is_through: false, aim })
    }
}
