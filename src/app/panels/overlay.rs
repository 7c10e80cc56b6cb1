//! Choosing an overlay, and what its colours mean.

use egui::{Color32, Sense, Ui, Vec2};

use super::color_bar;
use super::scope::Scope;
use crate::app::overlays::{Legend, Overlay, palette};
use crate::app::theme;
use crate::app::worker::NoCache;
use crate::radiance_cache::{CacheFacts, RadianceSums};

/// Draws the choice and the legend.
pub(in crate::app) fn show(ui: &mut Ui, scope: &mut Scope<'_>) {
    let Scope { interface, display, .. } = scope;
    theme::heading(ui, "OVERLAY");
    let title = interface.overlay.map_or("None", Overlay::title);
    theme::choice(ui, "overlay").selected_text(title).show_ui(ui, |ui| {
        ui.selectable_value(&mut interface.overlay, None, "None");
        for overlay in Overlay::ALL {
            ui.selectable_value(&mut interface.overlay, Some(overlay), overlay.title())
                .on_hover_text(overlay.description());
        }
    });
    let Some(overlay) = interface.overlay else { return };
    theme::note(ui, overlay.description());
    if !overlay.is_opaque() {
        let slider = theme::slider(&mut interface.overlay_opacity, 0.0..=1.0).fixed_decimals(2);
        theme::set(ui, "Opacity", "", slider);
    }
    let shown = display.shown.as_ref().filter(|s| s.order.overlay == Some(overlay));
    let cache = shown.filter(|_| overlay.is_of_cache()).map(|s| &s.order.snapshot.cache);
    match shown.and_then(|s| Some(&s.painted.as_ref()?.legend)) {
        Some(shown) => legend(ui, shown),
        None if let Some(Err(missing)) = cache => theme::note(ui, no_cache(*missing)),
        None if overlay == Overlay::Tile && interface.tile.is_none() => {
            theme::note(ui, "Choose a tile on the map below.");
        }
        None if shown.is_some_and(|shown| shown.order.covers_now()) => {
            theme::note(ui, "Kept pictures have no overlays.");
        }
        None if overlay == Overlay::Flip => {
            theme::note(ui, "It needs a reference of this view and size: see Convergence.");
        }
        None => theme::note(ui, "The Light Grid has no cells yet."),
    }
    if let Some(Ok(cache)) = cache {
        theme::note(ui, format!("The whole cache: {}", cache_size(cache)));
    }
}

/// Why there is no radiance cache.
pub(in crate::app) fn no_cache(missing: NoCache) -> &'static str {
    match missing {
        NoCache::NotDenoised => "No radiance cache: it is trained only while Denoise is on.",
        NoCache::Split => "No radiance cache: the split view does not use it.",
        NoCache::QuickDevice => "No radiance cache: this GPU is fast enough without it.",
        NoCache::Mixed => "No radiance cache: each group of a light mix has its own.",
        NoCache::OneBounce => "No radiance cache: direct light does not use it.",
        NoCache::Unasked | NoCache::Untrained => "The radiance cache is not trained yet.",
    }
}

/// How large the cache is.
pub(in crate::app) fn cache_size(cache: &CacheFacts) -> String {
    let [cells, samples] = [cache.cell_count as u64, cache.samples].map(theme::count);
    let memory = theme::bytes(RadianceSums::memory_bytes()).replace(' ', "\u{a0}");
    format!("{cells} cells of {samples} samples, {memory}")
}

fn legend(ui: &mut Ui, legend: &Legend) {
    match legend {
        Legend::Scale { low, high, logarithmic, unit } => {
            let text = |value| theme::figure(f64::from(value));
            color_bar::show(ui, (*low, *high), *logarithmic, text);
            let kind = if *logarithmic { "logarithmic" } else { "linear" };
            theme::note(ui, format!("{unit}, {kind}"));
        }
        Legend::Names(names) => {
            for (color, name) in names {
                ui.horizontal(|ui| {
                    let (rect, _) = ui.allocate_exact_size(Vec2::splat(14.0), Sense::hover());
                    let [r, g, b] = *color;
                    ui.painter().rect_filled(rect, 3.0, Color32::from_rgb(r, g, b));
                    ui.add(egui::Label::new(name).wrap());
                });
            }
        }
        Legend::Map => {
            let size = Vec2::new(ui.available_width(), 0.3 * ui.available_width());
            let (rect, _) = ui.allocate_exact_size(size, Sense::hover());
            color_bar::patches(ui, rect, (48, 12), palette::of_map_place);
            theme::note(ui, "Place on the map");
        }
        Legend::None => {}
        Legend::Empty => theme::note(ui, "No pixel has a value."),
    }
}
