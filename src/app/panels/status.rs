//! The line below: what is going on, in numbers.

use std::time::Duration;

use egui::{Align, Color32, Layout, Margin, Panel, RichText, Ui};

use super::scope::Scope;
use crate::app::commands::Command;
use crate::app::overlays::{Overlay, value_text};
use crate::app::theme;
use crate::app::worker::{Activity, Snapshot};
use crate::render::gpu::AdapterFacts;

/// What a picture is good for: word, colour, hint, and the largest relative error of blocks without noise, and of pixels
/// with it. (Blocks of 1 and 2.5 % are FLIP of 0.05 and 0.09.)
const GRADES: [(&str, Color32, &str, [f32; 2]); 3] = [
    ("Final", theme::DONE, "More samples change nothing that is seen", [0.01, 0.03]),
    (
        "Preview",
        theme::TEXT,
        "Light and colours are right; soft shadows may still change",
        [0.025, 0.1],
    ),
    ("Draft", theme::SECOND, "Light and shadows may still change", [f32::INFINITY; 2]),
];

/// Seconds after which the step and the time of loading are shown.
const MIN_LOADING_SECONDS: f64 = 1.0;

/// Draws the line.
pub(in crate::app) fn show(ui: &mut Ui, scope: &mut Scope<'_>) {
    let frame = egui::Frame::new().inner_margin(Margin::symmetric(12, 5));
    Panel::bottom("status").frame(frame).show(ui, |ui| {
        ui.horizontal(|ui| {
            ui.spacing_mut().item_spacing.x = 18.0;
            // What is at the right comes first, and what then has no room ends there.
            ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
                if let Some(snapshot) = &scope.rendering.snapshot {
                    let pointed = scope.interface.pointed.filter(|_| !scope.is_repeatable);
                    let pointed = pointed.zip(scope.display.shown.as_ref());
                    // Where there is room for one, what is pointed at comes first.
                    if pointed.is_none() || !theme::is_narrow(ui) {
                        device(ui, snapshot, scope);
                    }
                    if let Some((place, shown)) = pointed {
                        pixel(ui, &shown.order.snapshot, place, scope.interface.overlay);
                    }
                }
                ui.with_layout(Layout::left_to_right(Align::Center), |ui| {
                    ui.shrink_clip_rect(ui.max_rect());
                    phase(ui, scope);
                    if let Some(snapshot) = &scope.rendering.snapshot {
                        figures(ui, snapshot, scope);
                    }
                });
            });
        });
    });
}

fn phase(ui: &mut Ui, scope: &mut Scope<'_>) {
    if let Some(loading) = scope.assets.loader.busy_with().next() {
        let name = theme::file_name(loading.name);
        let text = match loading.seconds < MIN_LOADING_SECONDS || scope.is_repeatable {
            true => format!("Loading {name}…"),
            false => format!("Loading {name}: {}, {:.0} s", loading.step, loading.seconds),
        };
        ui.label(RichText::new(text).color(theme::ACCENT)).on_hover_text(loading.name);
        if ui.small_button("Cancel").on_hover_text("What is shown stays").clicked() {
            scope.commands.push(Command::StopLoading);
        }
        ui.ctx().request_repaint_after(Duration::from_secs(1));
        return;
    }
    if scope.rendering.worker.is_preparing() {
        let hint = "Uploading the scene and compiling kernels takes some seconds; the CPU renders meanwhile";
        ui.label(RichText::new("Preparing the GPU…").color(theme::ACCENT)).on_hover_text(hint);
    }
    let Some(snapshot) = &scope.rendering.snapshot else {
        ui.label(RichText::new("Starting").color(theme::ACCENT));
        return;
    };
    match snapshot.activity {
        Activity::Moving => {
            let hint =
                "A coarse picture while the view or light changes, over what was seen before";
            word(ui, "Moving", theme::SECOND, hint);
        }
        Activity::Learning(share) => {
            let paths = [snapshot.now.learning_paths, snapshot.request.view.learning_paths];
            let [traced, all] = paths.map(theme::count);
            let text = format!("Learning {traced} / {all} paths");
            let text = RichText::new(text).size(11.5).color(theme::TEXT);
            let bar = egui::ProgressBar::new(share).desired_width(190.0).desired_height(16.0);
            let bar = bar.fill(Color32::from_rgb(122, 86, 34)).text(text);
            let hint = "Learning which tiles of the map each part of the picture can see";
            ui.add(bar).on_hover_text(hint);
        }
        Activity::Rendering => word(ui, "Rendering", theme::ACCENT, "Adding samples"),
        Activity::Paused => word(ui, "Paused", theme::SECOND, "Space resumes"),
        Activity::Done => word(ui, "Done", theme::DONE, "A limit under STOP AT was reached"),
    }
}

