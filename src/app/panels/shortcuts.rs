//! The sheet of keys and gestures.

use egui::{Align2, Color32, Context, Frame, Grid, Margin, RichText, ScrollArea, Ui, Vec2, Window};

use crate::app::commands::{Command, GESTURES, SHORTCUTS};
use crate::app::interface::Interface;
use crate::app::theme;

/// What both lists take side by side, in points.
const WIDTH: f32 = 720.0;

/// Draws the sheet while it is open.
pub(in crate::app) fn show(context: &Context, interface: &mut Interface) {
    let mut is_open = interface.shortcuts;
    let room = context.content_rect().size() - Vec2::new(48.0, 96.0);
    Window::new("Keys and gestures")
        .open(&mut is_open)
        .collapsible(false)
        .resizable(false)
        // Else the first frame cuts it.
        .default_width(WIDTH.min(room.x))
        .anchor(Align2::CENTER_CENTER, [0.0, 0.0])
        .show(context, |ui| {
            ScrollArea::vertical().max_height(room.y).min_scrolled_height(room.y).show(ui, |ui| {
                ui.add_space(4.0);
                if room.x < WIDTH {
                    keys(ui);
                    ui.add_space(10.0);
                    gestures(ui);
                } else {
                    ui.horizontal_top(|ui| {
                        keys(ui);
                        ui.add_space(24.0);
                        ui.vertical(gestures);
                    });
                }
            });
        });
    interface.shortcuts = is_open;
}

fn keys(ui: &mut Ui) {
    let context = ui.ctx().clone();
    let line = |(keys, what, _): &(_, &'static str, _)| (context.format_shortcut(keys), *what);
    // Those two are named together.
    let is_alone = |(_, _, command): &&(_, _, Command)| !matches!(command, Command::StepOverlay(_));
    list(ui, "keys", SHORTCUTS.iter().filter(is_alone).map(line));
}

fn gestures(ui: &mut Ui) {
    let gestures = GESTURES.iter().map(|(how, what)| (theme::keys(how), *what));
    list(ui, "gestures", gestures);
    ui.add_space(10.0);
    let more = [
        ("[ and ]", "Previous and next overlay"),
        ("? or F1", "This sheet"),
        ("Ctrl+C", "Copy the picture"),
    ];
    list(ui, "more", more.into_iter().map(|(keys, what)| (theme::keys(keys), what)));
}

fn list<'a>(ui: &mut Ui, id: &str, lines: impl Iterator<Item = (String, &'a str)>) {
    Grid::new(id).num_columns(2).spacing([16.0, 5.5]).show(ui, |ui| {
        for (keys, what) in lines {
            Frame::new()
                .fill(Color32::from_rgb(56, 59, 66))
                .corner_radius(4)
                .inner_margin(Margin::symmetric(7, 2))
                .show(ui, |ui| ui.label(RichText::new(keys).size(12.5).color(theme::ACCENT)));
            ui.label(what);
            ui.end_row();
        }
    });
}
