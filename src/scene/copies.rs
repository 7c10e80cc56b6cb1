//! Copies: what lies in the same place as something alike, as after a doubled import.
//!
//! A ray that meets one would be tested against all of them, and what it meets is always the first. But a shadow
//! ray would meet every copy of a pane, and a copy of a lamp would be sampled as if it shone as well: light would
//! not be what a path finds that comes there by chance. So only the first is kept.

use std::sync::atomic::{AtomicU64, Ordering};

use glam::Vec3;
use rayon::prelude::*;

use super::needs::is_emitter;
use super::{AlphaMode, Material, Scene};

/// So few are all compared.
const FEW: usize = 64;

/// Bits of a table for each thing that is looked at: one of eight or more is taken for a copy, and looked at again.
const BITS: usize = 8;

/// Things of one hash that are told apart; what comes after so many is kept.
const MAX_ALIKE: usize = 16;

/// Each thing that is a copy of something with a lower number, behind that number, given how many things there are
/// and a hash that is the same for copies. Takes little time where there are none.
pub(super) fn copies(
    count: usize,
    hash: impl Fn(usize) -> u32 + Sync,
    is_copy: impl Fn(usize, usize) -> bool,
) -> Vec<(usize, usize)> {
    let mut candidates: Vec<(u32, usize)> = match count < FEW {
        true => (0..count).map(|number| (hash(number), number)).collect(),
        false => candidates(count, &hash),
    };
    candidates.par_sort_unstable();
    let mut found = Vec::new();
    for alike in candidates.chunk_by(|a, b| a.0 == b.0) {
        let mut firsts: Vec<usize> = Vec::new();
        for &(_, number) in alike {
            if let Some(&first) = firsts.iter().find(|&&first| is_copy(first, number)) {
                found.push((first, number));
            } else if firsts.len() < MAX_ALIKE {
                firsts.push(number);
            }
        }
    }
    found
}

/// Hashes and numbers of those whose hash another one has, and of few more.
fn candidates(count: usize, hash: &(impl Fn(usize) -> u32 + Sync)) -> Vec<(u32, usize)> {
    let log2 = (BITS * count).next_power_of_two().trailing_zeros().min(u32::BITS);
    let table = || -> Vec<AtomicU64> { (0..1 << (log2 - 6)).map(|_| AtomicU64::new(0)).collect() };
    let (once, again) = (table(), table());
    let place = |hash: u32| {
        let bit = (hash >> (u32::BITS - log2)) as usize;
        (bit / 64, 1 << (bit % 64))
    };
    let look = |number: usize| {
        let hash = hash(number);
        let (word, bit) = place(hash);
        if once[word].fetch_or(bit, Ordering::Relaxed) & bit != 0 {
            again[word].fetch_or(bit, Ordering::Relaxed);
        }
        hash
    };
    let hashes: Vec<u32> = (0..count).into_par_iter().map(look).collect();
    let is_there_again = |number: usize| {
        let (word, bit) = place(hashes[number]);
        (again[word].load(Ordering::Relaxed) & bit != 0).then_some((hashes[number], number))
    };
    (0..count).into_par_iter().filter_map(is_there_again).collect()
}

/// The fractional part of the golden ratio: upper bits of products with it depend on all lower ones.
const FACTOR: u64 = 0x9e37_79b9_7f4a_7c15;

pub(super) fn mixed(hash: u64, word: u64) -> u64 {
    let product = (hash ^ word).wrapping_mul(FACTOR);
    product ^ (product >> 32)
}

/// A hash of words.
pub(super) fn hash_of(words: impl IntoIterator<Item = u64>) -> u32 {
    (words.into_iter().fold(FACTOR, mixed).wrapping_mul(FACTOR) >> 32) as u32
}

impl Scene {
    /// Removes all but the first of triangles that have the same corners, front and material and, if that lets
    /// light straight through, the same texture coordinates and colours. Of opaque ones that emit nothing the first
    /// alone is ever met, whatever their materials. Returns how many there were.
    pub(super) fn remove_copies(&mut self) -> usize {
        let triangles = Triangles::of(self);
        let hash = |place: usize| triangles.hash(place);
        let found = copies(self.triangles.len(), hash, |a, b| triangles.are_alike(a, b));
        if !found.is_empty() {
            let mut is_gone = vec![false; self.triangles.len()];
            found.iter().for_each(|&(_, place)| is_gone[place] = true);
            self.retain_triangles(|place| !is_gone[place]);
        }
        found.len()
    }

