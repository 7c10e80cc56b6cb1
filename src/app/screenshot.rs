//! The window's content drawn into a texture: no display is needed, and the same request gives the
//! same picture on the same machine.

use std::sync::Arc;
use std::sync::mpsc::{Receiver, channel};
use std::time::{Duration, Instant};

use egui_wgpu::{Renderer, RendererOptions, ScreenDescriptor};
use wgpu::{Extent3d, TextureFormat, TextureUsages};

use super::interface::Interface;
use super::{App, Start};
use crate::error::{Error, Result};
use crate::image::Rgb8;

/// Frames drawn after everything is settled: layout and tooltips need a few.
const SETTLING_FRAMES: u32 = 4;
/// Seconds between two drawn frames, as far as the interface can tell.
const FRAME_SECONDS: f64 = 0.5;

/// What a screenshot shows.
pub struct Shot {
    /// The application's start; [`Start::is_repeatable`] is set.
    pub start: Start,
    /// Size in pixels.
    pub size: (u32, u32),
    /// Longest wait for the samples.
    pub patience: Duration,
}

/// Draws one window, in one state or several.
pub struct Studio {
    app: App,
    context: egui::Context,
    canvas: Canvas,
    news: Receiver<()>,
    deadline: Instant,
    patience: Duration,
    time: f64,
}

impl Studio {
    /// Starts the application without a display.
    ///
    /// # Errors
    /// If there is no graphics device; software Vulkan suffices.
    pub fn open(shot: Shot) -> Result<Self> {
        let canvas = Canvas::new(Device::open()?, shot.size);
        let context = egui::Context::default();
        let (sender, news) = channel();
        let wake = Arc::new(move || {
            // The screenshot may have been taken meanwhile.
            let _ = sender.send(());
        });
        let start = Start { is_repeatable: true, ..shot.start };
        let app = App::new(start, &context, wake)?;
        let deadline = Instant::now() + shot.patience;
        Ok(Self { app, context, canvas, news, deadline, patience: shot.patience, time: 0.0 })
    }

    /// Opens and chooses what `interface` says; the picture is not rendered again.
    pub fn arrange(&mut self, interface: Interface) {
        let viewport_pixels = self.app.interface.viewport_pixels;
        self.app.interface = Interface { viewport_pixels, ..interface };
    }

    /// Measures the truth at the pinned place.
    pub fn measure_truth(&mut self) -> Result<()> {
        self.settle()?;
        self.app.execute(super::commands::Command::MeasureTruth, &self.context);
        Ok(())
    }

    /// Renders until the stop rule is met, draws, reads back.
    ///
    /// # Errors
    /// If a file cannot be read, or the samples take too long.
    pub fn take(&mut self) -> Result<Rgb8> {
        self.settle()?;
        for _ in 0..SETTLING_FRAMES {
            self.frame();
        }
        // Opening a panel may have changed the viewport.
        self.settle()?;
        self.canvas.read()
    }

    fn frame(&mut self) {
        self.canvas.draw(&self.context, &mut self.app, self.time);
        self.time += FRAME_SECONDS;
    }

    fn settle(&mut self) -> Result<()> {
        self.frame();
        self.frame();
        while !self.app.is_settled() {
            if let Some(failure) = self.app.failure() {
                return Err(Error::new(failure));
            }
            let left = self.deadline.saturating_duration_since(Instant::now());
            if left.is_zero() {
                return Err(Error::new(format!(
                    "the picture was not done after {:.0} s; ask for fewer samples or pixels",
                    self.patience.as_secs_f64()
                )));
            }
            // Woken for news; looking now and then anyway does no harm.
            let _ = self.news.recv_timeout(left.min(Duration::from_millis(200)));
            while self.news.try_recv().is_ok() {}
            self.frame();
        }
        Ok(())
    }
}

/// A graphics device without a display.
struct Device {
    device: wgpu::Device,
    queue: wgpu::Queue,
}

impl Device {
    fn open() -> Result<Self> {
        let none = |e: &dyn std::fmt::Display| {
            Error::new(format!("there is no graphics device to draw the window with: {e}"))
        };
        let instance = wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle());
        let adapter =
            pollster::block_on(instance.request_adapter(&wgpu::RequestAdapterOptions::default()))
                .map_err(|e| none(&e))?;
        let (device, queue) = pollster::block_on(adapter.request_device(&wgpu::DeviceDescriptor {
            label: Some("screenshot"),
            required_limits: wgpu::Limits {
                max_texture_dimension_2d: adapter.limits().max_texture_dimension_2d,
                ..wgpu::Limits::default().using_resolution(adapter.limits())
            },
            ..wgpu::DeviceDescriptor::default()
        }))
        .map_err(|e| none(&e))?;
        Ok(Self { device, queue })
    }
}

