//! The panel below the picture: tabs over what is passed in.

use egui::{Align, Layout, Margin, Panel, ScrollArea, Ui};

use super::scope::Scope;
use crate::app::interface::{Dock, Interface, Tab};

/// Draws the tabs and what `content` draws for the chosen one; nothing when closed.
pub(in crate::app) fn show(
    ui: &mut Ui,
    scope: &mut Scope<'_>,
    content: impl FnOnce(&mut Ui, &mut Scope<'_>, Dock),
) {
    let interface = &mut *scope.interface;
    if interface.dock.is_none() && interface.tab != Tab::Inspect {
        return;
    }
    let frame = egui::Frame::new().inner_margin(Margin::symmetric(12, 6));
    let Some(dock) = interface.dock else {
        // Of another name: panels remember how high they were.
        Panel::bottom("closed dock").frame(frame).show(ui, |ui| tabs(ui, interface));
        return;
    };
    let panel = Panel::bottom("dock").frame(frame);
    panel.resizable(true).default_size(230.0).min_size(120.0).show(ui, |ui| {
        tabs(ui, scope.interface);
        ui.add_space(2.0);
        ScrollArea::vertical().auto_shrink(false).show(ui, |ui| content(ui, scope, dock));
    });
}

fn tabs(ui: &mut Ui, interface: &mut Interface) {
    ui.horizontal(|ui| {
        ui.selectable_value(&mut interface.dock, Some(Dock::Convergence), "Convergence");
        ui.selectable_value(&mut interface.dock, Some(Dock::Needs), "What the scene needs");
        ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
            if interface.dock.is_some() && ui.small_button("×").on_hover_text("Close").clicked() {
                interface.dock = None;
            }
        });
    });
}
