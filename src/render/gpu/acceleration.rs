//! The scene's triangles in a tree of the driver's own, for the device's ray queries.

use wgpu::util::DeviceExt as _;
use wgpu::{
    AccelerationStructureFlags, AccelerationStructureGeometryFlags,
    AccelerationStructureUpdateMode, BlasBuildEntry, BlasGeometries, BlasGeometrySizeDescriptors,
    BlasTriangleGeometry, BlasTriangleGeometrySizeDescriptor, BufferUsages,
};

use super::device::Gpu;
use super::layout::material_flags::{ALPHA_MASK, PARTIAL};
use crate::error::{Error, Result};
use crate::scene::Scene;

/// A tree on the device.
pub(super) struct Acceleration {
    pub(super) tlas: wgpu::Tlas,
    /// The scene's triangles in the order in which queries count them: first those that end every ray.
    pub(super) triangles: Vec<u32>,
    /// How many end every ray; the others' materials are asked.
    pub(super) opaque: u32,
}

const BYTES_OF_POSITION: u64 = 12;

impl Acceleration {
    /// Builds the tree; `flags_of` are those of a triangle's material.
    ///
    /// # Errors
    /// If the device takes fewer triangles, or has no room.
    pub(super) fn build(gpu: &Gpu, scene: &Scene, flags_of: impl Fn(u32) -> u32) -> Result<Self> {
        let most = gpu.limits.max_blas_primitive_count;
        let count = scene.triangles.len() as u32;
        if count > most {
            let name = &gpu.facts().name;
            let sentence = format!("{count} triangles: {name}'s ray queries take {most}");
            return Err(Error::new(sentence));
        }
        let is_opaque = |triangle: &u32| flags_of(*triangle) & (ALPHA_MASK | PARTIAL) == 0;
        let (mut triangles, asked): (Vec<u32>, Vec<u32>) = (0..count).partition(is_opaque);
        let opaque = triangles.len() as u32;
        triangles.extend(asked);
        let tlas = build(gpu, scene, &triangles, opaque);
        gpu.check()?;
        Ok(Self { tlas, triangles, opaque })
    }
}

fn build(gpu: &Gpu, scene: &Scene, triangles: &[u32], opaque: u32) -> wgpu::Tlas {
    let device = &gpu.device;
    let corners = triangles.iter().map(|triangle| scene.triangles[*triangle as usize]);
    let indices: Vec<[u32; 3]> = corners.collect();
    let buffer = |label, contents: &[u8]| {
        device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
            label: Some(label),
            contents: if contents.is_empty() { &[0; 12] } else { contents },
            usage: BufferUsages::BLAS_INPUT,
        })
    };
    let vertex_buffer = buffer("positions", bytemuck::cast_slice(&scene.positions));
    let index_buffer = buffer("triangles", bytemuck::cast_slice(&indices));
    let all = triangles.len() as u32;
    let parts = [
        (0, opaque, AccelerationStructureGeometryFlags::OPAQUE),
        (opaque, all - opaque, AccelerationStructureGeometryFlags::NO_DUPLICATE_ANY_HIT_INVOCATION),
    ];
    let sizes = parts.map(|(_, count, flags)| BlasTriangleGeometrySizeDescriptor {
        vertex_format: wgpu::VertexFormat::Float32x3,
        vertex_count: scene.positions.len() as u32,
        index_format: Some(wgpu::IndexFormat::Uint32),
        index_count: Some(3 * count),
        flags,
    });
    let flags = AccelerationStructureFlags::PREFER_FAST_TRACE;
    let update_mode = AccelerationStructureUpdateMode::Build;
    let blas = device.create_blas(
        &wgpu::CreateBlasDescriptor { label: Some("scene"), flags, update_mode },
        BlasGeometrySizeDescriptors::Triangles { descriptors: sizes.to_vec() },
    );
    let mut tlas = device.create_tlas(&wgpu::CreateTlasDescriptor {
        label: Some("scene"),
        max_instances: 1,
        flags,
        update_mode,
    });
    const IDENTITY: [f32; 12] = [1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0];
    tlas[0] = Some(wgpu::TlasInstance::new(&blas, IDENTITY, 0, 0xff));
    let geometry = parts.iter().zip(&sizes).map(|((first, ..), size)| BlasTriangleGeometry {
        size,
        vertex_buffer: &vertex_buffer,
        first_vertex: 0,
        vertex_stride: BYTES_OF_POSITION,
        index_buffer: Some(&index_buffer),
        first_index: Some(3 * first),
        transform_buffer: None,
        transform_buffer_offset: None,
    });
    let entry = BlasBuildEntry {
        blas: &blas,
        geometry: BlasGeometries::TriangleGeometries(geometry.collect()),
    };
    let mut commands = device.create_command_encoder(&Default::default());
    commands.build_acceleration_structures([&entry], [&tlas]);
    gpu.queue.submit([commands.finish()]);
    tlas
}
