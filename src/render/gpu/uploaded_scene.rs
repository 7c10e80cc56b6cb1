//! What does not change with the view: a scene and a map on a device.

use std::borrow::Cow;

use rayon::prelude::*;

use super::acceleration::Acceleration;
use super::buffers::Buffers;
use super::device::Gpu;
use super::features::Features;
use super::layout::{self, Globals};
use super::shader::{self, Constants, SHARED_STACK_SIZE};
use super::texels::VertexTexels;
use crate::bvh::InstanceWords;
use crate::bvh::compressed::CompressedTree;
use crate::environment::Environment;
use crate::error::{Error, Result};
use crate::path::{LocalLights, World};
use crate::scene::needs::SceneFeatures;

/// Deepest tree a traversal's stack is made for.
const MAX_DEPTH: u32 = 96;
/// Texels of a texture that are uploaded at a time.
const PART: usize = 1 << 16;

/// A scene and a map uploaded once for any number of views.
#[derive(Clone)]
pub struct UploadedScene {
    pub(super) buffers: Buffers,
    pub(super) globals: Globals,
    pub(super) constants: Constants,
    /// The map that is uploaded; it shares its pixels with the one it was cloned from.
    environment: Environment,
}

impl UploadedScene {
    /// Uploads both.
    ///
    /// # Errors
    /// If something does not fit on the device, with the numbers.
    pub fn new(gpu: &Gpu, world: &World, environment: &Environment) -> Result<Self> {
        let mut uploaded = Self {
            buffers: Buffers::new(gpu),
            globals: Globals::default(),
            constants: Constants::default(),
            environment: environment.clone(),
        };
        uploaded.put_map(environment)?;
        uploaded.put_world(world)?;
        Ok(uploaded)
    }

    /// The same scene under another map; one that is only turned or scaled is not uploaded again.
    ///
    /// # Errors
    /// If it does not fit on the device, with the numbers.
    pub fn relit(&self, environment: &Environment) -> Result<Self> {
        let mut uploaded = Self { environment: environment.clone(), ..self.clone() };
        // A black map was never uploaded.
        let is_there = environment.is_black() || !self.environment.is_black();
        if environment.shares_map_with(&self.environment) && is_there {
            uploaded.globals.set_environment(environment);
        } else {
            uploaded.put_map(environment)?;
        }
        Ok(uploaded)
    }

    /// Uploads geometry, materials, textures and lights.
    fn put_world(&mut self, world: &World) -> Result<()> {
        let scene = &world.scene;
        let features = Features::of_world(world);
        let (materials, texture_refs) = layout::materials(world);
        let bounds = world.bvh.bounds();
        self.globals.scene_extent = bounds.0.abs().max(bounds.1.abs()).max_element();
        let flags_of =
            |triangle: u32| materials[scene.triangle_materials[triangle as usize] as usize].flags;
        let stack_size = if self.buffers.gpu.has_hardware_rays() {
            let tree = Acceleration::build(&self.buffers.gpu, world, flags_of)?;
            self.globals.opaque_triangles = tree.opaque;
            self.put_instances(world, &tree.instances)?;
            let buffers = &mut self.buffers;
            put_array(buffers, "query_triangles", "the scene's geometry", &tree.triangles)?;
            buffers.tree = Some(tree.tlas);
            0
        } else {
            self.put_tree(world, flags_of)?
        };
        let Self { buffers, globals, .. } = self;
        let vertex = VertexTexels::of(features);
        put_array(buffers, "triangles", "the scene's geometry", &layout::triangles(scene))?;
        put_array(buffers, "vertices", "the scene's geometry", &layout::vertices(scene, &vertex))?;
        put_array(buffers, "materials", "the list of materials", &materials)?;
        if features.scene.contains(SceneFeatures::TEXTURES) {
            put_array(buffers, "texture_refs", "the list of textures", &texture_refs)?;
            let texels = scene.images.iter().map(|image| image.texels.stored_len() as u64).sum();
            // Part by part: those of fewer channels are copied.
            let parts = scene.images.iter().flat_map(|image| {
                let count = image.texels.stored_len();
                let part = move |start| image.texels.rgba_of(start..count.min(start + PART));
                (0..count).step_by(PART).map(part)
            });
            let parts = parts.map(|part| match part {
                Cow::Borrowed(texels) => Cow::Borrowed(bytemuck::cast_slice(texels)),
                Cow::Owned(texels) => Cow::Owned(texels.into_flattened()),
            });
            buffers.put_array("texels", "the set of textures", texels, parts)?;
        }
        if features.scene_lights() {
            put_lights(buffers, globals, &world.lights)?;
        }
        self.constants = Constants {
            stack_size,
            shared_stack_size: stack_size.min(SHARED_STACK_SIZE),
            vertex,
            textures_in_scene: world.needs.texture_slots,
            metres: world.scene.frame.length_in_file(1.0).to_bits(),
            ..Constants::default()
        };
        Ok(())
    }

