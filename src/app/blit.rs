//! Developed pictures in egui's frame, drawn by a shader that does nothing else: in egui's own, which has more
//! to choose from and blends, software spends most of a frame.

use std::sync::OnceLock;

use egui::{PaintCallbackInfo, Pos2, Rect, Shape};
use egui_wgpu::{Callback, CallbackResources, CallbackTrait, ScreenDescriptor};

use crate::develop::DisplayTexture;
use crate::render::gpu::{Gpu, buffer};

/// What draws pictures on one device into one format.
pub(super) struct Blit {
    pipeline: wgpu::RenderPipeline,
    /// Between pixels, and the nearest one.
    samplers: [wgpu::Sampler; 2],
}

impl Blit {
    /// Compiles it for frames of a format, encoded as sRGB or written as they are.
    pub(super) fn new(gpu: &Gpu, target: wgpu::TextureFormat) -> Self {
        let source = wgpu::include_wgsl!("../../shaders/blit.wgsl");
        let module = gpu.device.create_shader_module(source);
        let pipeline = gpu.device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
            label: Some("blit"),
            layout: None,
            vertex: wgpu::VertexState {
                module: &module,
                entry_point: Some("corner"),
                compilation_options: wgpu::PipelineCompilationOptions::default(),
                buffers: &[Some(wgpu::VertexBufferLayout {
                    array_stride: size_of::<[f32; 4]>() as u64,
                    step_mode: wgpu::VertexStepMode::Vertex,
                    attributes: &wgpu::vertex_attr_array![0 => Float32x4],
                })],
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
        let samplers = [wgpu::FilterMode::Linear, wgpu::FilterMode::Nearest].map(|filter| {
            gpu.device.create_sampler(&wgpu::SamplerDescriptor {
                label: Some("blit"),
                mag_filter: filter,
                min_filter: wgpu::FilterMode::Linear,
                ..wgpu::SamplerDescriptor::default()
            })
        });
        Self { pipeline, samplers }
    }

    /// A picture that can be drawn.
    pub(super) fn source(&self, gpu: &Gpu, display: &DisplayTexture) -> Source {
        let layout = self.pipeline.get_bind_group_layout(0);
        let pictures = self.samplers.each_ref().map(|sampler| {
            let view = wgpu::BindingResource::TextureView(&display.view);
            let entries = [(0, view), (1, wgpu::BindingResource::Sampler(sampler))]
                .map(|(binding, resource)| wgpu::BindGroupEntry { binding, resource });
            gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
                label: Some("blit"),
                layout: &layout,
                entries: &entries,
            })
        });
        Source { pipeline: self.pipeline.clone(), pictures }
    }
}

/// A picture that can be drawn; clones share it.
#[derive(Clone)]
pub(super) struct Source {
    pipeline: wgpu::RenderPipeline,
    pictures: [wgpu::BindGroup; 2],
}

impl Source {
    /// The whole picture in a rectangle, in points, of which the painter's clip is seen; magnified, with its pixels as
    /// squares if it `has_squares`.
    pub(super) fn shape(&self, rect: Rect, has_squares: bool) -> Shape {
        // egui draws what meets the clip; where in it is not its concern.
        Callback::new_paint_callback(rect, self.drawn(rect, has_squares)).into()
    }

    fn drawn(&self, rect: Rect, has_squares: bool) -> Drawn {
        let picture = self.pictures[usize::from(has_squares)].clone();
        Drawn { pipeline: self.pipeline.clone(), picture, rect, corners: OnceLock::new() }
    }
}

/// A picture in one frame.
struct Drawn {
    pipeline: wgpu::RenderPipeline,
    picture: wgpu::BindGroup,
    /// In points.
    rect: Rect,
    corners: OnceLock<wgpu::Buffer>,
}

impl CallbackTrait for Drawn {
    fn prepare(
        &self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        screen: &ScreenDescriptor,
        _: &mut wgpu::CommandEncoder,
        _: &mut CallbackResources,
    ) -> Vec<wgpu::CommandBuffer> {
        let size = screen.size_in_pixels.map(|pixels| pixels.max(1) as f32);
        let at = |corner: Pos2| {
            let [x, y] = [corner.x, corner.y].map(|at| at * screen.pixels_per_point);
            [2.0 * x / size[0] - 1.0, 1.0 - 2.0 * y / size[1]]
        };
        let ([left, top], [right, bottom]) = (at(self.rect.min), at(self.rect.max));
        let corners = [
            [left, top, 0.0, 0.0],
            [right, top, 1.0, 0.0],
            [left, bottom, 0.0, 1.0],
            [right, bottom, 1.0, 1.0_f32],
        ];
        let vertices = self.corners.get_or_init(|| {
            let usage = wgpu::BufferUsages::VERTEX | wgpu::BufferUsages::COPY_DST;
            buffer(device, Some("blit"), size_of_val(&corners) as u64, usage)
        });
        queue.write_buffer(vertices, 0, bytemuck::cast_slice(&corners));
        Vec::new()
    }

