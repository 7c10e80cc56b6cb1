//! Inverted hulls: an enlarged copy of a model that faces inwards, which gives it a dark outline where
//! back faces are not drawn. Here surfaces stop light from both sides, so a hull would shut it all out.

use glam::Vec3;
use rayon::prelude::*;

use super::instances::Surface;
use super::{Material, MaterialEdit, Scene, named_lamps};
use crate::error::Decoded;

/// Triangles of a material that are looked at.
const SAMPLES: usize = 256;
/// Share of them that must lie over a surface for the material to be a hull's.
const SHARE: f32 = 0.8;
/// How far a hull lies from what it outlines, at most: a share of its own size.
const DISTANCE: f32 = 0.05;

/// A triangle, as far as outlines are told by it.
#[derive(Clone, Copy)]
struct Facing {
    centre: Vec3,
    /// As long as twice its area.
    normal: Vec3,
    material: u32,
}

fn facing(scene: &Scene, surface: Surface<'_>) -> Facing {
    let [a, b, c] = scene.corners_at(surface);
    let material = scene.triangle_materials[surface.0];
    Facing { centre: (a + b + c) / 3.0, normal: (b - a).cross(c - a), material }
}

/// All triangles of a material.
struct Shape {
    low: Vec3,
    high: Vec3,
    count: usize,
    /// Six times the volume that they enclose, negative where they face inwards.
    volume: f64,
}

/// The materials that may be hulls and face inwards. Each pass goes over the triangles once, however many
/// materials there are.
fn inward_shapes(scene: &Scene) -> Vec<Option<Shape>> {
    let shape = |material: &Material| {
        let may_be = !material.double_sided && !material.lets_light_through();
        may_be.then_some(Shape { low: Vec3::MAX, high: Vec3::MIN, count: 0, volume: 0.0 })
    };
    let mut shapes: Vec<Option<Shape>> = scene.materials.iter().map(shape).collect();
    if shapes.iter().all(Option::is_none) {
        return shapes;
    }
    for surface in scene.each_once() {
        if let Some(shape) = &mut shapes[scene.triangle_materials[surface.0] as usize] {
            shape.count += 1;
            for corner in scene.corners_at(surface) {
                (shape.low, shape.high) = (shape.low.min(corner), shape.high.max(corner));
            }
        }
    }
    for surface in scene.each_once() {
        if let Some(shape) = &mut shapes[scene.triangle_materials[surface.0] as usize] {
            let Facing { centre, normal, .. } = facing(scene, surface);
            let middle = 0.5 * (shape.low + shape.high);
            shape.volume += (centre - middle).as_dvec3().dot(normal.as_dvec3());
        }
    }
    shapes.into_iter().map(|shape| shape.filter(|shape| shape.volume < 0.0)).collect()
}

/// How distances are compared.
type Compare = fn(&f32, &f32) -> bool;

/// All triangles in order along the axis in which they spread most.
struct Row {
    axis: usize,
    facings: Vec<Facing>,
}

impl Row {
    fn new(mut facings: Vec<Facing>) -> Self {
        let bounds = (Vec3::MAX, Vec3::MIN);
        let (low, high) =
            facings.iter().fold(bounds, |(l, h), f| (l.min(f.centre), h.max(f.centre)));
        let axis = (high - low).max_position();
        // Stable: of two in one place, the first in the file comes first.
        facings.par_sort_by(|a, b| a.centre[axis].total_cmp(&b.centre[axis]));
        Self { axis, facings }
    }

    /// The nearest triangle of another material that is at most `reach` away; the first of those as near.
    fn nearest<'a>(&'a self, of: &Facing, reach: f32) -> Option<&'a Facing> {
        let along = |other: &Facing| other.centre[self.axis] - of.centre[self.axis];
        let (before, after) =
            self.facings.split_at(self.facings.partition_point(|other| along(other) < 0.0));
        let mut nearest = (reach * reach, None);
        let mut search = |others: &mut dyn Iterator<Item = &'a Facing>, is_near: Compare| {
            for other in others {
                if !is_near(&along(other).powi(2), &nearest.0) {
                    break;
                }
                let distance = of.centre.distance_squared(other.centre);
                if other.material != of.material && is_near(&distance, &nearest.0) {
                    nearest = (distance, Some(other));
                }
            }
        };
        search(&mut before.iter().rev(), f32::le);
        search(&mut after.iter(), f32::lt);
        nearest.1
    }
}

/// Whether a hull's triangle lies over a surface that faces as it would from outside.
fn covers(triangle: &Facing, row: &Row, reach: f32) -> bool {
    row.nearest(triangle, reach).is_some_and(|other| {
        let towards = triangle.normal.normalize_or_zero().dot(other.normal.normalize_or_zero());
        towards < -0.5 && (triangle.centre - other.centre).dot(other.normal) > 0.0
    })
}

