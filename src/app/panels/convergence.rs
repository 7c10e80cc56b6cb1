//! Estimated error against time, both logarithmic.

use std::ops::RangeInclusive;

use egui::{Color32, Ui, Vec2b};
use egui_plot::{Corner, GridMark, Legend, Line, LineStyle, Plot, PlotPoints};

use super::button::button;
use super::scope::Scope;
use crate::app::commands::Command;
use crate::app::convergence::{Convergence, Run};
use crate::app::interface::Purpose;
use crate::app::overlays::palette;
use crate::app::render_queue::{Job, State};
use crate::app::theme;
use crate::app::worker::Point;

/// Draws the plot of all runs.
pub(in crate::app) fn show(ui: &mut Ui, scope: &mut Scope<'_>) {
    let hides_clock = scope.is_repeatable;
    let Scope { document, assets, rendering, renders, commands, .. } = scope;
    let convergence = &mut rendering.convergence;
    let by_samples = hides_clock || convergence.by_samples;
    ui.horizontal_wrapped(|ui| {
        if !hides_clock {
            ui.selectable_value(&mut convergence.by_samples, false, "Time");
            ui.selectable_value(&mut convergence.by_samples, true, "Samples");
        }
        theme::note(ui, "Earlier runs are dim");
        let hint = "A picture of this view without noise; the true error is plotted, too";
        button(ui, ("Reference…", hint), commands, Command::Ask(Purpose::Reference));
        match renders.jobs.iter().rfind(|job| job.reference_of.is_some()).map(Job::state) {
            Some(State::Running { share, .. }) => {
                theme::note(ui, format!("Reference: {:.0} %", 100.0 * share));
            }
            Some(State::Waiting) => theme::note(ui, "Reference: other files come first"),
            _ => {
                let hint = "Renders this view until hardly any noise is left, beside the window";
                button(ui, ("Render one", hint), commands, Command::RenderReference);
            }
        }
        if let Some((reference, is_of_view)) = assets.reference(document) {
            if ui.button("Remove").on_hover_text(&reference.name).clicked() {
                commands.push(Command::ForgetReference);
            }
            if !is_of_view {
                let hint = "Errors are measured again once scene, light and view match it";
                ui.label(theme::quiet("It shows another view")).on_hover_text(hint);
            }
        }
    });
    let lines = lines(convergence, by_samples);
    if lines.is_empty() {
        return theme::note(ui, "The plot begins at two samples per pixel.");
    }
    Plot::new("convergence")
        // Errors fall: there is room below their beginning.
        .legend(Legend::default().position(Corner::RightTop))
        .height((ui.available_height() - 4.0).max(90.0))
        .allow_scroll(false)
        .show_grid(Vec2b::TRUE)
        .x_axis_label(if by_samples { "samples per pixel" } else { "seconds" })
        .y_axis_label("relative RMS error")
        .x_grid_spacer(|input| grid_lines(input.bounds))
        .y_grid_spacer(|input| grid_lines(input.bounds))
        .x_axis_formatter(|mark, range| tick(mark, range, 1.0))
        .y_axis_formatter(|mark, range| match tick(mark, range, 100.0) {
            text if text.is_empty() => text,
            text => format!("{text} %"),
        })
        .y_axis_min_width(52.0)
        .show_crosshair(false)
        .show(ui, |plot| {
            for line in lines {
                plot.line(line);
            }
        });
}

/// Part of an axis on which numbers are written; beyond it they would stand outside of the plot.
const WRITTEN: RangeInclusive<f64> = 0.0..=0.98;

/// Span in decades below which grid lines are evenly spaced.
const NARROW: f64 = 0.5;

/// Where grid lines are between two powers of ten: at 1, 2, ... 9 of every decade; within half a
/// decade, at round numbers.
fn grid_lines((low, high): (f64, f64)) -> Vec<GridMark> {
    if high - low < NARROW {
        let (low, high) = (10_f64.powf(low), 10_f64.powf(high));
        let power = 10_f64.powf(((high - low) / 3.0).log10().floor());
        let steps = [1.0, 2.0, 5.0].map(|step| step * power);
        let step = steps.into_iter().rev().find(|step| 3.0 * step <= high - low).unwrap_or(power);
        let first = (low / step).ceil();
        let count = ((high - low) / step) as u32;
        let values = (0..=count).map(|i| (first + f64::from(i)) * step);
        return values.map(|v| GridMark { value: v.log10(), step_size: 1.0 }).collect();
    }
    let numbered = numbered(high - low);
    let mark = |decade: i32, step: i32| GridMark {
        value: f64::from(decade) + f64::from(step).log10(),
        // The plot leaves out numbers of steps that are narrow on the screen.
        step_size: if numbered.contains(&step) { 1.0 } else { 0.1 },
    };
    let decades = (low.floor() as i32)..=(high.ceil() as i32);
    decades.flat_map(|decade| (1..10).map(move |step| mark(decade, step))).collect()
}