/// The texture that stands for the window.
struct Canvas {
    device: Device,
    renderer: Renderer,
    target: wgpu::Texture,
}

impl Canvas {
    fn new(device: Device, (width, height): (u32, u32)) -> Self {
        let format = TextureFormat::Rgba8Unorm;
        let target = device.device.create_texture(&wgpu::TextureDescriptor {
            label: Some("window"),
            size: Extent3d { width, height, depth_or_array_layers: 1 },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format,
            usage: TextureUsages::RENDER_ATTACHMENT | TextureUsages::COPY_SRC,
            view_formats: &[],
        });
        let options = RendererOptions { dithering: false, ..RendererOptions::default() };
        let renderer = Renderer::new(&device.device, format, options);
        Self { device, renderer, target }
    }

    /// One frame of the application.
    fn draw(&mut self, context: &egui::Context, app: &mut App, time: f64) {
        let (width, height) = (self.target.width(), self.target.height());
        let size = egui::Vec2::new(width as f32, height as f32);
        let input = egui::RawInput {
            screen_rect: Some(egui::Rect::from_min_size(egui::Pos2::ZERO, size)),
            max_texture_side: Some(self.device.device.limits().max_texture_dimension_2d as usize),
            time: Some(time),
            focused: true,
            ..egui::RawInput::default()
        };
        let mut output = context.run_ui(input, |ui| app.show(ui));
        let primitives = context.tessellate(output.shapes, output.pixels_per_point);
        let Device { device, queue } = &self.device;
        for (id, deltas) in output.textures_delta.set.drain() {
            for delta in deltas {
                self.renderer.update_texture(device, queue, id, &delta);
            }
        }
        let screen = ScreenDescriptor { size_in_pixels: [width, height], pixels_per_point: 1.0 };
        let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        let mut commands =
            self.renderer.update_buffers(device, queue, &mut encoder, &primitives, &screen);
        let view = self.target.create_view(&wgpu::TextureViewDescriptor::default());
        {
            let pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
                label: Some("window"),
                color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                    view: &view,
                    depth_slice: None,
                    resolve_target: None,
                    ops: wgpu::Operations {
                        load: wgpu::LoadOp::Clear(wgpu::Color::BLACK),
                        store: wgpu::StoreOp::Store,
                    },
                })],
                ..wgpu::RenderPassDescriptor::default()
            });
            self.renderer.render(&mut pass.forget_lifetime(), &primitives, &screen);
        }
        commands.push(encoder.finish());
        queue.submit(commands);
        for id in &output.textures_delta.free {
            self.renderer.free_texture(id);
        }
        output.textures_delta.clear();
    }

    /// What was drawn last.
    fn read(&self) -> Result<Rgb8> {
        let lost = |e: &dyn std::fmt::Display| {
            Error::new(format!("the drawn window cannot be read back: {e}"))
        };
        let Device { device, queue } = &self.device;
        let (width, height) = (self.target.width(), self.target.height());
        let bytes_per_row = (4 * width).next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT);
        let buffer = device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("read back"),
            size: u64::from(bytes_per_row) * u64::from(height),
            usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
            mapped_at_creation: false,
        });
        let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        encoder.copy_texture_to_buffer(
            self.target.as_image_copy(),
            wgpu::TexelCopyBufferInfo {
                buffer: &buffer,
                layout: wgpu::TexelCopyBufferLayout {
                    offset: 0,
                    bytes_per_row: Some(bytes_per_row),
                    rows_per_image: None,
                },
            },
            self.target.size(),
        );
        queue.submit([encoder.finish()]);
        let (sender, receiver) = channel();
        buffer.slice(..).map_async(wgpu::MapMode::Read, move |result| {
            // The receiver waits below.
            let _ = sender.send(result);
        });
        device.poll(wgpu::PollType::wait_indefinitely()).map_err(|e| lost(&e))?;
        receiver.recv().map_err(|e| lost(&e))?.map_err(|e| lost(&e))?;
        let mapped = buffer.slice(..).get_mapped_range().map_err(|e| lost(&e))?;
        let pixels = mapped
            .chunks_exact(bytes_per_row as usize)
            .flat_map(|row| row[..4 * width as usize].chunks_exact(4).map(|p| [p[0], p[1], p[2]]))
            .collect();
        Ok(Rgb8 { width, height, pixels })
    }
}
