//! The application on a display: winit gives events, egui-wgpu draws.

use std::num::NonZeroU32;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use egui::ViewportId;
use egui_wgpu::winit::Painter;
use egui_wgpu::{SurfaceErrorAction, WgpuConfiguration, WgpuSetup, WgpuSetupExisting};
use winit::application::ApplicationHandler;
use winit::dpi::{LogicalSize, PhysicalSize};
use winit::event::WindowEvent;
use winit::event_loop::{
    ActiveEventLoop, ControlFlow, EventLoop, EventLoopProxy, OwnedDisplayHandle,
};
#[cfg(target_os = "linux")]
use winit::platform::wayland::WindowAttributesExtWayland as _;
#[cfg(windows)]
use winit::platform::windows::IconExtWindows;
use winit::window::{Fullscreen, Window, WindowId};

use super::application::{App, Start};
use super::loader::Loader;
use super::screen::{Screen, TextureCopies, renderer_options};
use super::settings_file::Settings;
use super::threads::{Wake, Wakes};
use super::{input_order, theme};
use crate::error::{Error, Result};
use crate::render::gpu::Gpu;
use crate::system::{exit_now, hang_up, on_request_to_end, return_large_arrays};

/// What other threads ask the event loop for.
#[derive(Debug, Clone, Copy)]
enum Call {
    /// A frame, at once or later.
    Repaint(Instant),
    /// A frame with what is new, when it can be afforded.
    Draw,
    /// To hand on what the worker has.
    Relay,
}

/// Where software draws, it rests so many times as long as a frame took before it draws again what is
/// new: frames take the renderer's time.
const REST: u32 = 19;
/// But it rests no longer than this, and less in the first seconds of a view, of which there are few pictures.
const MAX_REST: Duration = Duration::from_millis(900);
/// So much of each second that a view has been worked on.
const REST_OF_A_SECOND: f64 = 0.1;
/// And never less, for new widgets ask for frame after frame, unless a hand has been at the window: then as long
/// as a frame takes.
const MIN_REST: Duration = Duration::from_millis(150);
/// For how long after that.
const TOUCH: Duration = Duration::from_millis(500);
/// While a picture is made ready, figures go on in steps of this.
const STATUS_GAP: Duration = Duration::from_millis(950);

/// Losses of a device sooner after one another than this belong together.
const LOSS_GAP: Duration = Duration::from_secs(10);
/// After so many of them, another device is not worth trying.
const MAX_LOSSES: u32 = 5;

/// Opens the window and stays until it is closed; then settings are written to `settings_path`.
/// Returns what closed it, if it was not a person.
///
/// # Errors
/// If there is no display, or none that can be drawn on: nothing has been shown then.
pub(crate) fn run(
    start: Start,
    notices: Vec<String>,
    settings_path: Option<PathBuf>,
) -> Result<Option<Error>> {
    return_large_arrays();
    let no_display = |e: &dyn std::fmt::Display| {
        let text = e.to_string();
        // The toolkit puts the place in its own source before the cause.
        let cause = text.rsplit_once(": ").map_or(&*text, |(_, cause)| cause);
        Error::new(format!("no window can be opened: {cause}"))
    };
    let event_loop = EventLoop::<Call>::with_user_event().build().map_err(|e| no_display(&e))?;
    let mut runner = Runner {
        proxy: event_loop.create_proxy(),
        start: Some(start),
        notices,
        settings_path,
        running: None,
        outcome: Ok(None),
        repaint_at: None,
        asked: Arc::default(),
    };
    if let Err(error) = event_loop.run_app(&mut runner) {
        if runner.running.is_none() {
            return Err(no_display(&error));
        }
        // What it was shown on has gone.
        runner.end();
        return Ok(Some(Error::new(format!("the window was closed: {error}"))));
    }
    runner.outcome
}

struct Runner {
    proxy: EventLoopProxy<Call>,
    start: Option<Start>,
    notices: Vec<String>,
    settings_path: Option<PathBuf>,
    running: Option<Running>,
    /// What closed the window, if it was not a person; or why none was opened.
    outcome: Result<Option<Error>>,
    repaint_at: Option<Instant>,
    /// Whether a signal asked for the end.
    asked: Arc<AtomicBool>,
}

