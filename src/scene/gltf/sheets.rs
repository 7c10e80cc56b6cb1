//! Sheets: surfaces that `KHR_materials_volume` gives an inside though they enclose none.
//!
//! The extension wants closed meshes; exporters give a thickness to single panes, too. A ray that enters such a
//! surface would stay inside of the body for ever.

use std::collections::{BTreeMap, HashMap};

use glam::{DVec3, Vec3};

use super::part::Part;
use super::share;
use crate::memory;
use crate::scene::lists::appended;

/// Corners so near to each other are one, as a share of the largest coordinate: seams of closed meshes are
/// rounded.
const WELD: f32 = 3e-6;

/// Least area of the holes of a sheet, as a share of its own: meshes of solid bodies have cracks.
const MIN_HOLES: f64 = 0.01;

/// Bytes that a triangle takes while holes are looked for.
const BYTES: u64 = 250;

/// Which parts of a mesh are sheets for the greater part of their area. Pieces that hang together are looked
/// at as a whole, whatever their parts.
///
/// # Errors
/// Memory is short.
pub(super) fn sheets(parts: &[Part]) -> Result<Vec<bool>, String> {
    let count: usize = parts.iter().map(|part| part.triangles.len()).sum();
    memory::check(BYTES * count as u64)?;
    let (corners, triangles) = welded(parts);
    let mut pieces = Groups::new(corners.len());
    let mut edges = Vec::with_capacity(3 * count);
    for &[a, b, c] in triangles.iter().flatten() {
        for (from, to) in [(a, b), (b, c), (c, a)] {
            pieces.join(from, to);
            edges.push((from.min(to), from.max(to), from));
        }
    }
    edges.sort_unstable();
    let is_same =
        |one: &(u32, u32, u32), other: &(u32, u32, u32)| (one.0, one.1) == (other.0, other.1);
    let rims: Vec<_> =
        edges.chunk_by(is_same).filter(|same| same.len() == 1).map(|one| one[0]).collect();
    let mut holes = Groups::new(corners.len());
    rims.iter().for_each(|&(a, b, _)| holes.join(a, b));

    // Twice the area within each rim, as a vector, and of what it is a hole.
    let mut areas: BTreeMap<u32, DVec3> = BTreeMap::new();
    for &(low, high, from) in &rims {
        let hole = holes.find(low);
        let [a, b] =
            [low, high].map(|it| (corners[it as usize] - corners[hole as usize]).as_dvec3());
        let swept = if from == low { a.cross(b) } else { b.cross(a) };
        *areas.entry(hole).or_default() += swept;
    }
    let mut open: BTreeMap<u32, f64> = BTreeMap::new();
    for (hole, area) in areas {
        *open.entry(pieces.find(hole)).or_default() += area.length();
    }
    let area = |&[a, b, c]: &[u32; 3]| {
        let [a, b, c] = [a, b, c].map(|corner| corners[corner as usize]);
        f64::from((b - a).cross(c - a).length())
    };
    let mut whole: BTreeMap<u32, f64> = BTreeMap::new();
    for triangle in triangles.iter().flatten() {
        *whole.entry(pieces.find(triangle[0])).or_default() += area(triangle);
    }
    let is_sheet = |triangles: &Vec<[u32; 3]>| {
        let (mut all, mut sheet) = (0.0, 0.0);
        for triangle in triangles {
            let piece = pieces.find(triangle[0]);
            let is_open = open.get(&piece).is_some_and(|open| *open > MIN_HOLES * whole[&piece]);
            all += area(triangle);
            sheet += if is_open { area(triangle) } else { 0.0 };
        }
        sheet > 0.5 * all
    };
    Ok(triangles.iter().map(is_sheet).collect())
}

/// Places of corners, and the triangles of each part between them, without those that have become flat.
fn welded(parts: &[Part]) -> (Vec<Vec3>, Vec<Vec<[u32; 3]>>) {
    let extent = share::extent(&parts.iter().collect::<Vec<_>>());
    let cell = (WELD * extent).max(f32::MIN_POSITIVE);
    let (mut corners, mut numbers) = (Vec::new(), HashMap::new());
    let weld = |part: &Part| {
        let mut number = |vertex: u32| {
            let position = part.positions[vertex as usize];
            let place = (position / cell).round().as_ivec3();
            *numbers.entry(place).or_insert_with(|| appended(&mut corners, position))
        };
        let welded = part.triangles.iter().map(|triangle| triangle.map(&mut number));
        welded.filter(|[a, b, c]| a != b && b != c && c != a).collect()
    };
    let triangles = parts.iter().map(weld).collect();
    (corners, triangles)
}

