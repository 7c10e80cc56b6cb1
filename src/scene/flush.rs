//! Flush faces: what lets light through and lies in one plane with something opaque, as a decal on its wall or a
//! glass on its table.
//!
//! A ray that leaves a face starts a little off it ([`offset_origin`]), hence beyond an opaque face that is nearer
//! than that: one of both would never be met. So the face that light passes is moved away, as far as it takes and
//! no farther than a hair. What is opaque stays where it is.

use std::collections::HashMap;

use glam::{DVec3, Vec3};
use rayon::prelude::*;

use super::copies::bits;
use super::instances::Surface;
use super::lists::{again, appended};
use super::{Instance, Material, Scene};
use crate::bvh::offset_origin;

/// Faces that are so many jumps of a ray's origin apart are both met: a jump, and what it is to outweigh, which is
/// how wrongly a hit may be rounded.
const SAFE_JUMPS: f64 = 2.0;
/// Jumps between faces that were moved apart: safely more.
const JUMPS: f64 = 2.5;
/// Least cosine between normals of faces in one plane, whichever way they face.
const MIN_COSINE: f32 = 0.9999;
/// Pairs that are all looked at rather than divided further.
const FEW: usize = 64;
/// Opaque faces about one face that are looked at: where many lie in one place, these tell.
const MAX_NEAR: usize = 1024;
/// Instances are looked at one by one in scenes that show no more triangles than this; else the first of each mesh.
const MAX_SHOWN: u64 = 1 << 25;
/// Times that all contacts of a corner are gone through: once settles those at right angles.
const SWEEPS: usize = 4;

/// A triangle with the box around it.
#[derive(Clone, Copy)]
struct Face<'a> {
    surface: Surface<'a>,
    low: Vec3,
    high: Vec3,
    normal: Vec3,
}

impl Face<'_> {
    fn overlaps(&self, low: Vec3, high: Vec3) -> bool {
        self.low.cmplt(high).all() && self.high.cmpgt(low).all()
    }

    /// With all in its box that rays could not tell from it.
    fn widened(self) -> Self {
        let farthest = self.low.abs().max(self.high.abs());
        let by = (SAFE_JUMPS * jump(farthest, self.normal)) as f32 * self.normal.abs();
        Self { low: self.low - by, high: self.high + by, ..self }
    }
}

/// Where a face lies over an opaque one.
struct Overlap {
    /// The area, negative where the passing face is to move against its normal.
    forwards: f64,
    /// Least and greatest height over the opaque face along the passing one's normal.
    heights: [f64; 2],
    /// Height that tells them apart.
    safe: f64,
}

/// A triangle that must move, in its own space.
struct Contact {
    triangle: usize,
    direction: DVec3,
    distance: f64,
}

/// How far corners of what lets light through move: all in one place of the world, or of a mesh, together.
struct Moves {
    /// The number of the place that a vertex is in.
    places: Vec<u32>,
    /// By place.
    by: Vec<DVec3>,
}

impl Moves {
    fn of(&self, vertex: u32) -> DVec3 {
        self.by[self.places[vertex as usize] as usize]
    }

    fn at(&mut self, vertex: u32) -> &mut DVec3 {
        &mut self.by[self.places[vertex as usize] as usize]
    }
}

impl Scene {
    /// Moves faces that let light through off the opaque ones that they lie on: solid glass inwards, all else to the
    /// front of what they lie on. But what has one side, on something of two, moves to its own front.
    ///
    /// After [`Self::pair_backs`], which looks for faces in the same place.
    pub(crate) fn part_flush_faces(&mut self) {
        let is_passing: Vec<bool> =
            self.materials.iter().map(Material::lets_light_through).collect();
        let kind = |place: usize| is_passing[self.triangle_materials[place] as usize];
        let has = |passing: bool| {
            (0..self.triangles.len()).into_par_iter().any(|place| kind(place) == passing)
        };
        if !is_passing.contains(&true) || !has(true) || !has(false) {
            return;
        }
        let contacts = self.contacts(kind);
        if contacts.is_empty() {
            return;
        }
        let passing: Vec<usize> = (0..self.triangles.len()).filter(|&at| kind(at)).collect();
        let mut moves = self.moves(&passing, &contacts);
        self.drop_inverting(&passing, &mut moves);
        self.apply(&passing, &moves);
    }

