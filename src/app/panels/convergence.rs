//! Estimated error against time, both logarithmic.

use egui::{Color32, Ui, Vec2b};
use egui_plot::{GridMark, Legend, Line, LineStyle, Plot, PlotPoints};

use crate::app::commands::Command;
use crate::app::convergence::{Convergence, Run};
use crate::app::theme;
use crate::app::worker::{Point, Reference};

/// Draws the plot of all runs; `by_samples_only` leaves the clock out.
pub(in crate::app) fn show(
    ui: &mut Ui,
    convergence: &mut Convergence,
    by_samples_only: bool,
    reference: Option<&Reference>,
    commands: &mut Vec<Command>,
) {
    let by_samples = by_samples_only || convergence.by_samples;
    ui.horizontal(|ui| {
        if !by_samples_only {
            ui.selectable_value(&mut convergence.by_samples, false, "Time");
            ui.selectable_value(&mut convergence.by_samples, true, "Samples");
        }
        ui.label(theme::quiet("Estimated relative RMS error; earlier runs are dim"));
        let hint = "A picture of this view without noise: the true error is drawn too";
        if ui.button("Reference…").on_hover_text(hint).clicked() {
            commands.push(Command::ChooseReference);
        }
        if let Some(reference) = reference
            && ui.button("Forget it").on_hover_text(&reference.name).clicked()
        {
            commands.push(Command::ForgetReference);
        }
    });
    let formatter = |mark: GridMark, _: &std::ops::RangeInclusive<f64>| {
        if mark.value.fract().abs() < 1e-6 {
            theme::figure(10_f64.powf(mark.value))
        } else {
            String::new()
        }
    };
    let decades = |input: egui_plot::GridInput| {
        let (low, high) = input.bounds;
        let mut marks = Vec::new();
        for decade in (low.floor() as i32)..=(high.ceil() as i32) {
            for step in 1..10 {
                let value = f64::from(decade) + f64::from(step).log10();
                let step_size = if step == 1 { 1.0 } else { 0.1 };
                marks.push(GridMark { value, step_size });
            }
        }
        marks
    };
    let lines = lines(convergence, by_samples);
    if lines.is_empty() {
        ui.label(theme::quiet("The first two samples of every pixel give the first point."));
        return;
    }
    Plot::new("convergence")
        .legend(Legend::default())
        .height((ui.available_height() - 4.0).max(90.0))
        .allow_scroll(false)
        .show_grid(Vec2b::TRUE)
        .x_axis_label(if by_samples { "samples per pixel" } else { "seconds" })
        .y_axis_label("noise")
        .x_grid_spacer(decades)
        .y_grid_spacer(decades)
        .x_axis_formatter(formatter)
        .y_axis_formatter(formatter)
        .show_crosshair(false)
        .show(ui, |plot| {
            for line in lines {
                plot.line(line);
            }
        });
}

fn lines(convergence: &Convergence, by_samples: bool) -> Vec<Line<'static>> {
    let count = convergence.runs().len();
    let mut lines: Vec<Line<'static>> = Vec::new();
    let mut add = |run: &Run, number: usize, color: Color32, width: f32| {
        if run.points.len() > 1 {
            let name = format!("{} · run {number}", run.name);
            let estimate = run.points.iter().map(|point| place(point, point.noise, by_samples));
            let estimate: PlotPoints<'static> = estimate.collect();
            lines.push(Line::new(name.clone(), estimate).color(color).width(width));
            let measured = run.points.iter().filter(|point| point.error.is_some_and(|e| e > 0.0));
            let measured: Vec<[f64; 2]> = measured
                .map(|point| place(point, point.error.unwrap_or(point.noise), by_samples))
                .collect();
            if !measured.is_empty() {
                let line = Line::new(format!("{name}, true"), measured).color(color).width(width);
                lines.push(line.style(LineStyle::dashed_loose()));
            }
        }
    };
    for (i, run) in convergence.runs().iter().enumerate() {
        let is_current = i + 1 == count;
        let color = if is_current { theme::ACCENT } else { faded(i) };
        add(run, i + 1, color, if is_current { 2.0 } else { 1.2 });
    }
    if let Some(run) = convergence.plain() {
        add(run, count, theme::SECOND, 2.0);
    }
    lines
}

fn place(point: &Point, error: f64, by_samples: bool) -> [f64; 2] {
    let x = if by_samples { point.samples } else { point.seconds };
    [x.max(1e-6).log10(), error.log10()]
}

fn faded(index: usize) -> Color32 {
    let [r, g, b] = crate::app::overlays::palette::hsv(0.55 + 0.11 * index as f32, 0.25, 0.55);
    Color32::from_rgb(r, g, b)
}
