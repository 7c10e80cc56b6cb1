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

#[cfg(test)]
mod tests {
    use wgpu::TextureFormat;

    use super::*;
    use crate::develop::DevelopSettings;
    use crate::develop::tests::developer;
    use crate::image::{Image, Rgb8};
    use crate::tone::{ToneCurve, WhiteBalance};

    /// A black frame of 24 x 20 pixels with a shape drawn at 1.25 pixels a point.
    fn frame(gpu: &Gpu, format: TextureFormat, source: &Source, viewport: Rect) -> Rgb8 {
        let target = gpu.device.create_texture(&wgpu::TextureDescriptor {
            label: None,
            size: wgpu::Extent3d { width: 24, height: 20, depth_or_array_layers: 1 },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format,
            usage: wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::COPY_SRC,
            view_formats: &[],
        });
        let mut commands = gpu.device.create_command_encoder(&Default::default());
        let pass = commands.begin_render_pass(&wgpu::RenderPassDescriptor {
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view: &target.create_view(&Default::default()),
                depth_slice: None,
                resolve_target: None,
                ops: wgpu::Operations::default(),
            })],
            ..wgpu::RenderPassDescriptor::default()
        });
        let info = PaintCallbackInfo {
            viewport,
            clip_rect: Rect::EVERYTHING,
            pixels_per_point: 1.25,
            screen_size_px: [24, 20],
        };
        source.paint(info, &mut pass.forget_lifetime(), &CallbackResources::default());
        gpu.submit([commands.finish()]);
        gpu.read_texture(&target).expect("read")
    }

    #[test]
    fn a_picture_is_drawn_pixel_for_pixel_however_frames_are_encoded() {
        let Some(developer) = developer() else { return };
        let gpu = developer.gpu();
        let pixels = (0..16 * 8).map(|i| [i as f32 / 127.0, (i % 16) as f32 / 15.0, 0.3]).collect();
        let picture = developer.upload_image(&Image { width: 16, height: 8, pixels });
        let settings = DevelopSettings {
            white_balance: WhiteBalance::default(),
            exposure_ev: 0.0,
            curve: ToneCurve::None,
            opacity: [0.0; 2],
        };
        let display = developer.display_texture([16, 8]);
        developer.develop(&picture, None, &settings, &display);
        let levels = developer.read(&display).expect("read");
        for format in [TextureFormat::Rgba8Unorm, TextureFormat::Rgba8UnormSrgb] {
            let source = Blit::new(gpu, format).source(gpu, &display);
            let corner = Pos2::new(5.0, 7.0) / 1.25;
            let drawn = Rect::from_min_size(corner, egui::Vec2::new(16.0, 8.0) / 1.25);
            let frame = frame(gpu, format, &source, drawn);
            for (at, level) in (0..).zip(&frame.pixels) {
                let (x, y) = (at % 24 - 5, at / 24 - 7);
                let is_inside = (0..16).contains(&x) && (0..8).contains(&y);
                let there = is_inside.then(|| levels.pixels[(16 * y + x) as usize]);
                let there = there.unwrap_or_default();
                let is_it = level.iter().zip(there).all(|(a, b)| a.abs_diff(b) <= 1);
                assert!(is_it, "{format:?} at {x}, {y}: {level:?} and not {there:?}");
            }
        }
        let wide = Rect::from_min_size(Pos2::ZERO, egui::Vec2::new(1e6, 8.0));
        let source = Blit::new(gpu, TextureFormat::Rgba8Unorm).source(gpu, &display);
        let frame = frame(gpu, TextureFormat::Rgba8Unorm, &source, wide);
        assert!(frame.pixels.iter().all(|level| *level == [0; 3]), "refused, and no error");
    }
}
