//! Faces in pairs: two single-sided surfaces in one place, one facing the other way, as programs export that
//! paint front and back (SketchUp, block worlds). Each is met from its own front alone, by all rays.
//!
//! Both may be cut into triangles along other lines. What is compared are therefore faces: a triangle, two that
//! follow each other in the file, and the longest run of triangles that lie in one plane.

use std::ops::Range;

use glam::Vec3;
use rayon::prelude::*;

use super::copies::{bits, copies, hash_of, mixed};
use super::lists::appended;
use super::{Material, Scene};

/// Least cosine between normals of triangles in one plane.
const MIN_COSINE: f32 = 0.9999;
/// Most triangles of a run: the sides of polygons, not whole floors.
const MAX_RUN: usize = 64;

impl Scene {
    /// Marks materials of faces in pairs as [`Material::backed`]; where a material has other faces too, its
    /// paired ones get one of their own. Solid bodies keep both sides.
    pub(crate) fn pair_backs(&mut self) {
        let is_sided = |m: &Material| !m.double_sided && m.thickness == 0.0;
        let is_sided: Vec<bool> = self.materials.iter().map(is_sided).collect();
        if !is_sided.contains(&true) {
            return;
        }
        let mut is_backed = vec![false; self.triangles.len()];
        let faces = Faces { scene: self, is_sided: &is_sided };
        for cut in [Faces::of::<1>, Faces::of::<2>, Faces::runs] {
            let list = cut(&faces, &is_backed);
            let hash = |number: usize| faces.hash(&list[number]);
            let pairs = copies(list.len(), hash, |a, b| faces.are_opposite(&list[a], &list[b]));
            for face in pairs.into_iter().flat_map(|(front, back)| [front, back]) {
                is_backed[list[face].clone()].fill(true);
            }
        }
        self.mark(&is_backed);
    }

    fn mark(&mut self, is_backed: &[bool]) {
        let mut has_other = vec![false; self.materials.len()];
        for (&material, _) in self.triangle_materials.iter().zip(is_backed).filter(|(_, is)| !*is) {
            has_other[material as usize] = true;
        }
        let mut places: Vec<Option<u32>> = vec![None; has_other.len()];
        for (material, _) in
            self.triangle_materials.iter_mut().zip(is_backed).filter(|(_, is)| **is)
        {
            let number = *material as usize;
            *material = *places[number].get_or_insert_with(|| {
                if !has_other[number] {
                    self.materials[number].backed = true;
                    return number as u32;
                }
                let backed = Material { backed: true, ..self.materials[number].clone() };
                appended(&mut self.materials, backed)
            });
        }
    }
}

/// Ways to cut a scene into faces, each some triangles that follow each other.
struct Faces<'a> {
    scene: &'a Scene,
    /// By material.
    is_sided: &'a [bool],
}

impl Faces<'_> {
    /// Triangles of each face that has `COUNT` of them, without those that are backed.
    fn of<const COUNT: usize>(&self, is_backed: &[bool]) -> Vec<Range<usize>> {
        let is_left = |at: usize| !is_backed[at] && self.may_pair(at);
        let is_face = |face: &Range<usize>| {
            face.clone().all(is_left)
                && (face.start + 1..face.end).all(|at| self.goes_on(&(face.start..at), at))
        };
        let firsts = (0..self.scene.triangles.len().saturating_sub(COUNT - 1)).into_par_iter();
        firsts.map(|at| at..at + COUNT).filter(is_face).collect()
    }

    fn runs(&self, is_backed: &[bool]) -> Vec<Range<usize>> {
        let mut runs = Vec::new();
        let mut run = 0..0;
        for at in 0..=self.scene.triangles.len() {
            let is_left = is_backed.get(at).is_some_and(|is| !is) && self.may_pair(at);
            if is_left && run.end == at && !run.is_empty() && self.goes_on(&run, at) {
                run.end += 1;
                continue;
            }
            if (3..=MAX_RUN).contains(&run.len()) {
                runs.push(run);
            }
            run = at..at + usize::from(is_left);
        }
        runs
    }

    fn may_pair(&self, triangle: usize) -> bool {
        self.is_sided[self.scene.triangle_materials[triangle] as usize]
    }

    /// Whether a triangle adds one corner to a face in its plane.
    fn goes_on(&self, face: &Range<usize>, triangle: usize) -> bool {
        let materials = &self.scene.triangle_materials;
        if materials[triangle] != materials[face.start]
            || self.normal(face.start).dot(self.normal(triangle)) < MIN_COSINE
        {
            return false;
        }
        let known = || face.clone().flat_map(|at| self.scene.corners_at((at, None)));
        let is_known = |at: &Vec3| known().any(|corner| corner == *at);
        self.scene.corners_at((triangle, None)).into_iter().filter(is_known).count() >= 2
    }

    /// Where the corners of a face are, each once, in order.
    fn corners(&self, face: Range<usize>) -> Vec<[u32; 3]> {
        let mut corners: Vec<_> =
            face.flat_map(|at| self.scene.corners_at((at, None)).map(bits)).collect();
        corners.sort_unstable();
        corners.dedup();
        corners
    }

    /// Twice the area as a vector.
    fn area(&self, face: Range<usize>) -> Vec3 {
        let area = |at: usize| {
            let [a, b, c] = self.scene.corners_at((at, None));
            (b - a).cross(c - a)
        };
        face.map(area).sum()
    }

    fn normal(&self, triangle: usize) -> Vec3 {
        self.area(triangle..triangle + 1).normalize_or_zero()
    }

    fn hash(&self, face: &Range<usize>) -> u32 {
        let words = self.corners(face.clone()).into_iter().flatten().map(u64::from);
        hash_of([words.fold(0, mixed), self.scene.owner(face.start) as u64])
    }

    fn are_opposite(&self, first: &Range<usize>, second: &Range<usize>) -> bool {
        let [one, other] = [first, second].map(|face| self.area(face.clone()));
        (one + other).length() <= 1e-3 * one.length().min(other.length())
            && self.scene.owner(first.start) == self.scene.owner(second.start)
            && self.corners(first.clone()) == self.corners(second.clone())
    }
}
