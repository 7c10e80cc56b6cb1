//! What colours mean, in numbers.

use egui::{Color32, Pos2, Rect, Sense, Shape, Ui, Vec2};

use crate::app::overlays::palette;
use crate::app::theme;

/// A colour bar with five numbers.
pub(super) fn show(
    ui: &mut Ui,
    (low, high): (f32, f32),
    logarithmic: bool,
    text: impl Fn(f32) -> String,
) {
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
        let (at, font) = (Pos2::new(x, bar.bottom() + 3.0), egui::FontId::proportional(11.0));
        ui.painter().text(at, align, text(value), font, theme::QUIET);
    }
}

/// Fills a rectangle with coloured patches; `color` gets their middles in `[0,1]`.
pub(super) fn patches(
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
        let [r, g, b] = color(middle.0, middle.1);
        Shape::rect_filled(patch, 0.0, Color32::from_rgb(r, g, b))
    });
    ui.painter().extend(shapes);
}
