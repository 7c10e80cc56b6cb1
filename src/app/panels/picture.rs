//! Settings of the picture: how it is developed, how light is found, when it is done.

use egui::{DragValue, Ui};

use super::button::button;
use super::scope::Scope;
use crate::app::commands::Command;
use crate::app::document::{Document, Look, PictureSize};
use crate::app::interface::Purpose;
use crate::app::theme;
use crate::denoise::Denoiser;
use crate::tone::{DAYLIGHT_KELVIN, KELVIN, Lut, TINT, ToneCurve, WhiteBalance};

/// Draws the settings.
pub(in crate::app) fn show(ui: &mut Ui, scope: &mut Scope<'_>) {
    let Scope { document, display, rendering, assets, commands, .. } = scope;
    let exposure_ev = display.exposure_ev(document);
    theme::heading(ui, "DEVELOP");
    exposure(ui, document, exposure_ev);
    curve(ui, document);
    look(ui, &mut document.look, &assets.looks.listed, commands);
    white_balance(ui, &mut document.look.white_balance);
    denoiser(ui, document);
    theme::section(ui, "LIGHT");
    let bounces = theme::slider(&mut document.light.bounces, 0..=64);
    theme::set(ui, "Bounces", "Maximum number of bounces; 1 is direct light", bounces);
    if let Some(sentence) = rendering.snapshot.as_ref().and_then(|s| s.cut_off.as_deref()) {
        ui.weak(sentence);
    }
    let seed = theme::number(&mut document.light.seed, 0..=u32::MAX);
    theme::set(ui, "Seed", "Of the random numbers; the same one gives the same picture", seed);
    theme::section(ui, "SIZE");
    size(ui, &mut document.size);
    region(ui, document.region.is_some(), commands);
    theme::section(ui, "STOP AT");
    stop(ui, document);
}

fn denoiser(ui: &mut Ui, document: &mut Document) {
    ui.horizontal(|ui| {
        ui.checkbox(&mut document.look.denoise, "Denoise")
            .on_hover_text("Removes noise on the screen and in .png files; .exr files keep what was rendered (N)");
        if !document.look.denoise {
            return;
        }
        // The library is looked for once.
        if let Err(missing) = Denoiser::Oidn.check() {
            ui.weak("built-in filter").on_hover_text(format!("Intel's Open Image Denoise gives smoother pictures. {missing}. Restart lightgrid to use it"));
            return;
        }
        let chosen = &mut document.look.denoiser;
        let name = |denoiser: Denoiser| match denoiser.found() {
            Denoiser::ATrous => "À-trous",
            _ => "Open Image Denoise",
        };
        let choice = theme::choice(ui, "denoiser").selected_text(name(*chosen)).show_ui(ui, |ui| {
            for denoiser in [Denoiser::Best, Denoiser::ATrous] {
                ui.selectable_value(chosen, denoiser, name(denoiser));
            }
        });
        choice.response.on_hover_text("Intel's neural denoiser, or the built-in edge-avoiding filter");
    });
}

fn exposure(ui: &mut Ui, document: &mut Document, exposure_ev: Option<f32>) {
    let look = &mut document.look;
    let slider = theme::slider(&mut look.exposure_ev, -16.0..=16.0).suffix(" EV");
    let slider = slider.min_decimals(1).max_decimals(2);
    theme::set(ui, "Exposure", "Stops (EV): +1 doubles the brightness", slider);
    theme::row(ui, "", "", |ui| {
        let hint = "Exposes for middle grey, then adds the stops above";
        if ui.checkbox(&mut look.auto_exposure, "Automatic").on_hover_text(hint).changed() {
            // What is seen stays as bright.
            look.exposure_ev = match exposure_ev {
                Some(total) if !look.auto_exposure => total.clamp(-16.0, 16.0),
                _ => 0.0,
            };
        }
        if let Some(exposure_ev) = exposure_ev.filter(|_| look.auto_exposure) {
            theme::note(ui, format!("{exposure_ev:+.1} EV in total"));
        }
    });
}

fn curve(ui: &mut Ui, document: &mut Document) {
    theme::row(ui, "Tone curve", "How highlights are compressed for the screen", |ui| {
        let name = curve_name(document.look.curve);
        theme::choice(ui, "curve").selected_text(name).show_ui(ui, |ui| {
            for curve in ToneCurve::ALL {
                ui.selectable_value(&mut document.look.curve, curve, curve_name(curve));
            }
        });
    });
}

fn curve_name(curve: ToneCurve) -> &'static str {
    match curve {
        ToneCurve::Agx => "AgX",
        ToneCurve::Aces => "ACES",
        ToneCurve::Neutral => "Khronos Neutral",
        ToneCurve::Reinhard => "Reinhard",
        ToneCurve::None => "None",
    }
}