/// Corners that hang together, each led by one of them.
struct Groups(Vec<u32>);

impl Groups {
    /// Each on its own.
    fn new(count: usize) -> Self {
        Self((0..count as u32).collect())
    }

    /// Who leads the group of a corner.
    fn find(&mut self, mut corner: u32) -> u32 {
        while self.0[corner as usize] != corner {
            let next = self.0[corner as usize];
            self.0[corner as usize] = self.0[next as usize];
            corner = next;
        }
        corner
    }

    fn join(&mut self, a: u32, b: u32) {
        let [a, b] = [a, b].map(|corner| self.find(corner));
        self.0[a.max(b) as usize] = a.min(b);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A tube around the y axis of rings (height, radius), each of `count` corners but for a seam of two that are
    /// not quite in the same place.
    fn tube(rings: &[(f32, f32)], count: u32) -> Part {
        let corner = |(height, radius): (f32, f32), number: u32| {
            let angle = std::f32::consts::TAU * number as f32 / count as f32;
            Vec3::new(radius * angle.cos(), height, radius * angle.sin())
        };
        let positions = rings.iter().flat_map(|&ring| (0..=count).map(move |n| corner(ring, n)));
        let quads = (0..rings.len() as u32 - 1)
            .flat_map(|ring| (0..count).map(move |n| ring * (count + 1) + n));
        let above = count + 1;
        let triangles =
            quads.flat_map(|q| [[q, q + above, q + 1], [q + 1, q + above, q + above + 1]]);
        Part { triangles: triangles.collect(), positions: positions.collect(), ..Part::default() }
    }

    fn is_sheet(part: Part) -> bool {
        sheets(&[part]).unwrap() == [true]
    }

    #[test]
    fn closed_bodies_are_none_but_panes_bowls_and_tubes_are() {
        let ball: Vec<(f32, f32)> = (0..=16)
            .map(|ring| (std::f32::consts::PI * ring as f32 / 16.0).sin_cos())
            .map(|(sin, cos)| (1000.0 + cos, sin))
            .collect();
        assert!(!is_sheet(tube(&ball, 24)), "its poles and its seam are rounded");
        let mut cracked = tube(&ball, 24);
        cracked.triangles.swap_remove(300);
        assert!(!is_sheet(cracked), "a small triangle is missing");
        assert!(!is_sheet(tube(&[(0.0, 0.0), (0.0, 1.0), (9.0, 1.0), (9.0, 0.0)], 12)));
        let cup = [(0.0, 0.0), (0.0, 1.0), (2.0, 1.0), (2.0, 0.9), (0.1, 0.9), (0.1, 0.0)];
        assert!(!is_sheet(tube(&cup, 12)), "it has walls of some thickness");

        assert!(is_sheet(tube(&ball[8..], 24)));
        assert!(is_sheet(tube(&[(0.0, 1.0), (9.0, 1.0)], 12)), "the areas of its holes cancel");
        assert!(is_sheet(tube(&cup[..3], 12)));
        assert!(is_sheet(tube(&[(0.0, 0.0), (0.0, 1.0)], 4)));
    }

    #[test]
    fn parts_close_each_other_and_the_greater_part_of_one_decides() {
        let wall = || tube(&[(0.0, 1.0), (1.0, 1.0)], 12);
        let bottom = || tube(&[(0.0, 0.0), (0.0, 1.0)], 12);
        let top = || tube(&[(1.0, 1.0), (1.0, 0.0)], 12);
        assert_eq!(sheets(&[wall(), bottom()]).unwrap(), [true; 2]);
        assert_eq!(sheets(&[wall(), bottom(), top()]).unwrap(), [false; 3]);
        // A level inside of the body is open, but is not the body's hole.
        let level = tube(&[(0.5, 0.0), (0.5, 0.7)], 12);
        assert_eq!(sheets(&[wall(), bottom(), top(), level]).unwrap(), [false, false, false, true]);
        // Half way up it hangs together with the wall.
        let walls = || tube(&[(0.0, 1.0), (0.5, 1.0), (1.0, 1.0)], 12);
        let level = tube(&[(0.5, 0.0), (0.5, 1.0)], 12);
        assert_eq!(sheets(&[walls(), bottom(), top(), level]).unwrap(), [false; 4]);
        assert!(sheets(&[]).unwrap().is_empty());
    }
}