fn word(ui: &mut Ui, text: &str, color: Color32, hint: &str) {
    ui.label(RichText::new(text).color(color).strong()).on_hover_text(hint);
}

fn figures(ui: &mut Ui, snapshot: &Snapshot, scope: &Scope<'_>) {
    let session = &snapshot.main;
    if matches!(snapshot.activity, Activity::Rendering | Activity::Paused | Activity::Done) {
        let (error, column, of) = match scope.document.look.denoise {
            true => (snapshot.errors.map(|errors| errors.left()), 0, "areas of 16 pixels"),
            false => (Some(session.noise as f32), 1, "a pixel"),
        };
        let error = error.unwrap_or(f32::INFINITY);
        let percent = match error.is_finite() {
            true => format!("about {:.1} % relative error in {of}", 100.0 * error),
            false => "how far it is off is not known yet".to_owned(),
        };
        let grade = GRADES.iter().find(|(.., most)| error <= most[column]);
        if let Some((text, color, hint, _)) = grade {
            word(ui, text, *color, &format!("{hint}: {percent}"));
        }
    }
    let hint = "Mean samples per pixel, of cached light too";
    number(ui, &theme::samples(snapshot.mean_samples()), "samples", hint);
    if !scope.is_repeatable {
        let hint = "Time spent on learning and rendering, cached light included";
        number(ui, &theme::clock(snapshot.seconds()), "", hint);
        let rate = snapshot.now.rays as f64 / snapshot.now.render_seconds.max(1e-9);
        if !theme::is_small(ui) {
            let hint = "Rays per second of rendering, shadow rays included";
            number(ui, &theme::figure(rate), "rays/s", hint);
        }
    }
    let invalid = session.invalid_samples;
    if invalid > 0 {
        let text = RichText::new(format!("{} not finite", theme::count(invalid)));
        ui.label(text.color(theme::ALERT))
            .on_hover_text("Samples that were NaN or infinite; they count as black");
    }
}

/// What the film holds under the pointer.
fn pixel(ui: &mut Ui, snapshot: &Snapshot, place: glam::Vec2, overlay: Option<Overlay>) {
    let film = &snapshot.main.film;
    let index = |share: f32, count: u32| ((share * count as f32) as u32).min(count.max(1) - 1);
    let (x, y) = (index(place.x, film.width), index(place.y, film.height));
    let index = (y * film.width + x) as usize;
    let Some(pixel) = film.pixels().get(index) else { return };
    let [r, g, b] = pixel.mean().map(theme::figure);
    let samples = match pixel.samples() {
        1 => "1 sample".to_owned(),
        all => format!("{all} samples"),
    };
    let told = overlay.and_then(|overlay| value_text(overlay, film, index));
    let told = told.map(|told| format!("  ·  {told}")).unwrap_or_default();
    let text = format!("{x}, {y}:  {r}  {g}  {b}  ·  {samples}{told}");
    ui.label(theme::quiet(text)).on_hover_text("Linear radiance of the pixel, before denoising");
}

fn number(ui: &mut Ui, value: &str, unit: &str, hint: &str) {
    ui.horizontal(|ui| {
        ui.spacing_mut().item_spacing.x = 4.0;
        ui.label(RichText::new(value).color(theme::TEXT));
        theme::note(ui, unit);
    })
    .response
    .on_hover_text(hint);
}

fn device(ui: &mut Ui, snapshot: &Snapshot, scope: &Scope<'_>) {
    let threads = scope.rendering.worker.threads();
    let (film, view) = (&snapshot.main.film, &snapshot.request.view);
    let (width, height) = match snapshot.activity {
        Activity::Moving => (film.width, film.height),
        _ => (view.width, view.height),
    };
    let (name, hint) = match &snapshot.main.gpu {
        Some(gpu) => {
            let AdapterFacts { name, backend, driver, .. } = &gpu.adapter;
            let memory = theme::bytes(gpu.device_bytes as usize);
            let hint = format!("{name}, {backend}, driver {driver}; {memory} on the device");
            // Its name has no room where there is little.
            let short = format!("GPU, {}", gpu.adapter.short_name());
            (if theme::is_small(ui) { "GPU".to_owned() } else { short }, hint)
        }
        None => {
            let word = if threads == 1 { "thread" } else { "threads" };
            let hint = "Size of the picture in pixels, and the rendering device".to_owned();
            (format!("CPU, {threads} {word}"), hint)
        }
    };
    let zoomed = scope.interface.magnification(scope.document.size);
    let zoomed = zoomed.map_or_else(String::new, |times| format!(" at {:.0} %", 100.0 * times));
    ui.label(theme::quiet(format!("{width} x {height}{zoomed}  ·  {name}"))).on_hover_text(hint);
}