    fn contacts(&self, is_passing: impl Fn(usize) -> bool + Sync) -> Vec<Contact> {
        let mut shown: Vec<&Instance> = self.instances.iter().collect();
        if self.shown_triangles() > MAX_SHOWN {
            let mut is_seen = vec![false; self.instances.meshes().len()];
            shown.retain(|it| !std::mem::replace(&mut is_seen[it.mesh as usize], true));
        }
        let is_passing = &is_passing;
        let faces = |passing: bool| {
            let own = self.own_triangles().into_par_iter().map(|place| (place as usize, None));
            let meshes = self.instances.meshes();
            let placed = shown.par_iter().flat_map_iter(|it| {
                meshes[it.mesh as usize].clone().map(|place| (place as usize, Some(&it.placing)))
            });
            let all = own.chain(placed).filter(move |at: &Surface<'_>| is_passing(at.0) == passing);
            all.map(|surface| self.face(surface))
        };
        let mut passing: Vec<Face<'_>> = faces(true).map(Face::widened).collect();
        let (low, high) = around(&passing);
        let opaque: Vec<_> = faces(false).filter(|face| face.overlaps(low, high)).collect();
        self.meet(&mut passing, &opaque)
    }

    fn face<'a>(&self, surface: Surface<'a>) -> Face<'a> {
        let [a, b, c] = self.corners_at(surface);
        let normal = normal([a, b, c].map(|it| it.as_dvec3())).as_vec3();
        Face { surface, low: a.min(b).min(c), high: a.max(b).max(c), normal }
    }

    /// Divides what light passes until few are left, of opaque faces what may touch them.
    fn meet(&self, passing: &mut [Face<'_>], opaque: &[Face<'_>]) -> Vec<Contact> {
        let (low, high) = around(passing);
        let near: Vec<_> = opaque.iter().filter(|it| it.overlaps(low, high)).copied().collect();
        if near.is_empty() {
            return Vec::new();
        }
        if passing.len() == 1 || passing.len() * near.len() <= FEW {
            return passing.iter().filter_map(|face| self.contact(face, &near)).collect();
        }
        let middle = |face: &Face<'_>| face.low + face.high;
        let [low, high] =
            [Vec3::min, Vec3::max].map(|pick| passing.iter().map(middle).reduce(pick));
        let axis = high.zip(low).map_or(0, |(high, low)| (high - low).max_position());
        let half = passing.len() / 2;
        passing.select_nth_unstable_by(half, |a, b| middle(a)[axis].total_cmp(&middle(b)[axis]));
        let (left, right) = passing.split_at_mut(half);
        let (mut found, more) = rayon::join(|| self.meet(left, &near), || self.meet(right, &near));
        found.extend(more);
        found
    }

    /// How a face must move, given opaque ones in order.
    fn contact(&self, face: &Face<'_>, opaque: &[Face<'_>]) -> Option<Contact> {
        let is_near = |it: &&Face<'_>| {
            let cosine = it.normal.dot(face.normal).abs();
            it.overlaps(face.low, face.high) && cosine >= MIN_COSINE
        };
        let near = opaque.iter().filter(is_near).take(MAX_NEAR);
        let under: Vec<Overlap> = near.filter_map(|it| self.overlap(face, it)).collect();
        let first = under.first()?.forwards;
        let [forwards, area] =
            [|it| it, f64::abs].map(|of| under.iter().map(|it| of(it.forwards)).sum::<f64>());
        // Of opaque faces back to back, the first one tells.
        let is_forwards = if forwards.abs() > 0.01 * area { forwards } else { first } > 0.0;
        let lowest = |[low, high]: [f64; 2]| if is_forwards { low } else { -high };
        let missing = |it: &Overlap| it.safe - lowest(it.heights);
        let distance = under.iter().map(missing).fold(0.0, f64::max);
        let (triangle, placing) = face.surface;
        let normal = normal(self.corners_at(face.surface).map(|it| it.as_dvec3()));
        let direction = if is_forwards { normal } else { -normal };
        // What goes so far along this in the mesh goes the distance along the normal in the world.
        let linear = placing.map(|it| it.affine().matrix3.as_dmat3());
        let along = linear.map_or(direction, |it| it.transpose() * direction);
        let scale = along.length();
        Some(Contact { triangle, direction: along / scale, distance: distance / scale })
    }

    /// Where a face and an opaque one of a parallel plane lie in the same and over each other, if they do.
    fn overlap(&self, face: &Face<'_>, opaque: &Face<'_>) -> Option<Overlap> {
        let cosine = face.normal.dot(opaque.normal);
        let material = |face: &Face<'_>| self.triangle_materials[face.surface.0] as usize;
        let [above, below] = [face, opaque].map(|face| &self.materials[material(face)]);
        // Of a pair, each is met from its own side only.
        if above.backed && below.backed && cosine < 0.0 {
            return None;
        }
        let has_own_front = !above.double_sided && !above.backed && below.double_sided;
        let is_forwards = !above.has_inside() && (cosine > 0.0 || has_own_front);
        let corners = |face: &Face<'_>| self.corners_at(face.surface).map(|it| it.as_dvec3());
        let (above, below) = (corners(face), corners(opaque));
        let area = clipped(&above, below);
        let &first = area.first()?;
        let farthest = area.iter().fold(DVec3::ZERO, |most, it| most.max(it.abs()));
        let jump = jump(farthest.as_vec3(), face.normal);
        let rim = || area.iter().zip(area.iter().cycle().skip(1));
        let length: f64 = rim().map(|(a, b)| a.distance(*b)).sum();
        let twice_area: DVec3 = rim().map(|(a, b)| (a - first).cross(b - first)).sum();
        // Faces side by side overlap by what their corners are rounded.
        if twice_area.length() <= jump * length {
            return None;
        }
        let upwards = normal(below) * f64::from(cosine.signum());
        let heights = area.iter().map(|it| (it - below[0]).dot(upwards));
        let heights = heights.fold([f64::MAX, f64::MIN], |[a, b], it| [a.min(it), b.max(it)]);
        let is_flush = heights.into_iter().all(|it| it.abs() <= SAFE_JUMPS * jump);
        let forwards = if is_forwards { twice_area.length() } else { -twice_area.length() };
        is_flush.then_some(Overlap { forwards, heights, safe: JUMPS * jump })
    }

    /// How far corners must move to bring all faces there as far as they must.
    fn moves(&self, passing: &[usize], contacts: &[Contact]) -> Moves {
        let corners = |&at: &usize| {
            let owner = self.owner(at);
            self.triangles[at].map(|it| ((owner, bits(self.positions[it as usize])), it))
        };
        let mut corners: Vec<_> = passing.par_iter().flat_map_iter(corners).collect();
        corners.par_sort_unstable();
        let mut moves = Moves { places: vec![0; self.positions.len()], by: Vec::new() };
        for alike in corners.chunk_by(|a, b| a.0 == b.0) {
            alike.iter().for_each(|it| moves.places[it.1 as usize] = moves.by.len() as u32);
            moves.by.push(DVec3::ZERO);
        }
        for _ in 0..SWEEPS {
            let mut most = 0.0_f64;
            for Contact { triangle, direction, distance } in contacts {
                for vertex in self.triangles[*triangle] {
                    let by = moves.at(vertex);
                    let missing = (distance - by.dot(*direction)).max(0.0);
                    *by += missing * direction;
                    most = most.max(missing / distance);
                }
            }
            if most < 0.01 {
                break;
            }
        }
        moves
    }

    /// Takes back what would turn a triangle around: glass that is thinner than it is to move stays.
    fn drop_inverting(&self, passing: &[usize], moves: &mut Moves) {
        let turns = |at: &usize| {
            let corners = self.triangles[*at];
            let old = corners.map(|vertex| self.positions[vertex as usize].as_dvec3());
            let new = std::array::from_fn(|i| old[i] + moves.of(corners[i]));
            old != new && normal(old).dot(normal(new)) <= 0.0
        };
        let turned: Vec<usize> = passing.par_iter().copied().filter(turns).collect();
        for vertex in turned.into_iter().flat_map(|at| self.triangles[at]) {
            *moves.at(vertex) = DVec3::ZERO;
        }
    }

    /// Moves corners; each that does becomes a vertex of its own, since something opaque may share the old one.
    fn apply(&mut self, passing: &[usize], moves: &Moves) {
        let mut moved: HashMap<u32, u32> = HashMap::new();
        for &at in passing {
            self.triangles[at] = self.triangles[at].map(|vertex| match moves.of(vertex) {
                DVec3::ZERO => vertex,
                by => *moved.entry(vertex).or_insert_with(|| self.add_moved(vertex, by)),
            });
        }
    }

    /// A vertex like another, elsewhere.
    fn add_moved(&mut self, vertex: u32, by: DVec3) -> u32 {
        let from = vertex as usize;
        again(&mut self.normals, from);
        again(&mut self.tangents, from);
        self.uvs.iter_mut().for_each(|uvs| again(uvs, from));
        again(&mut self.colors, from);
        let position = (self.positions[from].as_dvec3() + by).as_vec3();
        appended(&mut self.positions, position)
    }
}