/// Lets Ctrl-C, requests to end and closed terminals close the window as a person would; a second one leaves at once.
fn close_on_signals(asked: &Arc<AtomicBool>, proxy: EventLoopProxy<Call>) {
    let asked = Arc::clone(asked);
    // Where signals cannot be caught they end the process.
    let _ = on_request_to_end(move |signal| {
        // The shell of a terminal that is closed may say so twice.
        if asked.swap(true, Ordering::Relaxed) && hang_up() != Some(signal) {
            exit_now(128 + signal);
        }
        let _ = proxy.send_event(Call::Repaint(Instant::now()));
    });
}

/// What there is once a window is open.
struct Running {
    /// It goes before the display, which its clipboard is of.
    input: egui_winit::State,
    canvas: Canvas,
    /// There is none only while one is exchanged for another.
    painter: Option<Painter>,
    /// When a device was lost last, and how many were in a row.
    lost: Option<(Instant, u32)>,
    /// When the last frame was drawn.
    drawn_at: Instant,
    /// For how long no other is to be, if it need not.
    rest: Duration,
    /// When a person did something last.
    touched_at: Option<Instant>,
    app: App,
    title: String,
    /// Points of the window when it had a size of its own last: neither minimised nor as large as the screen.
    usual_size: Option<[f32; 2]>,
}

/// The window, and what it takes to draw on it by any device.
struct Canvas {
    window: Arc<Window>,
    context: egui::Context,
    display: OwnedDisplayHandle,
    adapter: Option<String>,
    copies: TextureCopies,
    /// Whether the surface is to be configured before it is painted on.
    is_stale: Arc<AtomicBool>,
}