/// Multiples of a power of ten that have numbers on an axis of `span` decades.
fn numbered(span: f64) -> &'static [i32] {
    match span {
        span if span < 0.8 => &[1, 2, 3, 4, 6, 8],
        span if span < 1.6 => &[1, 2, 5],
        _ => &[1],
    }
}

/// What is written at a grid line: at as many as there is room for.
fn tick(mark: GridMark, range: &RangeInclusive<f64>, factor: f64) -> String {
    let span = range.end() - range.start();
    if !WRITTEN.contains(&((mark.value - range.start()) / span)) {
        return String::new();
    }
    let value = 10_f64.powf(mark.value);
    let leading = value / 10_f64.powf((mark.value + 1e-6).floor());
    if span >= NARROW && !numbered(span).contains(&(leading.round() as i32)) {
        return String::new();
    }
    let text = theme::figure(value * factor);
    let trimmed = text.trim_end_matches('0').trim_end_matches('.');
    if text.contains('.') { trimmed.to_owned() } else { text }
}

fn lines(convergence: &Convergence, by_samples: bool) -> Vec<Line<'static>> {
    let mut lines: Vec<Line<'static>> = Vec::new();
    let place = |point: &Point, error: f64| {
        let x = if by_samples { point.samples } else { point.seconds };
        [x.max(1e-6).log10(), error.log10()]
    };
    let mut add = |run: &Run, color: Color32, width: f32| {
        if run.points.len() > 1 {
            let name = format!("{} · run {}", run.name, run.number);
            let estimate = run.points.iter().map(|point| place(point, point.noise));
            let estimate: PlotPoints<'static> = estimate.collect();
            lines.push(Line::new(name.clone(), estimate).color(color).width(width));
            let truth = |point: &Point| Some(place(point, point.error.filter(|e| *e > 0.0)?));
            let measured: Vec<[f64; 2]> = run.points.iter().filter_map(truth).collect();
            if !measured.is_empty() {
                let line = Line::new(format!("{name}, true"), measured).color(color).width(width);
                lines.push(line.style(LineStyle::dashed_loose()));
            }
        }
    };
    if let Some((current, earlier)) = convergence.runs.split_last() {
        for run in earlier {
            let [r, g, b] = palette::hsv(0.55 + 0.11 * (run.number - 1) as f32, 0.25, 0.55);
            add(run, Color32::from_rgb(r, g, b), 1.2);
        }
        add(current, theme::ACCENT, 2.0);
    }
    if let Some(run) = &convergence.plain {
        add(run, theme::SECOND, 2.0);
    }
    lines
}

#[cfg(test)]
mod tests {
    use super::*;

    fn written(low: f64, high: f64) -> Vec<String> {
        let bounds = (low.log10(), high.log10());
        let marks = grid_lines(bounds);
        let range = bounds.0..=bounds.1;
        // The plot shows no number of a narrow step.
        let inside = marks.into_iter().filter(|mark| range.contains(&mark.value));
        let wide = inside.filter(|mark| mark.step_size >= 1.0);
        wide.map(|mark| tick(mark, &range, 1.0)).filter(|text| !text.is_empty()).collect()
    }

    #[test]
    fn some_numbers_are_written_whatever_the_span() {
        assert_eq!(written(0.9, 1300.0), ["1", "10", "100", "1000"]);
        assert_eq!(written(0.9, 23.0), ["1", "2", "5", "10", "20"]);
        assert_eq!(written(1.99, 4.1), ["2", "2.5", "3", "3.5", "4"]);
        assert_eq!(written(43.9, 49.5), ["44", "45", "46", "47", "48", "49"]);
        assert_eq!(written(30.99, 31.41).len(), 5);
        assert_eq!(written(1e-4, 0.2), ["0.0001", "0.001", "0.01", "0.1"]);
        // What lies at the very end would be cut off, and what lies beyond it over something else.
        assert_eq!(written(0.9, 31.0), ["1", "2", "5", "10", "20"]);
        // A dock as low as it opens, where nothing was written.
        assert_eq!(written(22.0, 75.0), ["30", "40", "60"]);
    }
}
