//! The right panel: two tabs over what is passed in.

use egui::{Margin, Panel, ScrollArea, Ui};

use crate::app::interface::{Interface, Tab};
use crate::app::theme;

/// Draws the tabs and, below, what `content` draws for the chosen one.
pub(in crate::app) fn show(
    ui: &mut Ui,
    interface: &mut Interface,
    content: impl FnOnce(&mut Ui, &mut Interface),
) {
    let frame = egui::Frame::new().fill(theme::PANEL).inner_margin(Margin::symmetric(12, 8));
    let width = match interface.tab {
        Tab::Picture => theme::side_width(ui),
        // Tables of figures do not get narrower.
        Tab::Inspect => 300.0,
    };
    Panel::right("right").frame(frame).exact_size(width).show(ui, |ui| {
        ui.horizontal(|ui| {
            ui.selectable_value(&mut interface.tab, Tab::Picture, "Picture");
            ui.selectable_value(&mut interface.tab, Tab::Inspect, "Inspect");
        });
        ui.separator();
        ScrollArea::vertical().auto_shrink(false).show(ui, |ui| content(ui, interface));
    });
}