/// Draws on the window by the best device that can, which is opened with all that rendering needs.
fn paint_on(canvas: &Canvas) -> Result<(Painter, Screen)> {
    let Canvas { window, context, display, adapter, copies, is_stale } = canvas;
    let gpu = Gpu::open_for_window(adapter.as_deref(), display, window)?;
    let usual = WgpuConfiguration::default();
    let (answer, is_stale) = (usual.on_surface_status.clone(), Arc::clone(is_stale));
    let config = WgpuConfiguration {
        wgpu_setup: WgpuSetup::Existing(WgpuSetupExisting {
            instance: gpu.instance.clone(),
            adapter: gpu.adapter.clone(),
            device: gpu.device.clone(),
            queue: gpu.queue.clone(),
        }),
        on_surface_status: Arc::new(move |status| {
            let action = answer(status);
            is_stale.fetch_or(!matches!(action, SurfaceErrorAction::SkipFrame), Ordering::Relaxed);
            match action {
                // The next frame does it, when no other thread submits.
                SurfaceErrorAction::Reconfigure => SurfaceErrorAction::SkipFrame,
                other => other,
            }
        }),
        ..usual
    };
    let options = renderer_options();
    let mut painter = pollster::block_on(Painter::new(context.clone(), config, false, options));
    pollster::block_on(painter.set_window(ViewportId::ROOT, Some(Arc::clone(window))))
        .map_err(|e| Error::new(e.to_string()))?;
    let state = painter.render_state().ok_or_else(|| Error::new("nothing can be drawn"))?;
    copies.upload(&gpu, &mut state.renderer.write());
    let screen = Screen::new(&gpu, state.target_format)?;
    Ok((painter, screen))
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
        // A desktop knows what its bar and titles leave of the screen.
        let fills_screen = width >= largest[0] || height >= largest[1];
        let (width, height) = (width.min(largest[0]), height.min(largest[1]));
        let attributes = Window::default_attributes()
            .with_title("lightgrid")
            .with_maximized(fills_screen)
            .with_min_inner_size(LogicalSize::new(720.0, 480.0))
            .with_inner_size(LogicalSize::new(width.max(720.0), height.max(480.0)));
        // By that a desktop finds its icon.
        #[cfg(target_os = "linux")]
        let attributes = attributes.with_name("lightgrid", "lightgrid");
        // The icon of the program's file, of which packages have one.
        #[cfg(windows)]
        let attributes = attributes
            .with_window_icon(<winit::window::Icon as IconExtWindows>::from_resource(1, None).ok());
        let window = Arc::new(event_loop.create_window(attributes).map_err(|e| cannot(&e))?);
        let wake = |call: Call| -> Wake {
            let proxy = self.proxy.clone();
            Arc::new(move || {
                // The event loop may have ended meanwhile.
                let _ = proxy.send_event(call);
            })
        };
        let wakes = Wakes { draw: wake(Call::Draw), relay: wake(Call::Relay) };
        // Devices take as long to open as files to be read.
        let loader = Loader::start(&start.document, start.of_scene.clone(), wakes.draw.clone());
        let context = egui::Context::default();
        let proxy = self.proxy.clone();
        context.set_request_repaint_callback(move |info| {
            // The event loop may have ended meanwhile.
            let _ = proxy.send_event(Call::Repaint(Instant::now() + info.delay));
        });
        let canvas = Canvas {
            window: Arc::clone(&window),
            context: context.clone(),
            display: event_loop.owned_display_handle(),
            adapter: start.adapter.clone(),
            copies: TextureCopies::default(),
            is_stale: Arc::default(),
        };
        let (painter, screen) = paint_on(&canvas).map_err(|e| cannot(&e))?;
        let input = egui_winit::State::new(
            context.clone(),
            ViewportId::ROOT,
            event_loop,
            Some(window.scale_factor() as f32),
            None,
            Some(screen.gpu().limits.max_texture_dimension_2d as usize),
        );
        let mut app = App::new(start, loader, screen, &context, wakes)?;
        app.desktop.window = Some(window);
        self.notices.drain(..).for_each(|sentence| app.messages.notice(sentence));
        Ok(Running {
            canvas,
            input,
            painter: Some(painter),
            lost: None,
            drawn_at: Instant::now(),
            touched_at: None,
            rest: Duration::ZERO,
            app,
            title: String::new(),
            usual_size: None,
        })
    }

    /// Has a frame drawn at this time, or before.
    fn repaint(&mut self, at: Instant) {
        self.repaint_at = Some(self.repaint_at.map_or(at, |before| before.min(at)));
    }

    fn close(&mut self, event_loop: &ActiveEventLoop) {
        if let Some(running) = &self.running {
            // A GPU that is being made ready cannot be stopped; nobody has to look at that.
            running.canvas.window.set_visible(false);
        }
        self.end();
        event_loop.exit();
    }

    /// Keeps what is to be kept, and waits until all files are written.
    fn end(&mut self) {
        let Some(mut running) = self.running.take() else { return };
        if let Err(error) = running.keep_settings(self.settings_path.as_deref(), true) {
            crate::terminal::notice(error);
        }
        running.app.finish().iter().for_each(crate::terminal::notice);
    }
}

impl Running {
    /// Writes the settings for the next window, on top of what others have written meanwhile.
    ///
    /// # Errors
    /// If the file cannot be written.
    fn keep_settings(&mut self, path: Option<&Path>, is_end: bool) -> Result<()> {
        let Some(path) = path else { return Ok(()) };
        let mut settings = self.app.settings(Settings::read(path).ok(), is_end);
        settings.window_size = self.usual_size.unwrap_or(settings.window_size);
        settings.write(path)
    }

    /// Notes the size for the next window.
    fn note_size(&mut self, size: PhysicalSize<u32>) {
        let is_usual = self.canvas.window.is_minimized() != Some(true)
            && self.canvas.window.fullscreen().is_none();
        let is_usual = is_usual && !self.canvas.window.is_maximized();
        if size.width > 0 && size.height > 0 && is_usual {
            let size = size.to_logical(self.canvas.window.scale_factor());
            self.usual_size = Some([size.width, size.height]);
        }
    }

