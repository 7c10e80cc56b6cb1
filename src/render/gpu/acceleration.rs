//! The scene's triangles and instances in a tree of the driver's own, for the device's ray queries.

use wgpu::{
    AccelerationStructureFlags, AccelerationStructureGeometryFlags,
    AccelerationStructureUpdateMode, BlasBuildEntry, BlasGeometries, BlasGeometrySizeDescriptors,
    BlasTriangleGeometry, BlasTriangleGeometrySizeDescriptor, BufferUsages,
};

use super::buffer::buffer;
use super::buffers::PIECE_BYTES;
use super::device::Gpu;
use super::layout::MaterialFlags as Flags;
use crate::bvh::InstanceWords;
use crate::error::{Error, Result};
use crate::path::World;
use crate::scene::Scene;

/// A tree on the device.
pub(super) struct Acceleration {
    pub(super) tlas: wgpu::Tlas,
    /// The scene's triangles in the order in which queries count them: those in the world, then those of
    /// each mesh, each time first those that end every ray.
    pub(super) triangles: Vec<u32>,
    /// How many in the world end every ray; the others' materials are asked.
    pub(super) opaque: u32,
    /// The instances, with what tells of their triangles in place of the root and the extent.
    pub(super) instances: Vec<InstanceWords>,
}

/// Triangles of a lower tree: where they begin in the list, how many there are and how many of them end
/// every ray.
struct Lower {
    first: u32,
    count: u32,
    opaque: u32,
}

const BYTES_OF_POSITION: u64 = 12;

/// Most that a number in an instance may be, one more than which it is.
const MAX_INSTANCES: usize = (1 << 24) - 2;

impl Acceleration {
    /// Builds the tree; `flags_of` are those of a triangle's material.
    ///
    /// # Errors
    /// If the device takes fewer triangles or instances, or has no room.
    pub(super) fn build(gpu: &Gpu, world: &World, flags_of: impl Fn(u32) -> u32) -> Result<Self> {
        let scene = &world.scene;
        let name = &gpu.facts().name;
        let meshes = scene.instances.meshes();
        let asked =
            (Flags::ALPHA_MASK | Flags::BACKED | Flags::CLEAR_SOLID | Flags::PARTIAL).bits();
        let is_opaque = |triangle: &u32| flags_of(*triangle) & asked == 0;
        let mut triangles = Vec::with_capacity(scene.triangles.len());
        let mut lower = Vec::with_capacity(1 + meshes.len());
        for mesh in std::iter::once(scene.own_triangles()).chain(meshes.iter().cloned()) {
            let (first, count) = (triangles.len() as u32, mesh.len() as u32);
            let (opaque, asked): (Vec<u32>, Vec<u32>) = mesh.partition(is_opaque);
            lower.push(Lower { first, count, opaque: opaque.len() as u32 });
            triangles.extend(opaque);
            triangles.extend(asked);
        }
        let most = gpu.limits.max_blas_primitive_count;
        if let Some(Lower { count, .. }) = lower.iter().find(|lower| lower.count > most) {
            return Err(Error::new(format!("{count} triangles: {name}'s ray queries take {most}")));
        }
        let count = scene.instances.len();
        let most = MAX_INSTANCES.min(gpu.limits.max_tlas_instance_count as usize - 1);
        if count > most {
            return Err(Error::new(format!("{count} instances: {name}'s ray queries take {most}")));
        }
        let of_mesh = |mesh: u32| &lower[mesh as usize + 1];
        let mut instances = world.bvh.instance_words(|mesh| of_mesh(mesh).first);
        for (words, instance) in instances.iter_mut().zip(scene.instances.iter()) {
            words[7][3] = of_mesh(instance.mesh).opaque;
        }
        let tlas = build(gpu, scene, &triangles, &lower)?;
        Ok(Self { tlas, triangles, opaque: lower[0].opaque, instances })
    }
}

