//! Worlds put together in code: quads, boxes, spheres, lights.

use glam::{Vec2, Vec3};

use super::World;
use crate::math::direction_from_uv;
use crate::scene::{Material, PunctualLight, Scene};

/// Rings of a sphere from pole to pole; it has twice as many meridians.
const RINGS: u32 = 16;

/// A scene being put together; every method returns it.
///
/// ```
/// # use lightgrid::path::WorldBuilder;
/// # use lightgrid::scene::Material;
/// let grey = Material::lambert(0.5);
/// let world = WorldBuilder::default()
///     .floor(&grey, [0.0; 3], 10.0)
///     .sphere(&grey, [0.0, 1.0, 0.0], 1.0)
///     .build();
/// assert_eq!(world.scene.materials.len(), 1);
/// ```
#[derive(Debug, Clone, Default)]
pub struct WorldBuilder {
    /// What there is so far.
    pub scene: Scene,
}

impl WorldBuilder {
    /// Makes it ready for rays.
    pub fn build(self) -> World {
        World::new(self.scene)
    }

    /// Adds a light without size.
    #[must_use]
    pub fn light(mut self, light: PunctualLight) -> Self {
        self.scene.lights.push(light);
        self
    }

    /// Any triangles, counter-clockwise seen from the front.
    #[must_use]
    pub fn triangles(mut self, material: &Material, corners: &[[Vec3; 3]]) -> Self {
        let triangles = (0..).step_by(3).map(|first| [first, first + 1, first + 2]);
        let triangles: Vec<[u32; 3]> = triangles.take(corners.len()).collect();
        let positions = corners.as_flattened();
        self.add(material, positions, &vec![Vec2::ZERO; positions.len()], &triangles);
        self
    }

    /// A parallelogram; its front is where `a cross b` points, `u` grows along `a`, `v` along `b`.
    #[must_use]
    pub fn quad(
        mut self,
        material: &Material,
        corner: impl Into<Vec3>,
        a: impl Into<Vec3>,
        b: impl Into<Vec3>,
    ) -> Self {
        let (corner, a, b) = (corner.into(), a.into(), b.into());
        let corners = [corner, corner + a, corner + a + b, corner + b];
        let uvs = [Vec2::ZERO, Vec2::X, Vec2::ONE, Vec2::Y];
        self.add(material, &corners, &uvs, &[[0, 1, 2], [0, 2, 3]]);
        self
    }

    /// A horizontal square of side `size` metres around `center`, front up.
    #[must_use]
    pub fn floor(self, material: &Material, center: impl Into<Vec3>, size: f32) -> Self {
        let corner = center.into() + Vec3::new(-0.5, 0.0, 0.5) * size;
        self.quad(material, corner, Vec3::X * size, Vec3::NEG_Z * size)
    }

    /// A face of a box, front outwards: 0 and 1 are +X and -X, then Y, then Z.
    #[must_use]
    pub fn face(self, material: &Material, low: Vec3, high: Vec3, face: usize) -> Self {
        let axis = face / 2;
        let size = high - low;
        let edge = |axis: usize| Vec3::AXES[axis % 3] * size[axis % 3];
        let (a, b) = (edge(axis + 1), edge(axis + 2));
        if face.is_multiple_of(2) {
            self.quad(material, low + edge(axis), a, b)
        } else {
            self.quad(material, low, b, a)
        }
    }

    /// Several of a box's faces.
    #[must_use]
    pub fn faces(
        self,
        material: &Material,
        low: Vec3,
        high: Vec3,
        faces: impl IntoIterator<Item = usize>,
    ) -> Self {
        faces.into_iter().fold(self, |builder, face| builder.face(material, low, high, face))
    }

    /// A closed sphere of flat faces.
    #[must_use]
    pub fn sphere(self, material: &Material, center: impl Into<Vec3>, radius: f32) -> Self {
        let center = center.into();
        let at = |i: u32, j: u32| {
            // The same vertices from both sides of the seam: the sphere must be closed.
            let uv =
                Vec2::new((i % (2 * RINGS)) as f32 / (2 * RINGS) as f32, j as f32 / RINGS as f32);
            let pole = if j == 0 { Some(Vec3::Y) } else { (j == RINGS).then_some(Vec3::NEG_Y) };
            center + radius * pole.unwrap_or_else(|| direction_from_uv(uv))
        };
        let mut corners = Vec::new();
        for (i, j) in (0..2 * RINGS).flat_map(|i| (0..RINGS).map(move |j| (i, j))) {
            let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
            if j > 0 {
                corners.push([a, b, c]);
            }
            if j + 1 < RINGS {
                corners.push([a, c, d]);
            }
        }
        self.triangles(material, &corners)
    }

    /// Adds a mesh; a material that is there already is used again.
    fn add(
        &mut self,
        material: &Material,
        positions: &[Vec3],
        uvs: &[Vec2],
        triangles: &[[u32; 3]],
    ) {
        let scene = &mut self.scene;
        let index = scene.materials.iter().position(|m| m == material).unwrap_or_else(|| {
            scene.materials.push(material.clone());
            scene.materials.len() - 1
        });
        let first = scene.positions.len() as u32;
        scene.positions.extend(positions);
        scene.uvs[0].extend(uvs);
        scene.triangles.extend(triangles.iter().map(|t| t.map(|corner| first + corner)));
        scene.triangle_materials.extend(vec![index as u32; triangles.len()]);
    }
}