    /// One frame, on another device if that of the last one was lost.
    ///
    /// # Errors
    /// If there is no other.
    fn draw(&mut self) -> Result<()> {
        let PhysicalSize { width, height } = self.canvas.window.inner_size();
        let size = NonZeroU32::new(width).zip(NonZeroU32::new(height));
        let Some(size) = size.filter(|_| self.canvas.window.is_minimized() != Some(true)) else {
            // There is nothing to draw on; it is asked for again when there is.
            return Ok(());
        };
        let start = Instant::now();
        if let Err(loss) = self.app.display.screen.gpu().check() {
            self.replace_device(&loss)?;
        }
        let mut input = self.input.take_egui_input(&self.canvas.window);
        let later = input_order::first_turn(&mut input.events);
        if !later.is_empty() {
            self.input.egui_input_mut().events = later;
            self.canvas.context.request_repaint();
        }
        let was_modal = self.app.interface.is_modal();
        let mut output = self.canvas.context.run_ui(input, |ui| self.app.show(ui));
        if self.app.interface.is_modal() && !was_modal {
            // Or a tooltip from before lies over the question until the pointer moves.
            self.input.egui_input_mut().events.push(egui::Event::PointerGone);
        }
        self.input.handle_platform_output(&self.canvas.window, output.platform_output);
        let points = output.pixels_per_point;
        let primitives = self.canvas.context.tessellate(output.shapes, points);
        self.canvas.copies.follow(&output.textures_delta);
        let gpu = self.app.display.screen.gpu().clone();
        let is_stale = self.canvas.is_stale.swap(false, Ordering::Relaxed);
        let mut paint = || {
            let Some(painter) = &mut self.painter else { return };
            if is_stale {
                painter.on_window_resized(ViewportId::ROOT, size.0, size.1);
            }
            painter.paint_and_update_textures(
                ViewportId::ROOT,
                points,
                theme::PANEL.to_normalized_gamma_f32(),
                &primitives,
                &mut output.textures_delta,
                Vec::new(),
                &self.canvas.window,
            );
        };
        // egui's renderer panics if the device is lost while it draws.
        let drawn =
            catch_unwind(AssertUnwindSafe(|| if is_stale { gpu.alone(paint) } else { paint() }));
        output.textures_delta.clear();
        if self.canvas.is_stale.load(Ordering::Relaxed) {
            self.canvas.context.request_repaint();
        }
        if self.app.display.screen.gpu().check().is_err() {
            self.canvas.context.request_repaint();
        } else if let Err(panic) = drawn {
            resume_unwind(panic);
        }
        if std::mem::take(&mut self.app.toggles_full_screen) {
            let fills = self.canvas.window.fullscreen().is_some();
            self.canvas.window.set_fullscreen((!fills).then_some(Fullscreen::Borderless(None)));
        }
        let title = format!("{} - lightgrid", self.app.edited.document.scene);
        if title != self.title {
            self.canvas.window.set_title(&title);
            self.title = title;
        }
        self.drawn_at = Instant::now();
        self.rest = Duration::ZERO;
        if self.app.display.screen.gpu().facts().is_software() {
            self.rest = (REST * start.elapsed()).min(MAX_REST);
        }
        Ok(())
    }

    /// When the next frame of what is new can be afforded.
    fn rested_at(&self) -> Instant {
        let snapshot = self.app.rendering.snapshot.as_ref();
        let seconds = snapshot.map_or(0.0, |snapshot| snapshot.seconds());
        let longest = MAX_REST.as_secs_f64().min(REST_OF_A_SECOND * seconds);
        self.least_rested_at().max(self.drawn_at + self.rest.min(Duration::from_secs_f64(longest)))
    }

    /// When the next frame of whatever can be afforded.
    fn least_rested_at(&self) -> Instant {
        let is_touched = self.touched_at.is_some_and(|at| at.elapsed() < TOUCH)
            || self.canvas.context.egui_is_using_pointer();
        self.drawn_at + self.rest.min(if is_touched { self.rest / REST } else { MIN_REST })
    }