/// How far [`offset_origin`] moves points along a normal, given how far they are from zero along each axis at most.
fn jump(farthest: Vec3, normal: Vec3) -> f64 {
    // Near zero it moves them as far as at 1/2, and less in between.
    let (from, along) = (farthest.max(Vec3::splat(0.5)), normal.abs());
    (offset_origin(from, along) - from).as_dvec3().dot(along.as_dvec3())
}

fn normal([a, b, c]: [DVec3; 3]) -> DVec3 {
    (b - a).cross(c - a).normalize_or_zero()
}

/// The box around faces.
fn around(faces: &[Face<'_>]) -> (Vec3, Vec3) {
    let join = |(low, high): (Vec3, Vec3), it: &Face<'_>| (low.min(it.low), high.max(it.high));
    faces.iter().fold((Vec3::MAX, Vec3::MIN), join)
}

/// The part of a triangle that is over another one, along that one's normal (Sutherland and Hodgman 1974).
fn clipped(triangle: &[DVec3; 3], by: [DVec3; 3]) -> Vec<DVec3> {
    let upwards = normal(by);
    let mut left = triangle.to_vec();
    for (from, to) in [(by[0], by[1]), (by[1], by[2]), (by[2], by[0])] {
        let inwards = upwards.cross(to - from);
        let mut kept = Vec::with_capacity(left.len() + 1);
        for (a, b) in left.iter().zip(left.iter().cycle().skip(1)) {
            let [here, there] = [a, b].map(|it| (it - from).dot(inwards));
            if here >= 0.0 {
                kept.push(*a);
            }
            if (here < 0.0) != (there < 0.0) {
                kept.push(a.lerp(*b, here / (here - there)));
            }
        }
        left = kept;
    }
    left
}

#[cfg(test)]
mod tests {
    use glam::{DAffine3, Quat};

    use super::*;
    use crate::scene::{AlphaMode, Instances, Placing, builtin};

    const WALL: u32 = 0;
    const BLEND: u32 = 1;
    const SHEET: u32 = 2;
    const GLASS: u32 = 3;
    const FLOOR: u32 = 4;

    /// A scene of an opaque material of two sides, a blended one of one, thin glass of two, solid glass, and an opaque
    /// one of one side.
    fn scene() -> Scene {
        let wall = Material::lambert(0.5);
        let blend = Material { alpha_mode: AlphaMode::Blend, ..Material::default() };
        let sheet = Material { transmission: 1.0, double_sided: true, ..Material::default() };
        let glass = Material { transmission: 1.0, thickness: 1.0, ..Material::default() };
        let floor = Material { double_sided: false, ..wall.clone() };
        Scene { materials: vec![wall, blend, sheet, glass, floor], ..Scene::default() }
    }

    fn add(scene: &mut Scene, material: u32, corners: &[Vec3], triangles: &[[u32; 3]]) {
        let first = scene.positions.len() as u32;
        scene.positions.extend(corners);
        scene.triangles.extend(triangles.iter().map(|corners| corners.map(|it| first + it)));
        scene.triangle_materials.extend(triangles.iter().map(|_| material));
    }

    /// A square in the plane z = 0 that faces +Z, its diagonal one or the other.
    fn square(middle: [f32; 2], half: f32, other: bool) -> ([Vec3; 4], [[u32; 3]; 2]) {
        let [x, y] = middle;
        let corner = |(i, k): (f32, f32)| Vec3::new(x + half * i, y + half * k, 0.0);
        let corners = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)].map(corner);
        (corners, if other { [[1, 2, 3], [1, 3, 0]] } else { [[0, 1, 2], [0, 2, 3]] })
    }

    fn turned(triangles: [[u32; 3]; 2]) -> [[u32; 3]; 2] {
        triangles.map(|[a, b, c]| [a, c, b])
    }

    /// A box over the plane z = 0, each of its faces of four corners of its own.
    fn cube(scene: &mut Scene, material: u32, low: Vec3, high: Vec3) {
        let corner = |bits: u32| {
            let pick = |axis: usize| if bits >> axis & 1 == 0 { low[axis] } else { high[axis] };
            Vec3::new(pick(0), pick(1), pick(2))
        };
        for face in
            [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]]
        {
            add(scene, material, &face.map(corner), &[[0, 1, 2], [0, 2, 3]]);
        }
    }

    /// Where all corners of a material's triangles are.
    fn corners_of(scene: &Scene, material: u32) -> Vec<Vec3> {
        let all = scene.triangles.iter().zip(&scene.triangle_materials);
        let corners = all.filter(|(_, it)| **it == material).flat_map(|(corners, _)| corners);
        corners.map(|vertex| scene.positions[*vertex as usize]).collect()
    }

    /// Whether each edge of these triangles is there once in each direction.
    fn is_closed(scene: &Scene, material: u32) -> bool {
        let mut edges = HashMap::new();
        for corners in corners_of(scene, material).chunks(3) {
            let [a, b, c] = [0, 1, 2].map(|i| bits(corners[i]));
            for edge in [[a, b], [b, c], [c, a]] {
                *edges.entry(edge).or_insert(0) += 1;
            }
        }
        edges.iter().all(|(&[a, b], &count)| count == 1 && edges.get(&[b, a]) == Some(&1))
    }

    /// Asserts that nothing moves.
    fn expect_still(what: &str, mut scene: Scene) {
        let (positions, triangles) = (scene.positions.clone(), scene.triangles.clone());
        scene.part_flush_faces();
        assert!(scene.positions == positions && scene.triangles == triangles, "{what}");
    }

    #[test]
    fn a_decal_stands_off_its_wall() {
        let tilted = Quat::from_euler(glam::EulerRot::XYZ, 0.3, -0.7, 0.4);
        for (distance, rotation) in
            [0.0, 1.0, 100.0].into_iter().flat_map(|d| [Quat::IDENTITY, tilted].map(|q| (d, q)))
        {
            let at = distance * Vec3::new(0.8, -0.5, 1.0);
            let place = |corners: [Vec3; 4]| corners.map(|it| rotation * it + at);
            let up = rotation * Vec3::Z;
            for (material, is_turned, other, middle, is_first) in [
                (BLEND, false, false, [0.0, 0.0], false),
                (BLEND, false, true, [0.1, 0.2], true),
                (BLEND, true, false, [0.1, 0.2], false),
                (SHEET, false, true, [0.9, -0.9], false),
                (SHEET, true, true, [0.1, 0.2], true),
            ] {
                let mut scene = scene();
                let (wall, decal) = (square([0.0; 2], 1.0, false), square(middle, 0.4, other));
                let triangles = if is_turned { turned(decal.1) } else { decal.1 };
                let add_wall = |scene: &mut _| add(scene, WALL, &place(wall.0), &wall.1);
                if !is_first {
                    add_wall(&mut scene);
                }
                add(&mut scene, material, &place(decal.0), &triangles);
                if is_first {
                    add_wall(&mut scene);
                }
                let old = scene.clone();
                scene.part_flush_faces();
                assert_eq!(corners_of(&scene, WALL), corners_of(&old, WALL), "the wall stays");
                let over = place(decal.0.map(|it| it.clamp(-Vec3::ONE, Vec3::ONE)));
                let farthest = over.iter().fold(Vec3::ZERO, |most, it| most.max(it.abs()));
                let away = if is_turned && material == BLEND { -up } else { up };
                let [old, new] = [&old, &scene].map(|scene| corners_of(scene, material));
                for (old, new) in old.into_iter().zip(new) {
                    let (by, most) = ((new - old).as_dvec3(), 2.6 * jump(farthest, up));
                    let is_over = (rotation.inverse() * (old - at)).abs().max_element() < 1.0;
                    let least = if is_over { 2.4 * jump(old.abs(), up) } else { 0.4 * most };
                    let height = by.dot(away.as_dvec3());
                    let what = format!("{distance} {rotation}: {height} of {least} to {most}");
                    assert!(height > least && by.length() < most, "{what}");
                }
                let moved = scene.positions.clone();
                scene.part_flush_faces();
                assert_eq!(scene.positions, moved, "once is enough");
            }
        }
    }

    #[test]
    fn glass_in_a_corner_leaves_all_walls_and_stays_closed() {
        let mut scene = scene();
        let (corners, triangles) = square([0.0; 2], 3.0, false);
        for turn in [|it: Vec3| it, |it: Vec3| Vec3::new(it.z, it.x, it.y)] {
            add(&mut scene, WALL, &corners.map(turn), &triangles);
        }
        let walls = scene.positions.clone();
        cube(&mut scene, GLASS, Vec3::ZERO, Vec3::new(0.5, 0.6, 0.7));
        scene.part_flush_faces();
        assert_eq!(scene.positions[..walls.len()], walls);
        assert!(is_closed(&scene, GLASS));
        let corners = corners_of(&scene, GLASS);
        let first = (corners[0], corners[0]);
        let (low, high) = corners.iter().fold(first, |(a, b), it| (a.min(*it), b.max(*it)));
        let gap = 2.5 / 65536.0;
        assert!((low - Vec3::new(gap, 0.0, gap)).abs().max_element() < 1e-9, "{low}");
        assert_eq!(high, Vec3::new(0.5, 0.6, 0.7));
    }

    /// A box of single-sided blended faces keeps its bottom over the floor, though that faces down; and a mat lies
    /// over the floor, not below the feet that stand there.
    #[test]
    fn what_stands_on_a_floor_stays_over_it() {
        let mut scene = scene();
        for [x, y] in [[-1.0, -1.0], [-1.0, 1.0], [1.0, 1.0]] {
            let (corners, triangles) = square([0.9 * x, 0.9 * y], 0.2, true);
            add(&mut scene, WALL, &corners, &turned(triangles));
        }
        let (corners, triangles) = square([0.0; 2], 3.0, false);
        add(&mut scene, FLOOR, &corners, &triangles);
        cube(&mut scene, BLEND, Vec3::new(2.0, 2.0, 0.0), Vec3::splat(2.5));
        let (corners, triangles) = square([0.0; 2], 1.0, false);
        add(&mut scene, SHEET, &corners, &triangles);
        scene.part_flush_faces();
        assert!(is_closed(&scene, BLEND));
        for (triangle, &material) in scene.triangles.iter().zip(&scene.triangle_materials) {
            let heights = triangle.map(|vertex| scene.positions[vertex as usize].z);
            let is_over = heights.iter().all(|height| *height > 3e-5);
            assert_eq!(is_over, matches!(material, BLEND | SHEET), "{material}: {heights:?}");
        }
    }

    #[test]
    fn what_is_not_flush_stays() {
        let wall = square([0.0; 2], 1.0, false);
        let with = |material, corners: &[Vec3], triangles: &[[u32; 3]]| {
            let mut scene = scene();
            add(&mut scene, WALL, &wall.0, &wall.1);
            add(&mut scene, material, corners, triangles);
            scene
        };
        let moved = |by: Vec3, half: f32| square([0.0; 2], half, true).0.map(|it| it + by);
        for (what, material, corners) in [
            ("a millimetre off", BLEND, moved(0.001 * Vec3::Z, 0.3)),
            ("beside it", SHEET, moved(Vec3::new(2.0, 0.0, 0.0), 1.0)),
            ("elsewhere in its plane", SHEET, moved(Vec3::new(3.0, 0.0, 0.0), 1.0)),
            (
                "upright on it",
                BLEND,
                moved(0.5 * Vec3::Y, 0.5).map(|it| Vec3::new(it.x, 0.3, it.y)),
            ),
            ("opaque", WALL, moved(Vec3::ZERO, 0.3)),
        ] {
            expect_still(what, with(material, &corners, &wall.1));
        }
        let mut both = scene();
        add(&mut both, BLEND, &wall.0, &wall.1);
        add(&mut both, GLASS, &wall.0, &wall.1);
        expect_still("nothing opaque", both);
        // Thinner than what it would have to move, far from the origin.
        let mut thin = scene();
        let up = 300.0 * Vec3::Z;
        add(&mut thin, WALL, &wall.0.map(|it| it + up), &wall.1);
        cube(&mut thin, GLASS, up, up + Vec3::new(0.5, 0.5, 0.004));
        expect_still("thin glass", thin);
        for name in builtin::names() {
            expect_still(name, builtin::build(name).expect(name));
        }
    }

    #[test]
    fn a_pane_of_two_faces_stays_one() {
        let (corners, triangles) = square([0.0; 2], 1.0, false);
        let pane = |scene: &mut Scene, back: u32| {
            add(scene, BLEND, &corners, &triangles);
            add(scene, back, &corners, &turned(triangles));
        };
        let mut painted = scene();
        painted.materials[WALL as usize].double_sided = false;
        pane(&mut painted, WALL);
        painted.pair_backs();
        expect_still("each is met from its front alone", painted);
        let mut scene = scene();
        pane(&mut scene, BLEND);
        let (wall, triangles) = square([0.0; 2], 2.0, false);
        add(&mut scene, WALL, &wall, &triangles);
        scene.pair_backs();
        scene.part_flush_faces();
        let corners = corners_of(&scene, scene.triangle_materials[0]);
        assert_eq!(corners.len(), 12);
        assert!(corners.iter().all(|it| it.z == corners[0].z && it.z > 3e-5));
    }

    #[test]
    fn what_is_opaque_keeps_its_corners() {
        let mut scene = scene();
        let (corners, triangles) = square([0.0; 2], 1.0, false);
        add(&mut scene, WALL, &corners, &triangles);
        // Of the same corners, but for one.
        scene.positions.push(Vec3::new(0.3, 0.4, 0.0));
        scene.normals = vec![Vec3::Z; 5];
        scene.uvs[0] = (0..5).map(|i| glam::Vec2::splat(i as f32)).collect();
        scene.triangles.push([0, 1, 4]);
        scene.triangle_materials.push(BLEND);
        scene.part_flush_faces();
        assert_eq!(scene.positions[..4], corners);
        assert_eq!(scene.triangles, [[0, 1, 2], [0, 2, 3], [5, 6, 7]]);
        assert!(scene.positions[5..].iter().all(|it| it.z > 3e-5));
        assert_eq!(scene.uvs[0][5..], [0.0, 1.0, 4.0].map(glam::Vec2::splat));
        assert_eq!((scene.normals.len(), scene.uvs[1].len()), (8, 0));
    }

    /// One of two glasses stands on the floor: their mesh moves in its own space, for both.
    #[test]
    fn instances_move_with_their_mesh() {
        let mut scene = scene();
        let (corners, triangles) = square([0.0; 2], 3.0, false);
        add(&mut scene, WALL, &corners, &triangles);
        let (low, high) = (Vec3::new(0.0, 0.0, 10.0), Vec3::new(20.0, 20.0, 40.0));
        cube(&mut scene, GLASS, low, high);
        let place = |z: f64| {
            let scale = DAffine3::from_scale(DVec3::new(0.01, -0.01, 0.02));
            let world = DAffine3::from_translation(DVec3::new(0.1, 0.2, z)) * scale;
            Instance { mesh: 0, placing: Placing::new(world) }
        };
        let meshes = std::iter::once(2..14).collect();
        scene.instances = Instances::new(meshes, vec![place(1.0), place(-0.2)]);
        scene.part_flush_faces();
        assert!(is_closed(&scene, GLASS));
        let heights = || corners_of(&scene, GLASS).into_iter().map(|it| it.z);
        let lowest = heights().fold(f32::MAX, f32::min);
        let gap = 0.02 * (lowest - 10.0) * 65536.0;
        assert!((2.4..2.6).contains(&gap), "{gap} jumps");
        assert_eq!(heights().fold(0.0, f32::max), 40.0);
        assert_eq!(heights().filter(|it| *it == lowest).count(), 18);
    }

    #[test]
    fn many_faces_are_found_in_time() {
        const SIDE: u32 = 224;
        let mut scene = scene();
        for (material, step) in [(WALL, 1.0), (BLEND, 0.9)] {
            let first = scene.positions.len() as u32;
            for (i, k) in (0..=SIDE).flat_map(|i| (0..=SIDE).map(move |k| (i, k))) {
                scene.positions.push(0.1 * step * Vec3::new(i as f32, k as f32, 0.0));
            }
            for (i, k) in (0..SIDE).flat_map(|i| (0..SIDE).map(move |k| (i, k))) {
                let at = |i: u32, k: u32| first + i * (SIDE + 1) + k;
                let corners = [at(i, k), at(i + 1, k), at(i + 1, k + 1), at(i, k + 1)];
                let [a, b, c, d] = corners;
                scene.triangles.extend([[a, b, c], [a, c, d]]);
                scene.triangle_materials.extend([material; 2]);
            }
        }
        let started = std::time::Instant::now();
        scene.part_flush_faces();
        let took = started.elapsed();
        assert!(corners_of(&scene, WALL).iter().all(|it| it.z == 0.0));
        let decals = corners_of(&scene, BLEND);
        assert!(decals.iter().all(|it| it.z > 3e-5 && it.z < 2e-4));
        eprintln!("{} triangles: {took:.2?}", scene.triangles.len());
        assert!(took.as_secs() < 20, "{took:?}");
    }
}
