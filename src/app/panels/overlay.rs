//! Choosing an overlay, and what its colours mean.

use egui::{Color32, Pos2, Rect, Sense, Shape, Slider, Ui, Vec2};

use crate::app::interface::Interface;
use crate::app::overlays::{Legend, Overlay, palette};
use crate::app::presenter::Shown;
use crate::app::theme;

/// Draws the choice and the legend.
pub(in crate::app) fn show(ui: &mut Ui, interface: &mut Interface, shown: Option<&Shown>) {
    theme::heading(ui, "OVERLAY");
    egui::ComboBox::from_id_salt("overlay")
        .width(ui.available_width())
        .height(420.0)
        .selected_text(interface.overlay.map_or("None", Overlay::title))
        .show_ui(ui, |ui| {
            ui.selectable_value(&mut interface.overlay, None, "None");
            for overlay in Overlay::ALL {
                ui.selectable_value(&mut interface.overlay, Some(overlay), overlay.title())
                    .on_hover_text(overlay.description());
            }
        });
    let Some(overlay) = interface.overlay else { return };
    ui.label(theme::quiet(overlay.description()));
    if !overlay.is_opaque() {
        theme::row(ui, "Opacity", "", |ui| {
            ui.add(Slider::new(&mut interface.overlay_opacity, 0.0..=1.0).fixed_decimals(2));
        });
    }
    let is_shown = shown.is_some_and(|s| s.order.overlay.is_some_and(|(o, _)| o == overlay));
    match shown.filter(|_| is_shown).and_then(|s| s.legend.as_ref()) {
        Some(shown) => legend(ui, shown),
        None if overlay == Overlay::Tile && interface.tile.is_none() => {
            ui.label(theme::quiet("Choose a tile on the map below."));
        }
        None => {
            ui.label(theme::quiet("Waiting for a grid with cells."));
        }
    }
}

fn legend(ui: &mut Ui, legend: &Legend) {
    match legend {
        Legend::Scale { low, high, logarithmic, unit } => {
            scale(ui, *low, *high, *logarithmic);
            let kind = if *logarithmic { "logarithmic" } else { "linear" };
            ui.label(theme::quiet(format!("{unit}, {kind}")));
        }
        Legend::Names(names) => {
            for (color, name) in names {
                ui.horizontal(|ui| {
                    let (rect, _) = ui.allocate_exact_size(Vec2::splat(14.0), Sense::hover());
                    ui.painter().rect_filled(rect, 3.0, of(*color));
                    ui.label(name);
                });
            }
        }
        Legend::Map => {
            let size = Vec2::new(ui.available_width(), 0.3 * ui.available_width());
            let (rect, _) = ui.allocate_exact_size(size, Sense::hover());
            patches(ui, rect, (48, 12), palette::of_map_place);
            ui.label(theme::quiet("Place on the map"));
        }
        Legend::None => {}
    }
}

fn of([r, g, b]: [u8; 3]) -> Color32 {
    Color32::from_rgb(r, g, b)
}

/// A colour bar with five numbers.
fn scale(ui: &mut Ui, low: f32, high: f32, logarithmic: bool) {
    let (rect, _) = ui.allocate_exact_size(Vec2::new(ui.available_width(), 32.0), Sense::hover());
    let bar = Rect::from_min_max(rect.min, Pos2::new(rect.right(), rect.top() + 12.0));
    patches(ui, bar, (64, 1), |t, _| palette::viridis(t));
    for i in 0..5 {
        let t = i as f32 / 4.0;
        let value = if logarithmic { low * (high / low).powf(t) } else { low + (high - low) * t };
        let x = bar.left() + bar.width() * t;
        let align = match i {
            0 => egui::Align2::LEFT_TOP,
            4 => egui::Align2::RIGHT_TOP,
            _ => egui::Align2::CENTER_TOP,
        };
        ui.painter().text(
            Pos2::new(x, bar.bottom() + 3.0),
            align,
            theme::figure(f64::from(value)),
            egui::FontId::proportional(11.0),
            theme::QUIET,
        );
    }
}

/// Fills a rectangle with coloured patches; `color` gets their middles in `[0,1]`.
fn patches(
    ui: &Ui,
    rect: Rect,
    (columns, rows): (usize, usize),
    color: impl Fn(f32, f32) -> [u8; 3],
) {
    let size = rect.size() / Vec2::new(columns as f32, rows as f32);
    let shapes = (0..columns * rows).map(|i| {
        let (x, y) = ((i % columns) as f32, (i / columns) as f32);
        let corner = rect.min + Vec2::new(x, y) * size;
        let patch = Rect::from_min_size(corner, size + Vec2::splat(0.5)).intersect(rect);
        let middle = ((x + 0.5) / columns as f32, (y + 0.5) / rows as f32);
        Shape::rect_filled(patch, 0.0, of(color(middle.0, middle.1)))
    });
    ui.painter().extend(shapes);
}
