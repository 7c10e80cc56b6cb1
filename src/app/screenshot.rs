//! The window's content drawn into a texture: no display is needed, and the same request gives the
//! same picture on the same machine.

use std::sync::Arc;
use std::sync::mpsc::{Receiver, channel};
use std::time::{Duration, Instant};

use egui_wgpu::{Renderer, ScreenDescriptor};
use wgpu::{TextureFormat, TextureUsages};

use super::application::{App, Start};
use super::commands::Command;
use super::interface::Interface;
use super::learning_steps::LearningSteps;
use super::loader::Loader;
use super::screen::{Screen, TextureCopies, renderer_options};
use super::theme;
use super::threads::{Wake, Wakes};
use super::worker::Reference;
use crate::error::{Error, Result};
use crate::image::{Image, Rgb8};
use crate::render::gpu::{DeviceChoice, Gpu, texture};

/// Frames drawn after everything is settled: layout and tooltips need a few.
const SETTLING_FRAMES: u32 = 4;
/// Seconds between two drawn frames, as far as the interface can tell.
const FRAME_SECONDS: f64 = 0.5;

/// Draws one window, in one state or several.
pub struct Studio {
    pub(super) app: App,
    pub(super) context: egui::Context,
    canvas: Canvas,
    news: Receiver<()>,
    deadline: Instant,
    patience: Duration,
    time: f64,
    pixels_per_point: f32,
}

impl Studio {
    /// Starts the application without a display, in a window of this size in pixels; sets [`Start::is_repeatable`].
    /// `patience` is the longest wait for the samples.
    ///
    /// # Errors
    /// If there is no graphics device, for which software Vulkan suffices, or it draws nothing of this size.
    pub fn open(start: Start, size: (u32, u32), patience: Duration) -> Result<Self> {
        let gpu = Gpu::open(start.adapter.as_deref()).map_err(|e| {
            Error::new(format!("there is no graphics device to draw the window with: {e}"))
        })?;
        let ((width, height), most) = (size, gpu.limits.max_texture_dimension_2d);
        if width.max(height) > most {
            return Err(Error::new(format!(
                "a window of {width}x{height} pixels cannot be drawn: {} draws at most {most} a side",
                gpu.facts().name
            )));
        }
        let canvas = Canvas::new(gpu, size, TextureCopies::default());
        let screen = Screen::new(&canvas.gpu, FORMAT)?;
        let context = egui::Context::default();
        let (sender, news) = channel();
        let wake: Wake = Arc::new(move || {
            // The screenshot may have been taken meanwhile.
            let _ = sender.send(());
        });
        let start = Start { is_repeatable: true, ..start };
        let wakes = Wakes { draw: wake.clone(), relay: wake };
        let loader = Loader::start(&start.document, start.of_scene.clone(), wakes.draw.clone());
        let app = App::new(start, loader, screen, &context, wakes)?;
        let (deadline, time, pixels_per_point) = (Instant::now() + patience, 0.0, 1.0);
        Ok(Self { app, context, canvas, news, deadline, patience, time, pixels_per_point })
    }

    /// Draws all but the picture so many times as large, as a screen with small pixels shows it; the window keeps its
    /// pixels.
    #[must_use]
    pub fn at_scale(self, pixels_per_point: f32) -> Self {
        Self { pixels_per_point, ..self }
    }

    /// Pixels of the picture across and down, once there is one.
    pub fn picture_size(&self) -> Option<[u32; 2]> {
        self.app.rendering.snapshot.as_ref().map(|snapshot| snapshot.request.view.whole_size())
    }

    /// Opens and chooses what `interface` says; the picture is not rendered again.
    pub fn arrange(&mut self, interface: Interface) {
        let Interface { viewport_pixels, viewport_of, .. } = self.app.interface;
        self.app.interface = Interface { viewport_pixels, viewport_of, ..interface };
    }

    /// Shows the distributions after the learning pass `step` in place of the present ones; 0 is before all passes.
    ///
    /// # Errors
    /// If a file cannot be read, or there are fewer passes.
    pub fn show_learning_step(&mut self, step: usize) -> Result<()> {
        self.settle()?;
        if self.app.rendering.steps.is_none() {
            self.app.execute(Command::ToggleLearningSteps, &self.context);
        }
        self.settle()?;
        let count = self.app.rendering.steps.as_ref().map_or(0, LearningSteps::count);
        if step >= count {
            return Err(Error::new(format!(
                "there is no learning step {step}: it has {count}, counted from 0"
            )));
        }
        self.app.interface.learning_step = Some(step);
        Ok(())
    }