/// Chooses a look; `listed` are those beside the one that was opened last.
fn look(ui: &mut Ui, look: &mut Look, listed: &[String], commands: &mut Vec<Command>) {
    let title = |name: &str| match name.strip_prefix("look:") {
        Some(name) => theme::capitalised(name).replace('-', " "),
        None => theme::file_name(name),
    };
    theme::row(ui, "Look", "Colours laid over the picture", |ui| {
        let shown = look.lut.as_deref().map_or("None".to_owned(), title);
        theme::choice(ui, "look").selected_text(shown).show_ui(ui, |ui| {
            ui.selectable_value(&mut look.lut, None, "None");
            for name in Lut::built_in().chain(listed.iter().cloned()) {
                let title = title(&name);
                ui.selectable_value(&mut look.lut, Some(name), title);
            }
            let hint = "A look as graders write it, for pictures in sRGB";
            button(ui, ("Open a .cube file…", hint), commands, Command::Ask(Purpose::Look));
        });
    });
    if look.lut.is_some() {
        let slider = theme::slider(&mut look.lut_strength, 0.0..=1.0).fixed_decimals(2);
        theme::set(ui, "Strength", "Share of the look", slider);
    }
}

fn white_balance(ui: &mut Ui, balance: &mut WhiteBalance) {
    let slider = theme::slider(&mut balance.kelvin, KELVIN).suffix(" K");
    let slider = slider.fixed_decimals(0).logarithmic(true);
    theme::set(ui, "White", "White balance: the colour temperature that looks white", slider);
    let slider = theme::slider(&mut balance.tint, TINT).fixed_decimals(2);
    theme::set(ui, "Tint", "Green to magenta", slider);
    let is_changed = *balance != WhiteBalance::default();
    if is_changed && ui.button(format!("Daylight, {DAYLIGHT_KELVIN:.0} K")).clicked() {
        *balance = WhiteBalance::default();
    }
}

fn size(ui: &mut Ui, size: &mut PictureSize) {
    const FIXED: [(u32, u32); 4] = [(1280, 720), (1920, 1080), (2560, 1440), (3840, 2160)];
    let name = |size: PictureSize| match size {
        PictureSize::Viewport(1) => "Viewport".to_owned(),
        PictureSize::Viewport(divisor) => format!("Viewport / {divisor}"),
        PictureSize::Fixed(width, height) => format!("{width} x {height}"),
    };
    theme::row(ui, "Pixels", "Resolution of the picture", |ui| {
        theme::choice(ui, "size").selected_text(name(*size)).show_ui(ui, |ui| {
            let viewport = [1, 2, 4].map(PictureSize::Viewport);
            let fixed = FIXED.map(|(w, h)| PictureSize::Fixed(w, h));
            for choice in viewport.into_iter().chain(fixed) {
                ui.selectable_value(size, choice, name(choice));
            }
        });
    });
    if let PictureSize::Fixed(width, height) = size {
        theme::row(ui, "", "", |ui| {
            ui.add(theme::number(width, 1..=16384).speed(4));
            ui.label("x");
            ui.add(theme::number(height, 1..=16384).speed(4));
        });
    }
}

fn region(ui: &mut Ui, has_region: bool, commands: &mut Vec<Command>) {
    let words = if has_region {
        ("Render the whole again", "Removes the region (X)")
    } else {
        ("Render a region…", "Then drag a rectangle over the picture (X)")
    };
    button(ui, words, commands, Command::ToggleRegion);
}

fn stop(ui: &mut Ui, document: &mut Document) {
    let stop = &mut document.stop;
    let mut percent = stop.noise.map(|noise| noise * 100.0);
    optional(ui, "Samples", &mut stop.samples, 256, |v| theme::number(v, 1..=1_000_000));
    optional(ui, "Time", &mut stop.seconds, 60.0, |v| {
        theme::number(v, 0.1..=1e6).suffix(" s").speed(1.0)
    });
    optional(ui, "Noise", &mut percent, 5.0, |v| {
        theme::number(v, 0.01..=100.0).suffix(" %").speed(0.1)
    });
    stop.noise = percent.map(|percent| percent / 100.0);
    if stop.samples.is_none() && stop.seconds.is_none() && stop.noise.is_none() {
        theme::note(ui, "No limit: it goes on until it is paused");
    }
}

/// A checkbox and, when it is checked, a number.
fn optional<T: Copy>(
    ui: &mut Ui,
    name: &str,
    value: &mut Option<T>,
    first: T,
    edit: impl FnOnce(&mut T) -> DragValue<'_>,
) {
    ui.horizontal(|ui| {
        let mut is_on = value.is_some();
        ui.scope(|ui| {
            ui.set_min_width(88.0);
            ui.checkbox(&mut is_on, name);
        });
        if is_on != value.is_some() {
            *value = is_on.then_some(first);
        }
        if let Some(number) = value {
            ui.add(edit(number));
        }
    });
}