    /// Uploads the tree that kernels walk; returns how many groups of nodes a walk has to remember.
    fn put_tree(&mut self, world: &World, flags_of: impl Fn(u32) -> u32) -> Result<u32> {
        let (scene, bvh) = (&world.scene, &world.bvh);
        let meshes = scene.instances.meshes();
        let tree = CompressedTree::build(&scene.positions, &scene.triangles, meshes, bvh, flags_of);
        if tree.depth > MAX_DEPTH {
            return Err(Error::new(format!(
                "the scene's tree is {} levels deep; a GPU walks at most {MAX_DEPTH}",
                tree.depth
            )));
        }
        let buffers = &mut self.buffers;
        put_array(buffers, "bvh_nodes", "the scene's tree", tree.nodes.as_flattened())?;
        put_array(buffers, "bvh_triangles", "the scene's geometry", tree.triangles.as_flattened())?;
        self.put_instances(world, &tree.instances)?;
        // One of each level but the root's.
        Ok(tree.depth.max(2) - 1)
    }

    /// Uploads the instances, if there are any.
    fn put_instances(&mut self, world: &World, instances: &[InstanceWords]) -> Result<()> {
        if !world.needs.has(SceneFeatures::INSTANCES) {
            return Ok(());
        }
        let (first, slot_log2, slots) = world.scene.instances.slots();
        let Self { buffers, globals, .. } = self;
        (globals.first_of_instances, globals.slot_log2) = (first, slot_log2);
        put_array(buffers, "instance_slots", "the list of instances", slots)?;
        put_array(buffers, "instances", "the list of instances", instances.as_flattened())
    }

    /// Uploads the map's radiance and its importance table.
    fn put_map(&mut self, environment: &Environment) -> Result<()> {
        let Self { buffers, globals, .. } = self;
        globals.set_environment(environment);
        if environment.is_black() {
            return Ok(());
        }
        let map = environment.map();
        let rows = map.pixels.chunks(map.width as usize * 64).map(|rows| {
            let words: Vec<[u32; 2]> =
                rows.par_iter().map(|rgb| layout::pack_radiance(*rgb)).collect();
            Cow::Owned(bytemuck::pod_collect_to_vec(&words))
        });
        buffers.put_array("map_texels", "the map", map.pixels.len() as u64, rows)?;
        let parts = environment.tile_sums().ok_or_else(|| {
            let kind = environment.table_kind;
            Error::new(format!("a summed-area table ({kind}) is for the CPU alone"))
        })?;
        globals.tile_sums_at = parts[0].len() as u32;
        let words = parts.iter().map(|part| part.len() as u64).sum();
        let bytes = parts.into_iter().map(|part| Cow::Borrowed(bytemuck::cast_slice(part)));
        buffers.put_array("sums", "the map's importance table", words, bytes)
    }
}

/// Uploads lights inside the scene.
pub(super) fn put_lights(
    buffers: &mut Buffers,
    globals: &mut Globals,
    lights: &LocalLights,
) -> Result<()> {
    put_array(buffers, "lights", "the list of lights", &layout::light_words(lights, globals))?;
    put_array(buffers, "light_nodes", "the tree of lights", &layout::light_nodes(lights))
}

/// Makes an array of values that take whole texels or parts of one.
pub(super) fn put_array<T: bytemuck::Pod>(
    buffers: &mut Buffers,
    name: &'static str,
    what: &str,
    values: &[T],
) -> Result<()> {
    let bytes: &[u8] = bytemuck::cast_slice(values);
    let texel_bytes = shader::ARRAYS.iter().find(|kind| kind.name == name);
    let texels = bytes.len() as u64 / texel_bytes.map_or(4, |kind| kind.texel_bytes());
    buffers.put_array(name, what, texels, std::iter::once(Cow::Borrowed(bytes)))
}