impl Scene {
    /// Numbers of the materials whose triangles are a hull around others: single-sided, inside out as a
    /// whole, and close over other surfaces that face the other way.
    pub(super) fn hulls(&self) -> Vec<u32> {
        let shapes = inward_shapes(self);
        if shapes.iter().all(Option::is_none) {
            return Vec::new();
        }
        // A mesh that instances share has its outline with it: one of them tells.
        let facings: Vec<Facing> = self.each_once().map(|surface| facing(self, surface)).collect();
        let mut seen = vec![0_usize; shapes.len()];
        let mut samples = vec![Vec::new(); shapes.len()];
        for triangle in &facings {
            let material = triangle.material as usize;
            if let Some(shape) = &shapes[material] {
                if seen[material].is_multiple_of(shape.count.div_ceil(SAMPLES)) {
                    samples[material].push(*triangle);
                }
                seen[material] += 1;
            }
        }
        let row = Row::new(facings);
        let is_hull = |material: &u32| {
            let (shape, samples) = (&shapes[*material as usize], &samples[*material as usize]);
            let Some(shape) = shape else { return false };
            let reach = DISTANCE * (shape.high - shape.low).length();
            let covering = samples.par_iter().filter(|sample| covers(sample, &row, reach)).count();
            covering as f32 >= SHARE * samples.len() as f32
        };
        (0..shapes.len() as u32).filter(is_hull).collect()
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
                return Err(self.without_material(name));
            }
            self.remove_triangles_of(&hidden);
        }
        self.check_shown()
    }

    /// Says that no material is called so, and what there is instead.
    pub(crate) fn without_material(&self, name: &str) -> String {
        none_called("material", name, self.materials.iter().map(|m| m.name.as_str()).collect())
    }

    /// The same of lamps.
    pub(crate) fn without_lamp(&self, name: &str) -> String {
        let lamps = named_lamps(&self.lights, &self.materials);
        none_called("lamp", name, lamps.iter().map(|lamp| lamp.name.as_str()).collect())
    }

    /// Whether anything is left to be shown: something that is not of a hidden material.
    ///
    /// # Errors
    /// The cause, if nothing is.
    pub(crate) fn check_shown(&self) -> Decoded<()> {
        let is_hidden: Vec<bool> = self.materials.iter().map(MaterialEdit::has_hidden).collect();
        match self.triangle_materials.iter().all(|&material| is_hidden[material as usize]) {
            true => Err("all of it is hidden, so there is nothing to render".into()),
            false => Ok(()),
        }
    }

    /// Removes the triangles of some materials; the materials stay, unused.
    pub(super) fn remove_triangles_of(&mut self, materials: &[u32]) {
        let mut is_gone = vec![false; self.materials.len()];
        materials.iter().for_each(|&material| is_gone[material as usize] = true);
        let keeps = |material: &u32| !is_gone[*material as usize];
        let keeps: Vec<bool> = self.triangle_materials.iter().map(keeps).collect();
        self.retain_triangles(|place| keeps[place]);
    }
}

/// Says that nothing of a kind is called so, and what there is instead.
fn none_called(kind: &str, name: &str, mut names: Vec<&str>) -> String {
    const MAX_NAMED: usize = 12;
    names.sort_unstable();
    names.dedup();
    let more = match names.len().saturating_sub(MAX_NAMED) {
        0 if names.is_empty() => "none".to_owned(),
        0 => String::new(),
        count => format!(" and {count} more, which lightgrid info names"),
    };
    names.truncate(MAX_NAMED);
    format!("no {kind} is called \"{name}\"; there are {}{more}", names.join(", "))
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

    /// Inward flakes side by side, each of its own material: none lies over another.
    #[test]
    fn materials_by_the_hundred_thousand_are_no_hulls() {
        const COUNT: u32 = 100_000;
        let mut scene =
            Scene { materials: vec![Material::default(); COUNT as usize], ..Scene::default() };
        for material in 0..COUNT {
            let at = Vec3::new((material % 300) as f32, 0.0, (material / 300) as f32);
            let first = scene.positions.len() as u32;
            let corners = [Vec3::ZERO, 0.5 * Vec3::X, 0.5 * Vec3::Y, 0.5 * Vec3::Z];
            scene.positions.extend(corners.map(|corner| at + corner));
            for [a, b, c] in [[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2]] {
                scene.triangles.push([a, b, c].map(|corner| first + corner));
                scene.triangle_materials.push(material);
            }
        }
        assert!(scene.hulls().is_empty());
        let odd: Vec<u32> = (0..COUNT).filter(|material| material % 2 == 1).collect();
        scene.remove_triangles_of(&odd);
        assert_eq!(scene.triangles.len(), 2 * COUNT as usize);
        assert!(scene.triangle_materials.iter().all(|material| material % 2 == 0));
    }
}