    /// The mesh that a triangle is of, counted from 1; 0 is the world.
    pub(super) fn owner(&self, place: usize) -> usize {
        let meshes = self.instances.meshes();
        let is_own = place < self.own_triangles().end as usize;
        if is_own { 0 } else { 1 + meshes.partition_point(|mesh| mesh.end as usize <= place) }
    }

    /// Removes all other triangles.
    pub(super) fn retain_triangles(&mut self, keeps: impl Fn(usize) -> bool) {
        self.instances =
            std::mem::take(&mut self.instances).retained(|place| keeps(place as usize));
        let mut keep = (0..self.triangles.len()).map(&keeps);
        self.triangles.retain(|_| keep.next().unwrap_or(true));
        let mut keep = (0..self.triangle_materials.len()).map(&keeps);
        self.triangle_materials.retain(|_| keep.next().unwrap_or(true));
    }
}

/// The triangles of a scene, looked at as places.
struct Triangles<'a> {
    scene: &'a Scene,
    /// Whether light may go straight through, by material.
    is_clear: Vec<bool>,
    /// Whether only the first of several in one place is ever met, by material.
    is_opaque: Vec<bool>,
}

impl<'a> Triangles<'a> {
    fn of(scene: &'a Scene) -> Self {
        let is_clear = |m: &Material| m.alpha_mode != AlphaMode::Opaque || m.transmission > 0.0;
        let is_opaque = |m: &Material| !is_clear(m) && !is_emitter(m);
        Self {
            scene,
            is_clear: scene.materials.iter().map(is_clear).collect(),
            is_opaque: scene.materials.iter().map(is_opaque).collect(),
        }
    }

    /// The corners, beginning with that of the lowest coordinates.
    fn turned(&self, place: usize) -> [u32; 3] {
        let mut corners = self.scene.triangles[place];
        let first = (0..3).min_by_key(|i| self.position(corners[*i]));
        corners.rotate_left(first.unwrap_or(0));
        corners
    }

    fn position(&self, corner: u32) -> [u32; 3] {
        bits(self.scene.positions[corner as usize])
    }

    fn hash(&self, place: usize) -> u32 {
        let pair = |low: u32, high: u32| u64::from(low) | u64::from(high) << 32;
        // The same wherever it begins.
        let corners = self.scene.triangles[place].map(|corner| {
            let [x, y, z] = self.position(corner);
            mixed(pair(x, y), u64::from(z))
        });
        let corners = corners.into_iter().fold(0, u64::wrapping_add);
        let material = self.scene.triangle_materials[place];
        let material = if self.is_opaque[material as usize] { u32::MAX } else { material };
        hash_of([corners, pair(material, self.scene.owner(place) as u32)])
    }

    fn are_alike(&self, first: usize, second: usize) -> bool {
        let scene = self.scene;
        let materials = [first, second].map(|place| scene.triangle_materials[place]);
        let are_opaque = materials.map(|it| self.is_opaque[it as usize]);
        let (one, other) = (self.turned(first), self.turned(second));
        let corners = || one.into_iter().zip(other);
        (materials[0] == materials[1] || are_opaque == [true; 2])
            && scene.owner(first) == scene.owner(second)
            && corners().all(|(a, b)| self.position(a) == self.position(b))
            && (!self.is_clear[materials[0] as usize]
                || corners().all(|(a, b)| {
                    is_same(&scene.colors, a, b) && scene.uvs.iter().all(|uvs| is_same(uvs, a, b))
                }))
    }
}

/// Whether two vertices have the same of something, if any have it.
fn is_same<T: PartialEq>(values: &[T], a: u32, b: u32) -> bool {
    values.get(a as usize) == values.get(b as usize)
}

/// A position as numbers that are the same for equal ones; there are two zeros.
pub(super) fn bits(position: Vec3) -> [u32; 3] {
    (position + Vec3::ZERO).to_array().map(f32::to_bits)
}

#[cfg(test)]
mod tests {
    use glam::Vec2;