    /// Measures the truth at the pinned place.
    pub fn measure_truth(&mut self) -> Result<()> {
        self.settle()?;
        self.app.execute(Command::MeasureTruth, &self.context);
        Ok(())
    }

    /// Renders a reference of what is shown, and waits for it; its linear radiance.
    ///
    /// # Errors
    /// If a file cannot be read, or the reference is not rendered.
    pub fn render_reference(&mut self) -> Result<Image> {
        Ok(self.wait_for_reference(Command::RenderReference)?.image.clone())
    }

    /// Measures errors against a linear picture without noise of what is shown.
    ///
    /// # Errors
    /// If a file cannot be read, or the picture has another size.
    pub fn open_reference(&mut self, name: &str) -> Result<()> {
        let reference = self.wait_for_reference(Command::OpenReference(name.to_owned()))?;
        let Image { width, height, .. } = reference.image;
        match self.picture_size() {
            Some([w, h]) if (w, h) != (width, height) => Err(Error::at(
                name,
                format!("it has {width} x {height} pixels, the picture in the window {w} x {h}"),
            )),
            _ => Ok(()),
        }
    }

    fn wait_for_reference(&mut self, command: Command) -> Result<Arc<Reference>> {
        self.settle()?;
        self.app.assets.set_reference(None, None);
        self.app.execute(command, &self.context);
        loop {
            self.frame()?;
            if let Some(reference) = &self.app.assets.reference {
                return Ok(Arc::clone(reference));
            }
            if let Some(error) = self.app.messages.first_error() {
                return Err(Error::new(error));
            }
        }
    }

    /// Chooses the first material of this name, as a click on one of its surfaces would.
    ///
    /// # Errors
    /// If the scene cannot be read or has no such material.
    pub fn choose_material(&mut self, name: &str) -> Result<()> {
        self.settle()?;
        let scene = self.app.assets.scene.as_ref();
        let number = scene.and_then(|scene| scene.materials.iter().position(|m| m.name == name));
        let number = number.ok_or_else(|| {
            let cause = scene.map(|scene| scene.world.scene.without_material(name));
            Error::at(&self.app.edited.document.scene, cause.unwrap_or_default())
        })?;
        self.app.interface.choose_material(Some(number as u32));
        Ok(())
    }

    /// Turns the map so that its sun shines on a place of the picture, both coordinates in `[0,1]`.
    ///
    /// # Errors
    /// If a file cannot be read, or the sun cannot be turned there.
    pub fn put_sun(&mut self, place: glam::Vec2) -> Result<()> {
        self.settle()?;
        let notice = self.app.put_sun(place)?;
        notice.into_iter().for_each(|notice| self.app.messages.notice(notice));
        Ok(())
    }

    /// Refuses a tile that the map does not have.
    ///
    /// # Errors
    /// If the map cannot be read or has fewer tiles.
    pub fn check_tile(&mut self, tile: u32) -> Result<()> {
        self.settle()?;
        let count = self.app.assets.map.as_ref().map_or(0, |map| map.environment.tile_count());
        if tile < count {
            return Ok(());
        }
        let cause = format!("there is no tile {tile}: it has {count}, counted from 0");
        Err(Error::at(&self.app.edited.document.map, cause))
    }

    /// Renders until the stop rule is met, draws, reads back.
    ///
    /// # Errors
    /// If a file cannot be read, or the samples take too long.
    pub fn take(&mut self) -> Result<Rgb8> {
        self.settle()?;
        for _ in 0..SETTLING_FRAMES {
            self.frame()?;
        }
        // Opening a panel may have changed the viewport.
        self.settle()?;
        let Canvas { gpu, target, .. } = &self.canvas;
        gpu.read_texture(target)
            .map_err(|e| Error::new(format!("the drawn window cannot be read back: {e}")))
    }

    /// Whether the CPU is to render.
    pub fn is_on_cpu(&self) -> bool {
        self.app.edited.document.light.device == DeviceChoice::Cpu
    }

