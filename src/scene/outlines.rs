//! Inverted hulls: an enlarged copy of a model that faces inwards, which gives it a dark outline where
//! back faces are not drawn. Here surfaces stop light from both sides, so a hull would shut it all out.

use glam::Vec3;
use rayon::prelude::*;

use super::instances::Surface;
use super::{AlphaMode, Material, Scene};
use crate::error::Decoded;

/// Triangles of a material that are looked at.
const SAMPLES: usize = 256;
/// Share of them that must lie over a surface for the material to be a hull's.
const SHARE: f32 = 0.8;
/// How far a hull lies from what it outlines, at most: a share of its own size.
const DISTANCE: f32 = 0.05;

/// A triangle's centre and its normal, as long as twice its area.
fn facing(scene: &Scene, surface: Surface<'_>) -> (Vec3, Vec3) {
    let [a, b, c] = scene.corners_at(surface);
    ((a + b + c) / 3.0, (b - a).cross(c - a))
}

fn is_hull(scene: &Scene, material: u32) -> bool {
    // A mesh that instances share has its outline with it: one of them tells.
    let of = |own: bool| {
        let is_of = move |place: usize| (scene.triangle_materials[place] == material) == own;
        scene.each_once().filter(move |(place, _)| is_of(*place))
    };
    let own: Vec<Surface<'_>> = of(true).collect();
    if own.is_empty() || of(false).next().is_none() {
        return false;
    }
    let corners = own.iter().flat_map(|surface| scene.corners_at(*surface));
    let (low, high) = corners.fold((Vec3::MAX, Vec3::MIN), |(l, h), p| (l.min(p), h.max(p)));
    let (middle, reach) = (0.5 * (low + high), DISTANCE * (high - low).length());
    // Six times the volume that the triangles enclose, negative where they face inwards.
    let volume: f64 = own
        .iter()
        .map(|&triangle| {
            let (centre, normal) = facing(scene, triangle);
            (centre - middle).as_dvec3().dot(normal.as_dvec3())
        })
        .sum();
    if volume >= 0.0 {
        return false;
    }
    // Only what is near the hull can lie below it.
    let others: Vec<(Vec3, Vec3)> = of(false)
        .map(|triangle| facing(scene, triangle))
        .filter(|(at, _)| {
            at.cmpge(low - Vec3::splat(reach)).all() && at.cmple(high + Vec3::splat(reach)).all()
        })
        .collect();
    let step = own.len().div_ceil(SAMPLES);
    let samples: Vec<Surface<'_>> = own.into_iter().step_by(step).collect();
    let covering = samples
        .par_iter()
        .filter(|&&triangle| {
            let (centre, normal) = facing(scene, triangle);
            let distance = |other: &&(Vec3, Vec3)| other.0.distance_squared(centre);
            let below = others.iter().min_by(|a, b| distance(a).total_cmp(&distance(b)));
            below.is_some_and(|&(at, other)| {
                let towards = normal.normalize_or_zero().dot(other.normalize_or_zero());
                at.distance(centre) <= reach && towards < -0.5 && (centre - at).dot(other) > 0.0
            })
        })
        .count();
    covering as f32 >= SHARE * samples.len() as f32
}

impl Scene {
    /// Numbers of the materials whose triangles are a hull around others: single-sided, inside out as a
    /// whole, and close over other surfaces that face the other way.
    pub(super) fn hulls(&self) -> Vec<u32> {
        let may_be = |material: &Material| {
            !material.double_sided && material.alpha_mode == AlphaMode::Opaque
        };
        (0..)
            .zip(&self.materials)
            .filter(|(number, material)| may_be(material) && is_hull(self, *number))
            .map(|(number, _)| number)
            .collect()
    }

    /// Leaves out all that is of materials of these names.
    ///
    /// # Errors
    /// The cause: a name is no material's, or nothing would be left.
    pub(crate) fn hide(&mut self, names: &[String]) -> Decoded<()> {
        for name in names {
            let named = (0..).zip(&self.materials).filter(|(_, material)| material.name == *name);
            let hidden: Vec<u32> = named.map(|(number, _)| number).collect();
            if hidden.is_empty() {
                return Err(format!("no material to hide is called {name}"));
            }
            self.remove_triangles_of(&hidden);
        }
        self.check_shown()
    }

    /// Whether anything was left to be shown.
    ///
    /// # Errors
    /// The cause, if nothing was.
    pub(super) fn check_shown(&self) -> Decoded<()> {
        match self.triangles.is_empty() {
            true => Err("all of it is hidden, so there is nothing to render".into()),
            false => Ok(()),
        }
    }

    /// Removes the triangles of some materials; the materials stay, unused.
    pub(super) fn remove_triangles_of(&mut self, materials: &[u32]) {
        let keeps = |place: u32| !materials.contains(&self.triangle_materials[place as usize]);
        self.instances = std::mem::take(&mut self.instances).retained(keeps);
        let mut keep = self.triangle_materials.iter().map(|m| !materials.contains(m));
        self.triangles.retain(|_| keep.next().unwrap_or(true));
        self.triangle_materials.retain(|m| !materials.contains(m));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Appends a sphere of 16 x 32 patches; `inwards` turns its triangles around.
    fn sphere(scene: &mut Scene, radius: f32, inwards: bool, material: u32) {
        let first = scene.positions.len() as u32;
        for (i, j) in (0..=16).flat_map(|i| (0..32).map(move |j| (i, j))) {
            let (theta, phi) = (i as f32 / 16.0, j as f32 / 16.0);
            let (sin, cos) = (theta * std::f32::consts::PI).sin_cos();
            let (s, c) = (phi * std::f32::consts::PI).sin_cos();
            scene.positions.push(radius * Vec3::new(sin * c, cos, sin * s));
        }
        for (i, j) in (0..16).flat_map(|i| (0..32).map(move |j| (i, j))) {
            let at = |i: u32, j: u32| first + 32 * i + j % 32;
            let corners = [at(i, j), at(i, j + 1), at(i + 1, j + 1), at(i + 1, j)];
            for [a, b, c] in
                [[corners[0], corners[1], corners[2]], [corners[0], corners[2], corners[3]]]
            {
                scene.triangles.push(if inwards { [a, c, b] } else { [a, b, c] });
                scene.triangle_materials.push(material);
            }
        }
    }

    fn two_spheres(radius: f32, inwards: bool, double_sided: bool) -> Scene {
        let second = Material { double_sided, ..Material::default() };
        let mut scene = Scene { materials: vec![Material::default(), second], ..Scene::default() };
        sphere(&mut scene, 1.0, false, 0);
        sphere(&mut scene, radius, inwards, 1);
        scene
    }

    #[test]
    fn a_hull_is_told_from_rooms_linings_and_shells() {
        let mut scene = two_spheres(1.02, true, false);
        assert_eq!(scene.hulls(), [1]);
        scene.remove_triangles_of(&[1]);
        assert_eq!((scene.triangles.len(), scene.triangle_materials.len()), (1024, 1024));
        // A room around the model, its own lining, a coat that faces outwards, and what is drawn from
        // both sides anyway.
        for (radius, inwards, double_sided) in
            [(1.5, true, false), (0.98, true, false), (1.02, false, false), (1.02, true, true)]
        {
            let scene = two_spheres(radius, inwards, double_sided);
            assert!(scene.hulls().is_empty(), "{radius} {inwards} {double_sided}");
        }
    }
}
