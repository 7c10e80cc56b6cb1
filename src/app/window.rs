//! The application on a display: winit gives events, egui-wgpu draws.

use std::num::NonZeroU32;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::{Duration, Instant};

use egui::ViewportId;
use egui_wgpu::winit::Painter;
use egui_wgpu::{RendererOptions, WgpuConfiguration, WgpuSetup};
use winit::application::ApplicationHandler;
use winit::dpi::LogicalSize;
use winit::event::WindowEvent;
use winit::event_loop::{ActiveEventLoop, ControlFlow, EventLoop, EventLoopProxy};
use winit::window::{Window, WindowId};

use super::{App, Start, theme};
use crate::error::{Error, Result};

/// Asks for a frame, at once or later.
#[derive(Debug, Clone, Copy)]
struct Repaint {
    at: Instant,
}

/// Opens the window and stays until it is closed; then settings are written to `settings_path`.
///
/// # Errors
/// If there is no display, or none that can be drawn on: nothing has been shown then.
pub fn run(start: Start, notices: Vec<String>, settings_path: Option<PathBuf>) -> Result<()> {
    let no_display = |e: &dyn std::fmt::Display| {
        let text = e.to_string();
        // The toolkit puts the place in its own source before the cause.
        let cause = text.rsplit_once(": ").map_or(&*text, |(_, cause)| cause);
        Error::new(format!("no window can be opened: {cause}"))
    };
    let event_loop = EventLoop::<Repaint>::with_user_event().build().map_err(|e| no_display(&e))?;
    let mut runner = Runner {
        proxy: event_loop.create_proxy(),
        start: Some(start),
        notices,
        settings_path,
        running: None,
        failure: None,
        repaint_at: None,
    };
    event_loop.run_app(&mut runner).map_err(|e| no_display(&e))?;
    runner.failure.map_or(Ok(()), Err)
}

struct Runner {
    proxy: EventLoopProxy<Repaint>,
    start: Option<Start>,
    notices: Vec<String>,
    settings_path: Option<PathBuf>,
    running: Option<Running>,
    failure: Option<Error>,
    repaint_at: Option<Instant>,
}

/// What there is once a window is open.
struct Running {
    window: Arc<Window>,
    context: egui::Context,
    input: egui_winit::State,
    painter: Painter,
    app: App,
    title: String,
}

impl Runner {
    fn open(&mut self, event_loop: &ActiveEventLoop, start: Start) -> Result<Running> {
        let cannot =
            |e: &dyn std::fmt::Display| Error::new(format!("no window can be opened: {e}"));
        let [width, height] = start.settings.window_size;
        let largest = event_loop.primary_monitor().map_or([width, height], |monitor| {
            let size = monitor.size().to_logical::<f32>(monitor.scale_factor());
            [size.width, size.height]
        });
        let (width, height) = (width.min(largest[0]), height.min(largest[1]));
        let attributes = Window::default_attributes()
            .with_title("lightgrid")
            .with_min_inner_size(LogicalSize::new(720.0, 480.0))
            .with_inner_size(LogicalSize::new(width.max(720.0), height.max(480.0)));
        let window = Arc::new(event_loop.create_window(attributes).map_err(|e| cannot(&e))?);
        let context = egui::Context::default();
        let proxy = self.proxy.clone();
        context.set_request_repaint_callback(move |info| {
            // The event loop may have ended meanwhile.
            let _ = proxy.send_event(Repaint { at: Instant::now() + info.delay });
        });
        let config = WgpuConfiguration {
            wgpu_setup: WgpuSetup::from_display_handle(event_loop.owned_display_handle()),
            ..WgpuConfiguration::default()
        };
        let options = RendererOptions::default();
        let mut painter = pollster::block_on(Painter::new(context.clone(), config, false, options));
        pollster::block_on(painter.set_window(ViewportId::ROOT, Some(Arc::clone(&window))))
            .map_err(|e| cannot(&e))?;
        let input = egui_winit::State::new(
            context.clone(),
            ViewportId::ROOT,
            event_loop,
            Some(window.scale_factor() as f32),
            None,
            painter.max_texture_side(),
        );
        let waking = context.clone();
        let mut app = App::new(start, &context, Arc::new(move || waking.request_repaint()))?;
        self.notices.drain(..).for_each(|sentence| app.say(sentence));
        Ok(Running { window, context, input, painter, app, title: String::new() })
    }

    fn close(&mut self, event_loop: &ActiveEventLoop) {
        if let (Some(running), Some(path)) = (&self.running, &self.settings_path) {
            let mut settings = running.app.settings();
            let size = running.window.inner_size().to_logical(running.window.scale_factor());
            settings.window_size = [size.width, size.height];
            if let Err(error) = settings.write(path) {
                eprintln!("notice: {error}");
            }
        }
        self.running = None;
        event_loop.exit();
    }
}

impl Running {
    fn draw(&mut self) {
        let input = self.input.take_egui_input(&self.window);
        let mut output = self.context.run_ui(input, |ui| self.app.show(ui));
        self.input.handle_platform_output(&self.window, output.platform_output);
        let points = output.pixels_per_point;
        let primitives = self.context.tessellate(output.shapes, points);
        self.painter.paint_and_update_textures(
            ViewportId::ROOT,
            points,
            theme::BACKGROUND.to_normalized_gamma_f32(),
            &primitives,
            &mut output.textures_delta,
            Vec::new(),
            &self.window,
        );
        let title = self.app.title();
        if title != self.title {
            self.window.set_title(&title);
            self.title = title;
        }
    }
}

impl ApplicationHandler<Repaint> for Runner {
    fn resumed(&mut self, event_loop: &ActiveEventLoop) {
        let Some(start) = self.start.take() else { return };
        match self.open(event_loop, start) {
            Ok(running) => {
                running.window.request_redraw();
                self.running = Some(running);
            }
            Err(error) => {
                self.failure = Some(error);
                event_loop.exit();
            }
        }
    }

    fn user_event(&mut self, _: &ActiveEventLoop, repaint: Repaint) {
        let at = self.repaint_at.map_or(repaint.at, |at| at.min(repaint.at));
        self.repaint_at = Some(at);
    }

    fn window_event(&mut self, event_loop: &ActiveEventLoop, _: WindowId, event: WindowEvent) {
        let Some(running) = &mut self.running else { return };
        match &event {
            WindowEvent::CloseRequested => {
                self.close(event_loop);
                return;
            }
            WindowEvent::RedrawRequested => {
                running.draw();
                if running.app.is_closing() {
                    self.close(event_loop);
                }
                return;
            }
            WindowEvent::Resized(size) => {
                if let (Some(width), Some(height)) =
                    (NonZeroU32::new(size.width), NonZeroU32::new(size.height))
                {
                    running.painter.on_window_resized(ViewportId::ROOT, width, height);
                }
            }
            _ => {}
        }
        if running.input.on_window_event(&running.window, &event).repaint {
            running.window.request_redraw();
        }
    }

    fn about_to_wait(&mut self, event_loop: &ActiveEventLoop) {
        let Some(running) = &self.running else { return };
        match self.repaint_at {
            Some(at) if at <= Instant::now() + Duration::from_millis(1) => {
                self.repaint_at = None;
                running.window.request_redraw();
                event_loop.set_control_flow(ControlFlow::Wait);
            }
            Some(at) => event_loop.set_control_flow(ControlFlow::WaitUntil(at)),
            None => event_loop.set_control_flow(ControlFlow::Wait),
        }
    }
}
