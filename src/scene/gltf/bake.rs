//! Placing parts in the world: the arrays of the scene.

use glam::{DAffine3, DMat3, DVec3, Vec2, Vec3, Vec4};

use super::limits::{Fallible, MAX_TRIANGLES, check_count, check_growth};
use super::part::Part;
use super::tangents::NO_TANGENT;
use crate::scene::{Placing, Scene};

/// Appends a part once for each place; returns how many triangles were dropped, as all of these functions do. Memory is
/// reserved only after the limits are checked.
pub(super) fn instances(scene: &mut Scene, part: &Part, places: &[DAffine3]) -> Fallible<usize> {
    check_limits(scene, part, places.len())?;
    let placings = places.iter().map(|&world_from_mesh| Placing::new(world_from_mesh));
    Ok(placings.map(|placing| append(scene, part, |_| placing, placing.mirrors())).sum())
}

/// Appends a part as it is, for all its instances.
pub(super) fn shared(scene: &mut Scene, part: &Part) -> Fallible<usize> {
    check_limits(scene, part, 1)?;
    let first = append_vertices(scene, part);
    Ok(append_triangles(scene, part, first, false))
}

/// Appends a part whose vertices follow joints; `joints` are world from bind space.
pub(super) fn skinned(scene: &mut Scene, part: &Part, joints: &[DAffine3]) -> Fallible<usize> {
    check_limits(scene, part, 1)?;
    let stride = part.influences_per_vertex;
    let is_missing =
        |&&(joint, weight): &&(u32, f32)| weight != 0.0 && joint as usize >= joints.len();
    if let Some((joint, _)) = part.influences.iter().find(is_missing) {
        return Err(format!("joint {joint} is used, but its skin has {}", joints.len()));
    }
    let placing = |vertex: usize| {
        let mut blend = DAffine3 { matrix3: DMat3::ZERO, translation: DVec3::ZERO };
        for &(joint, weight) in &part.influences[vertex * stride..(vertex + 1) * stride] {
            if let Some(transform) = joints.get(joint as usize) {
                blend.matrix3 += transform.matrix3 * f64::from(weight);
                blend.translation += transform.translation * f64::from(weight);
            }
        }
        Placing::new(blend)
    };
    // Joints of one skin mirror together or not at all, but for those that hide a limb.
    let shown = joints.iter().find(|joint| joint.matrix3.determinant() != 0.0);
    let mirrors = shown.is_some_and(|&joint| Placing::new(joint).mirrors());
    Ok(append(scene, part, placing, mirrors))
}

/// Bytes of a triangle with its place in the tree while that is built, and of a vertex.
const TRIANGLE_BYTES: u64 = 250;
const VERTEX_BYTES: u64 = 72;
/// How a refusal of them begins.
pub(super) const WITH_INSTANCES: &str = "with all instances there are";

fn check_limits(scene: &Scene, part: &Part, copies: usize) -> Fallible<()> {
    let total = |present: usize, added: usize| {
        (added as u64).saturating_mul(copies as u64).saturating_add(present as u64)
    };
    let triangles = total(scene.triangles.len(), part.triangles.len());
    check_count(triangles, MAX_TRIANGLES, WITH_INSTANCES, "triangles")?;
    let bytes = |triangles: usize, vertices: usize| {
        TRIANGLE_BYTES * triangles as u64 + VERTEX_BYTES * vertices as u64
    };
    let added = bytes(part.triangles.len(), part.positions.len()).saturating_mul(copies as u64);
    check_growth(bytes(scene.triangles.len(), scene.positions.len()), added)?;
    // Three per triangle, unless most triangles of a part were dropped; far below 2^32.
    let vertices = total(scene.positions.len(), part.positions.len());
    check_count(vertices, 3 * MAX_TRIANGLES, WITH_INSTANCES, "vertices")
}

/// Appends vertices as they are; the number of the first.
fn append_vertices(scene: &mut Scene, part: &Part) -> usize {
    let first = scene.positions.len();
    extend(&mut scene.normals, first, &part.normals, Vec3::ZERO);
    extend(&mut scene.tangents, first, &part.tangents, NO_TANGENT);
    extend(&mut scene.uvs[0], first, &part.uvs[0], Vec2::ZERO);
    extend(&mut scene.uvs[1], first, &part.uvs[1], Vec2::ZERO);
    extend(&mut scene.colors, first, &part.colors, Vec4::ONE);
    scene.positions.extend_from_slice(&part.positions);
    first
}

fn append(
    scene: &mut Scene,
    part: &Part,
    placing: impl Fn(usize) -> Placing,
    mirrors: bool,
) -> usize {
    let first = append_vertices(scene, part);
    for vertex in 0..part.positions.len() {
        let placing = placing(vertex);
        let position = &mut scene.positions[first + vertex];
        *position = placing.position(*position);
        if let Some(normal) = scene.normals.get_mut(first + vertex) {
            *normal = placing.normal(*normal);
        }
        if let Some(tangent) = scene.tangents.get_mut(first + vertex) {
            *tangent = placing.tangent(*tangent);
        }
    }
    append_triangles(scene, part, first, mirrors)
}

fn append_triangles(scene: &mut Scene, part: &Part, first: usize, mirrors: bool) -> usize {
    let before = scene.triangles.len();
    for corners in &part.triangles {
        let [a, b, c] = corners.map(|vertex| first as u32 + vertex);
        let triangle = if mirrors { [a, c, b] } else { [a, b, c] };
        if is_sound(triangle.map(|vertex| scene.positions[vertex as usize])) {
            scene.triangles.push(triangle);
            scene.triangle_materials.push(part.material);
        }
    }
    part.triangles.len() - (scene.triangles.len() - before)
}

/// Appends vertex data behind what the earlier vertices have; `pad` for those that have none, if any vertex has some.
fn extend<T: Copy>(array: &mut Vec<T>, first: usize, values: &[T], pad: T) {
    if !array.is_empty() || !values.is_empty() {
        array.resize(first, pad);
        array.extend_from_slice(values);
    }
}

/// Makes every array that has anything as long as the positions, and all positions finite.
pub(super) fn finish(scene: &mut Scene) {
    // No triangle uses such a position, but bounds are taken over all of them.
    if let Some(&[vertex, ..]) = scene.triangles.first() {
        let inside = scene.positions[vertex as usize];
        for position in scene.positions.iter_mut().filter(|position| !is_near(**position)) {
            *position = inside;
        }
    }
    append_vertices(scene, &Part::default());
}

/// Beyond this many metres nothing can be computed in f32: squares of distances would overflow.
pub(super) const FARTHEST: f32 = 1e18;

/// Whether a position is finite and then some.
pub(super) fn is_near(position: Vec3) -> bool {
    position.abs().max_element() <= FARTHEST && !position.is_nan()
}

/// Whether a triangle has an area and lies within reach (in f64: small scenes have areas that f32 cannot tell from 0).
fn is_sound(corners: [Vec3; 3]) -> bool {
    let [a, b, c] = corners.map(|corner| corner.as_dvec3());
    let twice_area = (b - a).cross(c - a).length_squared();
    corners.into_iter().all(is_near) && twice_area.is_finite() && twice_area > 0.0
}