    use super::*;
    use crate::scene::{Instance, Instances, Placing};

    /// Triangles of these corners, each with vertices of its own and texture coordinates beginning at a number.
    fn scene(material: Material, triangles: &[([Vec3; 3], u32, f32)]) -> Scene {
        let mut scene = Scene { materials: vec![material; 2], ..Scene::default() };
        for &(corners, material, u) in triangles {
            let first = scene.positions.len() as u32;
            scene.triangles.push([first, first + 1, first + 2]);
            scene.triangle_materials.push(material);
            scene.positions.extend(corners);
            scene.uvs[0].extend([0.0, 1.0, 2.0].map(|v| Vec2::new(u, v)));
        }
        scene
    }

    const CORNERS: [Vec3; 3] = [Vec3::ZERO, Vec3::X, Vec3::Y];

    #[test]
    fn only_what_is_alike_is_a_copy() {
        let [a, b, c] = CORNERS;
        let left = |material: &Material, second: ([Vec3; 3], u32, f32)| {
            let mut scene = scene(material.clone(), &[(CORNERS, 0, 0.0), second]);
            let removed = scene.remove_copies();
            assert_eq!(removed + scene.triangles.len(), 2);
            assert_eq!(scene.triangles.len(), scene.triangle_materials.len());
            assert_eq!(scene.triangles[0], [0, 1, 2], "the first stays");
            scene.triangles.len()
        };
        let opaque = Material::lambert(0.5);
        assert_eq!(left(&opaque, (CORNERS, 0, 0.0)), 1);
        assert_eq!(left(&opaque, ([b, c, a], 0, 0.0)), 1);
        assert_eq!(left(&opaque, ([-a, b, c], 0, 7.0)), 1, "who comes second is never seen");
        assert_eq!(left(&opaque, ([a, c, b], 0, 0.0)), 2, "the back is another surface");
        assert_eq!(left(&opaque, (CORNERS, 1, 0.0)), 1, "of another material, but never met");
        let lamp = Material { emissive: Vec3::ONE, ..opaque.clone() };
        assert_eq!(left(&lamp, (CORNERS, 1, 0.0)), 2, "both shine");
        assert_eq!(left(&opaque, ([a, b, c * 1.000_001], 0, 0.0)), 2);
        for clear in [
            Material { alpha_mode: AlphaMode::Blend, ..opaque.clone() },
            Material { alpha_mode: AlphaMode::Mask { cutoff: 0.5 }, ..opaque.clone() },
            Material { transmission: 1.0, ..opaque.clone() },
        ] {
            assert_eq!(left(&clear, (CORNERS, 0, 0.0)), 1);
            assert_eq!(left(&clear, (CORNERS, 0, 7.0)), 2, "other parts of its texture");
        }
    }

    #[test]
    fn meshes_are_places_of_their_own() {
        let all = [(CORNERS, 0, 0.0); 7];
        let mut scene = scene(Material::lambert(0.5), &all);
        let instance = |mesh| Instance { mesh, placing: Placing::new(glam::DAffine3::IDENTITY) };
        scene.instances = Instances::new(vec![2..4, 4..7], vec![instance(0), instance(1)]);
        assert_eq!(scene.remove_copies(), 4);
        assert_eq!(scene.triangles, [[0, 1, 2], [6, 7, 8], [12, 13, 14]]);
        assert_eq!(scene.instances.meshes(), [1..2, 2..3]);
    }

    #[test]
    fn many_are_found_among_many() {
        const COUNT: usize = 100_000;
        // Each third one is there twice, the second time at the end.
        let value = |number: usize| if number < COUNT { number } else { 3 * (number - COUNT) };
        let hash = |number: usize| hash_of([value(number) as u64]);
        let found = copies(COUNT + COUNT / 3, hash, |a, b| value(a) == value(b));
        let mut sorted: Vec<usize> = found.into_iter().map(|(_, number)| number).collect();
        sorted.sort_unstable();
        assert_eq!(sorted, (COUNT..COUNT + COUNT / 3).collect::<Vec<_>>());
        // All of one hash, and none a copy: it ends.
        assert!(copies(COUNT, |_| 1, |_, _| false).is_empty());
        assert_eq!(copies(COUNT, |_| 1, |_, _| true).len(), COUNT - 1);
    }
}