    /// Opens a device anew; the application and what it shows stay as they are.
    fn replace_device(&mut self, loss: &Error) -> Result<()> {
        let closes = |why: &dyn std::fmt::Display| {
            Error::new(format!("{loss}, and the window cannot be drawn otherwise: {why}"))
        };
        let before = self.lost.filter(|(at, _)| at.elapsed() < LOSS_GAP).map_or(0, |(_, n)| n);
        if before == MAX_LOSSES {
            return Err(closes(&"it is lost again and again"));
        }
        self.lost = Some((Instant::now(), before + 1));
        // Two surfaces of one window exclude each other.
        self.painter = None;
        let (painter, screen) = paint_on(&self.canvas).map_err(|e| closes(&e))?;
        self.painter = Some(painter);
        self.app.move_to(screen, loss);
        Ok(())
    }
}

impl ApplicationHandler<Call> for Runner {
    fn resumed(&mut self, event_loop: &ActiveEventLoop) {
        let Some(start) = self.start.take() else { return };
        match self.open(event_loop, start) {
            Ok(running) => {
                close_on_signals(&self.asked, self.proxy.clone());
                running.canvas.window.request_redraw();
                self.running = Some(running);
            }
            Err(error) => {
                self.outcome = Err(error);
                event_loop.exit();
            }
        }
    }

    fn user_event(&mut self, event_loop: &ActiveEventLoop, call: Call) {
        if self.asked.load(Ordering::Relaxed) {
            return self.close(event_loop);
        }
        let Some(running) = &mut self.running else { return };
        let at = match call {
            Call::Repaint(at) => at.max(running.least_rested_at()),
            Call::Draw => running.rested_at(),
            Call::Relay if running.app.relay(&running.canvas.context) => running.rested_at(),
            Call::Relay => running.rested_at().max(running.drawn_at + STATUS_GAP),
        };
        self.repaint(at);
    }

    fn window_event(&mut self, event_loop: &ActiveEventLoop, _: WindowId, event: WindowEvent) {
        let Some(running) = &mut self.running else { return };
        match &event {
            WindowEvent::CloseRequested if running.app.may_close() => {
                self.close(event_loop);
                return;
            }
            WindowEvent::CloseRequested => running.canvas.window.request_redraw(),
            WindowEvent::RedrawRequested => {
                let drawn = running.draw();
                if std::mem::take(&mut running.app.library.has_news)
                    && let Err(error) = running.keep_settings(self.settings_path.as_deref(), false)
                {
                    running.app.messages.notice(error.to_string());
                }
                if drawn.is_err() || running.app.is_closing {
                    self.outcome = Ok(drawn.err());
                    self.close(event_loop);
                }
                return;
            }
            WindowEvent::Resized(size) => {
                running.note_size(*size);
                let size = NonZeroU32::new(size.width).zip(NonZeroU32::new(size.height));
                if let Some((width, height)) = size
                    && let Some(painter) = &mut running.painter
                {
                    let gpu = running.app.display.screen.gpu();
                    gpu.alone(|| painter.on_window_resized(ViewportId::ROOT, width, height));
                }
            }
            WindowEvent::Focused(false) => running.app.desktop.lose_focus(),
            WindowEvent::KeyboardInput { .. }
            | WindowEvent::MouseInput { .. }
            | WindowEvent::MouseWheel { .. }
            | WindowEvent::Touch(_) => running.touched_at = Some(Instant::now()),
            _ => {}
        }
        if running.input.on_window_event(&running.canvas.window, &event).repaint {
            let at = running.least_rested_at();
            self.repaint(at);
        }
    }

    fn about_to_wait(&mut self, event_loop: &ActiveEventLoop) {
        let Some(running) = &self.running else { return };
        let soon = Instant::now() + Duration::from_millis(1);
        if self.repaint_at.take_if(|at| *at <= soon).is_some() {
            running.canvas.window.request_redraw();
        }
        let flow = self.repaint_at.map_or(ControlFlow::Wait, ControlFlow::WaitUntil);
        event_loop.set_control_flow(flow);
    }
}