fn build(gpu: &Gpu, scene: &Scene, triangles: &[u32], lower: &[Lower]) -> Result<wgpu::Tlas> {
    let corners = triangles.iter().map(|triangle| scene.triangles[*triangle as usize]);
    let indices: Vec<[u32; 3]> = corners.collect();
    let vertex_buffer = input(gpu, "positions", bytemuck::cast_slice(&scene.positions))?;
    let index_buffer = input(gpu, "triangles", bytemuck::cast_slice(&indices))?;
    let flags = AccelerationStructureFlags::PREFER_FAST_TRACE;
    let update_mode = AccelerationStructureUpdateMode::Build;
    let parts = lower.iter().map(|&Lower { first, count, opaque }| {
        let asked = AccelerationStructureGeometryFlags::NO_DUPLICATE_ANY_HIT_INVOCATION;
        [
            (first, opaque, AccelerationStructureGeometryFlags::OPAQUE),
            (first + opaque, count - opaque, asked),
        ]
    });
    let parts: Vec<_> = parts.collect();
    let size = |(_, count, flags)| BlasTriangleGeometrySizeDescriptor {
        vertex_format: wgpu::VertexFormat::Float32x3,
        vertex_count: scene.positions.len() as u32,
        index_format: Some(wgpu::IndexFormat::Uint32),
        index_count: Some(3 * count),
        flags,
    };
    let sizes: Vec<_> = parts.iter().map(|parts| parts.map(size)).collect();
    let (trees, mut tlas) = gpu.make(|device| {
        let (label, max_instances) = (Some("scene"), 1 + scene.instances.len() as u32);
        let lower = wgpu::CreateBlasDescriptor { label, flags, update_mode };
        let upper = wgpu::CreateTlasDescriptor { label, max_instances, flags, update_mode };
        let trees = sizes.iter().map(|sizes| {
            let descriptors = sizes.to_vec();
            device.create_blas(&lower, BlasGeometrySizeDescriptors::Triangles { descriptors })
        });
        (trees.collect::<Vec<_>>(), device.create_tlas(&upper))
    })?;
    const IDENTITY: [f32; 12] = [1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0];
    tlas[0] = Some(wgpu::TlasInstance::new(&trees[0], IDENTITY, 0, 0xff));
    for (number, instance) in (1..).zip(scene.instances.iter()) {
        let map = instance.placing.affine();
        let row = |axis| map.matrix3.row(axis).extend(map.translation[axis]).to_array();
        let rows = [row(0), row(1), row(2)].as_flattened().try_into().unwrap_or(IDENTITY);
        let tree = &trees[instance.mesh as usize + 1];
        tlas[number as usize] = Some(wgpu::TlasInstance::new(tree, rows, number, 0xff));
    }
    let entries = trees.iter().zip(&parts).zip(&sizes).map(|((blas, parts), sizes)| {
        let geometry = parts.iter().zip(sizes).map(|((first, ..), size)| BlasTriangleGeometry {
            size,
            vertex_buffer: &vertex_buffer,
            first_vertex: 0,
            vertex_stride: BYTES_OF_POSITION,
            index_buffer: Some(&index_buffer),
            first_index: Some(3 * first),
            transform_buffer: None,
            transform_buffer_offset: None,
        });
        BlasBuildEntry { blas, geometry: BlasGeometries::TriangleGeometries(geometry.collect()) }
    });
    let entries: Vec<_> = entries.collect();
    // What trees are built in is taken where they are.
    gpu.make(|device| {
        let mut commands = device.create_command_encoder(&Default::default());
        commands.build_acceleration_structures(&entries, [&tlas]);
        gpu.submit([commands.finish()]);
    })?;
    Ok(tlas)
}

/// A buffer that trees are built from.
fn input(gpu: &Gpu, name: &str, contents: &[u8]) -> Result<wgpu::Buffer> {
    let size = contents.len().max(12) as u64;
    if size > gpu.limits.max_buffer_size {
        return Err(Error::new(format!(
            "the scene's {name} take {} MiB: {} allows {} MiB for them",
            size >> 20,
            gpu.facts().name,
            gpu.limits.max_buffer_size >> 20
        )));
    }
    let usage = BufferUsages::BLAS_INPUT | BufferUsages::COPY_DST;
    let buffer = gpu.make(|device| buffer(device, Some(name), size, usage))?;
    for (offset, piece) in (0..).step_by(PIECE_BYTES).zip(contents.chunks(PIECE_BYTES)) {
        gpu.queue.write_buffer(&buffer, offset, piece);
        gpu.finish_copies()?;
    }
    Ok(buffer)
}