    fn paint(
        &self,
        info: PaintCallbackInfo,
        pass: &mut wgpu::RenderPass<'static>,
        _: &CallbackResources,
    ) {
        let Some(corners) = self.corners.get() else { return };
        let [width, height] = info.screen_size_px.map(|pixels| pixels as f32);
        pass.set_viewport(0.0, 0.0, width, height, 0.0, 1.0);
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, &self.picture, &[]);
        pass.set_vertex_buffer(0, corners.slice(..));
        pass.draw(0..4, 0..1);
    }
}

#[cfg(test)]
mod tests {
    use wgpu::TextureFormat;

    use super::*;
    use crate::develop::tests::developer;
    use crate::develop::{DevelopSettings, LinearPicture};
    use crate::image::{Image, Rgb8};
    use crate::render::gpu::texture;
    use crate::tone::{ToneCurve, WhiteBalance};

    /// A black frame of 24 x 20 pixels with a shape drawn at 1.25 pixels a point.
    fn frame(
        gpu: &Gpu,
        format: TextureFormat,
        source: &Source,
        (rect, has_squares): (Rect, bool),
    ) -> Rgb8 {
        let usage = wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::COPY_SRC;
        let target = texture(&gpu.device, None, [24, 20], format, usage);
        let mut commands = gpu.device.create_command_encoder(&Default::default());
        let drawn = source.drawn(rect, has_squares);
        let screen = ScreenDescriptor { size_in_pixels: [24, 20], pixels_per_point: 1.25 };
        let mut resources = CallbackResources::default();
        drawn.prepare(&gpu.device, &gpu.queue, &screen, &mut commands, &mut resources);
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
            viewport: rect,
            clip_rect: Rect::EVERYTHING,
            pixels_per_point: 1.25,
            screen_size_px: [24, 20],
        };
        drawn.paint(info, &mut pass.forget_lifetime(), &CallbackResources::default());
        gpu.submit([commands.finish()]);
        gpu.read_texture(&target).expect("read")
    }

    #[test]
    fn a_picture_is_drawn_pixel_for_pixel_however_frames_are_encoded() {
        let Some(developer) = developer() else { return };
        let gpu = &developer.gpu;
        let pixels = (0..16 * 8).map(|i| [i as f32 / 127.0, (i % 16) as f32 / 15.0, 0.3]).collect();
        let picture = LinearPicture::of_image(gpu, &Image { width: 16, height: 8, pixels });
        let settings = DevelopSettings {
            white_balance: WhiteBalance::default(),
            exposure_ev: 0.0,
            tone: ToneCurve::None.into(),
            opacity: [0.0; 2],
        };
        let display = DisplayTexture::new(gpu, [16, 8]);
        developer.develop(&picture, None, &settings, &display);
        let levels = developer.read(&display).expect("read");
        for format in [TextureFormat::Rgba8Unorm, TextureFormat::Rgba8UnormSrgb] {
            let source = Blit::new(gpu, format).source(gpu, &display);
            let corner = Pos2::new(5.0, 7.0) / 1.25;
            let drawn = Rect::from_min_size(corner, egui::Vec2::new(16.0, 8.0) / 1.25);
            let frame = frame(gpu, format, &source, (drawn, false));
            for (at, level) in (0..).zip(&frame.pixels) {
                let (x, y) = (at % 24 - 5, at / 24 - 7);
                let is_inside = (0..16).contains(&x) && (0..8).contains(&y);
                let there = is_inside.then(|| levels.pixels[(16 * y + x) as usize]);
                let there = there.unwrap_or_default();
                let is_it = level.iter().zip(there).all(|(a, b)| a.abs_diff(b) <= 1);
                assert!(is_it, "{format:?} at {x}, {y}: {level:?} and not {there:?}");
            }
        }
        // Far beyond the frame, a pixel of it is a square.
        let source = Blit::new(gpu, TextureFormat::Rgba8Unorm).source(gpu, &display);
        let corner = Pos2::new(-400.0 * 8.0, -400.0 * 4.0) / 1.25;
        let large = Rect::from_min_size(corner, egui::Vec2::new(400.0 * 16.0, 400.0 * 8.0) / 1.25);
        let frame = frame(gpu, TextureFormat::Rgba8Unorm, &source, (large, true));
        let middle = levels.pixels[16 * 4 + 8];
        assert!(frame.pixels.iter().all(|level| *level == middle), "{middle:?}");
    }
}
