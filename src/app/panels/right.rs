//! The right panel: tabs over what is passed in.

use egui::{Margin, Panel, ScrollArea, Ui};

use super::scope::Scope;
use crate::app::interface::Tab;
use crate::app::theme;

/// Draws the tabs and, below, what `content` draws for the chosen one; the scene has one where there is no
/// left panel.
pub(in crate::app) fn show(
    ui: &mut Ui,
    scope: &mut Scope<'_>,
    content: impl FnOnce(&mut Ui, &mut Scope<'_>),
) {
    let has_scene = theme::is_small(ui);
    let interface = &mut *scope.interface;
    if !has_scene && interface.tab == Tab::Scene {
        interface.tab = Tab::Picture;
    } else if has_scene && interface.is_material_new && interface.tab == Tab::Picture {
        interface.tab = Tab::Scene;
    }
    let frame = egui::Frame::new().inner_margin(Margin::symmetric(12, 8));
    Panel::right("right").frame(frame).exact_size(300.0).show(ui, |ui| {
        let tab = &mut scope.interface.tab;
        ui.horizontal(|ui| {
            if has_scene {
                ui.selectable_value(tab, Tab::Scene, "Scene");
            }
            ui.selectable_value(tab, Tab::Picture, "Picture");
            ui.selectable_value(tab, Tab::Compare, "Compare");
            ui.selectable_value(tab, Tab::Inspect, "Inspect");
        });
        ui.separator();
        ScrollArea::vertical().auto_shrink(false).show(ui, |ui| content(ui, scope));
    });
}
