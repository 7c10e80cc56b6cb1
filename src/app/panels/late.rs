//! Values that are taken up when the pointer lets go, where what they change is built anew.

use egui::{Response, Slider, Ui};

use crate::app::theme;

/// Draws a value by `widget`; `name` tells it from others of the same part of the panel. It is taken up at once unless
/// it `is_late`.
pub(super) fn late(
    ui: &mut Ui,
    name: &str,
    (result, is_late): (&mut f32, bool),
    widget: impl FnOnce(&mut Ui, &mut f32) -> Response,
) {
    let id = ui.scope_id().with(name);
    let mut value = ui.data(|data| data.get_temp(id)).unwrap_or(*result);
    let response = widget(ui, &mut value);
    if is_late && (response.dragged() || response.has_focus()) {
        ui.data_mut(|data| data.insert_temp(id, value));
    } else {
        ui.data_mut(|data| data.remove::<f32>(id));
        *result = value;
    }
}

/// A row of a late factor on light.
pub(super) fn late_factor(ui: &mut Ui, name: &str, hint: &str, result: (&mut f32, bool)) {
    theme::row(ui, name, hint, |ui| late(ui, name, result, |ui, value| ui.add(factor(value))));
}

/// A slider for a factor on light.
pub(super) fn factor(value: &mut f32) -> Slider<'_> {
    let slider = theme::slider(value, 0.0..=10.0).logarithmic(true);
    slider.smallest_positive(0.01).fixed_decimals(2).prefix("× ")
}
