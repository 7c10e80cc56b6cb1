//! Pictures and videos that are rendered into files beside the window.

use egui::{ProgressBar, Ui};

use super::button::button;
use super::scope::Scope;
use crate::app::commands::Command;
use crate::app::final_render::{Motion, moving_camera};
use crate::app::interface::Purpose;
use crate::app::render_queue::{Job, State};
use crate::app::theme;

/// Draws size, movement and buttons, and how far each file is.
pub(in crate::app) fn show(ui: &mut Ui, scope: &mut Scope<'_>) {
    let scene = scope.scene().map(|scene| &scene.world.scene);
    let viewpoint = scope.document.viewpoint.as_ref();
    let moving = scene.zip(viewpoint).and_then(|(scene, from)| moving_camera(scene, from));
    let Scope { interface, renders, commands, .. } = scope;
    let render = &mut interface.final_render;
    theme::section(ui, "RENDER INTO A FILE");
    theme::row(ui, "Pixels", "Resolution of the file", |ui| {
        let [width, height] = &mut render.size;
        ui.add(theme::number(width, 1..=16384).speed(4));
        ui.label("x");
        ui.add(theme::number(height, 1..=16384).speed(4));
    });
    theme::row(ui, "Camera", "What it does: one picture, or frames of a video", |ui| {
        theme::choice(ui, "motion").selected_text(name(render.motion)).show_ui(ui, |ui| {
            for motion in [Motion::Still, Motion::Orbit, Motion::LookAround, Motion::Path] {
                if motion != Motion::Path || moving.is_some() {
                    ui.selectable_value(&mut render.motion, motion, name(motion));
                }
            }
        });
    });
    if moving.is_none() && render.motion == Motion::Path {
        render.motion = Motion::Still;
    }
    if matches!(render.motion, Motion::Orbit | Motion::LookAround) {
        let frames = theme::number(&mut render.frames, 2..=100_000);
        theme::set(ui, "Frames", "Of a full turn; 24 are a second of video", frames);
    }
    ui.horizontal(|ui| {
        let hint = "As it is here, to the end under STOP AT, while you go on (Ctrl R)";
        button(ui, ("Render…", hint), commands, Command::Ask(Purpose::Render));
        let hint = "Copies the command that renders the same without a window";
        button(ui, ("Copy command", hint), commands, Command::CopyCommandLine);
    });
    for (index, job) in renders.jobs.iter().enumerate() {
        ui.horizontal(|ui| {
            let hint = if row(ui, job) {
                "Ends it now and writes what it has"
            } else {
                "Takes it from the list"
            };
            if ui.small_button("×").on_hover_text(hint).clicked() {
                commands.push(Command::EndRender(index));
            }
        });
    }
}

fn name(motion: Motion) -> &'static str {
    match motion {
        Motion::Still => "Still",
        Motion::Orbit => "Turns around the middle",
        Motion::LookAround => "Looks around",
        Motion::Path => "Moves as in the file",
    }
}

/// Draws how far a file is; whether it is being rendered.
fn row(ui: &mut Ui, job: &Job) -> bool {
    let path = job.path.display().to_string();
    let (share, text, hint) = match job.state() {
        State::Waiting => (0.0, "waits".to_owned(), path.clone()),
        State::Running { since, share } => {
            let seconds = since.elapsed().as_secs_f32() * (1.0 - share) / share.max(1e-3);
            let left = format!("{path}\nabout {} left", theme::clock(seconds.into()));
            (share, format!("{:.0} %", 100.0 * share), left)
        }
        State::Ended(Ok(())) => (1.0, "done".to_owned(), path.clone()),
        State::Ended(Err(why)) => (0.0, "failed".to_owned(), why),
    };
    let text = format!("{}: {text}", theme::file_name(&path));
    let bar = ProgressBar::new(share).text(text).desired_width(ui.available_width() - 36.0);
    ui.add(bar).on_hover_text(hint);
    matches!(job.state(), State::Running { .. })
}
