//! Developed pictures in egui's frame, drawn by a shader that does nothing else: in egui's own, which has more
//! to choose from and blends, software spends most of a frame.

use egui::{PaintCallbackInfo, Pos2, Rect, Shape};
use egui_wgpu::{Callback, CallbackResources, CallbackTrait};

use crate::develop::DisplayTexture;
use crate::render::gpu::Gpu;

/// What draws pictures on one device into one format.
pub(super) struct Blit {
    pipeline: wgpu::RenderPipeline,
    sampler: wgpu::Sampler,
    /// Most pixels of a viewport's side.
    most: f32,
}

impl Blit {
    /// Compiles it for frames of a format, encoded as sRGB or written as they are.
    pub(super) fn new(gpu: &Gpu, target: wgpu::TextureFormat) -> Self {
        let module = gpu.device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: Some("blit"),
            source: wgpu::ShaderSource::Wgsl(include_str!("../../shaders/blit.wgsl").into()),
        });
        let pipeline = gpu.device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
            label: Some("blit"),
            layout: None,
            vertex: wgpu::VertexState {
                module: &module,
                entry_point: Some("corner"),
                compilation_options: wgpu::PipelineCompilationOptions::default(),
                buffers: &[],
            },
            primitive: wgpu::PrimitiveState {
                topology: wgpu::PrimitiveTopology::TriangleStrip,
                ..wgpu::PrimitiveState::default()
            },
            depth_stencil: None,
            multisample: wgpu::MultisampleState::default(),
            fragment: Some(wgpu::FragmentState {
                module: &module,
                entry_point: Some(if target.is_srgb() { "decoded" } else { "levels" }),
                compilation_options: wgpu::PipelineCompilationOptions::default(),
                targets: &[Some(target.into())],
            }),
            multiview_mask: None,
            cache: None,
        });
        let sampler = gpu.device.create_sampler(&wgpu::SamplerDescriptor {
            label: Some("blit"),
            mag_filter: wgpu::FilterMode::Linear,
            min_filter: wgpu::FilterMode::Linear,
            ..wgpu::SamplerDescriptor::default()
        });
        let most = gpu.limits.max_texture_dimension_2d as f32;
        Self { pipeline, sampler, most }
    }

    /// A picture for [`shape`].
    pub(super) fn source(&self, gpu: &Gpu, display: &DisplayTexture) -> Source {
        let picture = gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("blit"),
            layout: &self.pipeline.get_bind_group_layout(0),
            entries: &[
                wgpu::BindGroupEntry {
                    binding: 0,
                    resource: wgpu::BindingResource::TextureView(display.view()),
                },
                wgpu::BindGroupEntry {
                    binding: 1,
                    resource: wgpu::BindingResource::Sampler(&self.sampler),
                },
            ],
        });
        Source { pipeline: self.pipeline.clone(), picture, most: self.most }
    }
}

/// A picture that can be drawn; clones share it.
#[derive(Clone)]
pub(super) struct Source {
    pipeline: wgpu::RenderPipeline,
    picture: wgpu::BindGroup,
    most: f32,
}

impl Source {
    /// The whole picture in a rectangle, in points; nothing of one that is larger than any frame.
    pub(super) fn shape(&self, rect: Rect) -> Shape {
        Callback::new_paint_callback(rect, self.clone()).into()
    }
}

impl CallbackTrait for Source {
    fn paint(
        &self,
        info: PaintCallbackInfo,
        pass: &mut wgpu::RenderPass<'static>,
        _: &CallbackResources,
    ) {
        // As egui sets it, it would be of whole pixels, and a picture that grows would jump. OpenGL takes what is
        // next below: what is meant to be whole is.
        let whole = |at: f32| if (at - at.round()).abs() < 0.01 { at.round() } else { at };
        let Rect { min, max } = info.viewport * info.pixels_per_point;
        let [min, max] = [min, max].map(|at| Pos2::new(whole(at.x), whole(at.y)));
        if (max - min).max_elem() > self.most {
            return;
        }
        pass.set_viewport(min.x, min.y, max.x - min.x, max.y - min.y, 0.0, 1.0);
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, &self.picture, &[]);
        pass.draw(0..4, 0..1);
    }
}
