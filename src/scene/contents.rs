//! What is in a scene, and its triangles by their numbers.

use std::ops::Range;
use std::path::PathBuf;
use std::sync::Arc;

use glam::{Vec2, Vec3, Vec4};

use super::camera::Camera;
use super::camera_path::CameraPath;
use super::frame::Frame;
use super::instances::{Instances, Surface};
use super::light::PunctualLight;
use super::material::{Material, Texture, TextureImage};
use super::medium::Medium;
use crate::error::{Error, Notices, Result};
use crate::math::box_corners;

/// All that can be rendered, ready for a BVH: in world space, but for meshes that instances share.
///
/// Per-vertex arrays are either empty (nothing in the scene has it) or as long as `positions`.
#[derive(Debug, Clone, Default)]
pub struct Scene {
    /// What to call it: the file name or the built-in's name.
    pub name: String,
    /// Where the world lies in the file.
    pub frame: Frame,
    /// World-space vertex positions in metres; of shared meshes in their own space, as are normals and
    /// tangents.
    pub positions: Vec<Vec3>,
    /// World-space unit normals; zero where the triangle is to be shaded flat.
    pub normals: Vec<Vec3>,
    /// World-space unit tangents, w = +1 or -1 for the bitangent `w * (normal cross tangent)`.
    pub tangents: Vec<Vec4>,
    /// Texture coordinates, two sets.
    pub uvs: [Vec<Vec2>; 2],
    /// Linear vertex colours with alpha.
    pub colors: Vec<Vec4>,
    /// Vertex indices, counter-clockwise seen from the front.
    pub triangles: Vec<[u32; 3]>,
    /// Index into `materials` for each triangle.
    pub triangle_materials: Vec<u32>,
    /// Meshes, the last of the triangles, that are held once and shown in several places.
    pub instances: Instances,
    /// Materials; never empty once loaded.
    pub materials: Vec<Material>,
    /// Textures: an image and how it is sampled.
    pub textures: Vec<Texture>,
    /// Decoded images.
    pub images: Vec<TextureImage>,
    /// Cameras in file order.
    pub cameras: Vec<Camera>,
    /// How each of them moves, if it does; empty for built-in scenes.
    pub camera_paths: Vec<Option<CameraPath>>,
    /// Point, spot and directional lights.
    pub lights: Vec<PunctualLight>,
    /// What fills the space between surfaces; `None` is clear air.
    pub medium: Option<Medium>,
    /// Files beside its own that it was read from.
    pub files: Arc<[PathBuf]>,
    /// What was repaired, skipped or assumed while loading.
    pub notices: Notices,
}

impl Scene {
    /// Triangles that are not of meshes but lie in the world: places in [`Self::triangles`].
    pub fn own_triangles(&self) -> Range<u32> {
        0..self.instances.first.min(self.triangles.len() as u32)
    }

    /// How many triangles are shown, those of instances counted one by one.
    pub fn shown_triangles(&self) -> u64 {
        let meshes = self.instances.meshes();
        let instances = self.instances.iter().map(|instance| meshes[instance.mesh as usize].len());
        (self.own_triangles().len() + instances.sum::<usize>()) as u64
    }

    /// Index of the camera of this name or, if none has it, of this number, counted from 0.
    ///
    /// # Errors
    /// If the scene has no such camera; the sentence calls the scene `file`.
    pub(crate) fn camera_number(&self, name: &str, file: &str) -> Result<usize> {
        let named = self.cameras.iter().position(|camera| camera.name == name);
        let counted = || name.parse().ok().filter(|number| *number < self.cameras.len());
        named.or_else(counted).ok_or_else(|| {
            let there_are = match self.cameras.len() {
                0 => "no camera".to_owned(),
                1 => format!("one camera, {:?}", self.cameras[0].name),
                count => format!("cameras 0 to {}; `lightgrid info` names them", count - 1),
            };
            Error::new(format!("--camera {name}: {file} has {there_are}"))
        })
    }

    /// World positions of the corners of a triangle, given its number.
    pub fn corners(&self, triangle: u32) -> [Vec3; 3] {
        self.corners_at(self.instances.find(triangle))
    }

    pub(super) fn corners_at(&self, (place, placing): Surface<'_>) -> [Vec3; 3] {
        let corners = self.triangles[place].map(|vertex| self.positions[vertex as usize]);
        placing.map_or(corners, |placing| placing.turned(corners.map(|p| placing.position(p))))
    }

    /// Index of the material of a triangle, given its number.
    #[inline]
    pub fn material_of(&self, triangle: u32) -> u32 {
        self.triangle_materials[self.instances.find(triangle).0]
    }

    /// The triangles in the world, and those of each mesh once, where its first instance is.
    pub(super) fn each_once(&self) -> impl Iterator<Item = Surface<'_>> {
        let mut placings = vec![None; self.instances.meshes().len()];
        for instance in self.instances.iter().rev() {
            placings[instance.mesh as usize] = Some(&instance.placing);
        }
        let shown = self.instances.meshes().iter().cloned().zip(placings);
        let shown = shown.filter(|(_, placing)| placing.is_some());
        let of_meshes =
            shown.flat_map(|(mesh, placing)| mesh.map(move |at| (at as usize, placing)));
        self.own_triangles().map(|place| (place as usize, None)).chain(of_meshes)
    }

    /// World points whose hull holds all triangles of some materials: their corners, and those of boxes
    /// around instances.
    pub fn hull_points(&self, is_wanted: impl Fn(u32) -> bool) -> impl Iterator<Item = Vec3> {
        let corners = |place: usize| self.triangles[place].map(|v| self.positions[v as usize]);
        let is_wanted = move |place: &usize| is_wanted(self.triangle_materials[*place]);
        let around = |mesh: &Range<u32>| {
            let mesh = (mesh.start as usize..mesh.end as usize).filter(&is_wanted);
            let ends = mesh.flat_map(corners).map(|point| [point, point]);
            ends.reduce(|[low, high], [point, _]| [low.min(point), high.max(point)])
        };
        let boxes: Vec<_> = self.instances.meshes().iter().map(around).collect();
        let of_instances = self.instances.iter().flat_map(move |instance| {
            let corners = boxes[instance.mesh as usize].into_iter().flat_map(box_corners);
            corners.map(|corner| instance.placing.position(corner))
        });
        let own = self.own_triangles().map(|place| place as usize);
        own.filter(is_wanted).flat_map(corners).chain(of_instances)
    }
}