    /// Loses the device, as a driver reset would; for tests of what happens then.
    pub fn lose_device(&self) {
        self.canvas.gpu.lose();
    }

    /// One frame.
    pub(super) fn frame(&mut self) -> Result<()> {
        let (width, height) = (self.canvas.target.width(), self.canvas.target.height());
        if let Err(loss) = self.canvas.gpu.check() {
            let gpu = Gpu::open(Some(&self.canvas.gpu.facts().name))?;
            let copies = std::mem::take(&mut self.canvas.copies);
            self.canvas = Canvas::new(gpu, (width, height), copies);
            self.app.move_to(Screen::new(&self.canvas.gpu, FORMAT)?, &loss);
        }
        let canvas = &mut self.canvas;
        let size = egui::Vec2::new(width as f32, height as f32) / self.pixels_per_point;
        let native_pixels_per_point = Some(self.pixels_per_point);
        let viewport = egui::ViewportInfo { native_pixels_per_point, ..Default::default() };
        let input = egui::RawInput {
            viewports: std::iter::once((egui::ViewportId::ROOT, viewport)).collect(),
            screen_rect: Some(egui::Rect::from_min_size(egui::Pos2::ZERO, size)),
            max_texture_side: Some(canvas.gpu.limits.max_texture_dimension_2d as usize),
            time: Some(self.time),
            focused: true,
            ..egui::RawInput::default()
        };
        let mut output = self.context.run_ui(input, |ui| self.app.show(ui));
        let pixels_per_point = output.pixels_per_point;
        let primitives = self.context.tessellate(output.shapes, pixels_per_point);
        canvas.copies.follow(&output.textures_delta);
        let Gpu { device, queue, .. } = &canvas.gpu;
        let renderer = &mut canvas.renderer;
        for (id, deltas) in output.textures_delta.set.drain() {
            for delta in deltas {
                renderer.update_texture(device, queue, id, &delta);
            }
        }
        let screen = ScreenDescriptor { size_in_pixels: [width, height], pixels_per_point };
        let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        let mut commands =
            renderer.update_buffers(device, queue, &mut encoder, &primitives, &screen);
        let view = canvas.target.create_view(&wgpu::TextureViewDescriptor::default());
        let [r, g, b, a] = theme::PANEL.to_normalized_gamma_f32().map(f64::from);
        let pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("window"),
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view: &view,
                depth_slice: None,
                resolve_target: None,
                ops: wgpu::Operations {
                    load: wgpu::LoadOp::Clear(wgpu::Color { r, g, b, a }),
                    store: wgpu::StoreOp::Store,
                },
            })],
            ..wgpu::RenderPassDescriptor::default()
        });
        renderer.render(&mut pass.forget_lifetime(), &primitives, &screen);
        commands.push(encoder.finish());
        queue.submit(commands);
        for id in &output.textures_delta.free {
            renderer.free_texture(id);
        }
        output.textures_delta.clear();
        self.time += FRAME_SECONDS;
        Ok(())
    }

    /// Frames until the stop rule is met.
    pub(super) fn settle(&mut self) -> Result<()> {
        self.frame()?;
        self.frame()?;
        loop {
            if let Some(failure) = self.app.messages.first_error() {
                return Err(Error::new(failure));
            }
            if self.app.is_settled() {
                return Ok(());
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
            self.frame()?;
        }
    }
}

/// Of the texture that stands for the window.
const FORMAT: TextureFormat = TextureFormat::Rgba8Unorm;

/// The texture that stands for the window.
struct Canvas {
    gpu: Gpu,
    renderer: Renderer,
    target: wgpu::Texture,
    copies: TextureCopies,
}

impl Canvas {
    fn new(gpu: Gpu, size: (u32, u32), copies: TextureCopies) -> Self {
        let usage = TextureUsages::RENDER_ATTACHMENT | TextureUsages::COPY_SRC;
        let target = texture(&gpu.device, Some("window"), size.into(), FORMAT, usage);
        let mut renderer = Renderer::new(&gpu.device, FORMAT, renderer_options());
        copies.upload(&gpu, &mut renderer);
        Self { gpu, renderer, target, copies }
    }
}
