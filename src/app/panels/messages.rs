//! Messages over the picture.

use egui::{
    Align2, Area, Color32, Context, Frame, Id, Label, Margin, Rect, RichText, ScrollArea, Stroke,
    Ui, Vec2,
};

use crate::app::messages::{Messages, NOTICE_SECONDS};
use crate::app::theme;

/// Room beside a sentence for what closes it, in points.
const CLOSE_WIDTH: f32 = 36.0;

/// Between messages and the edges of the picture's room, in points.
const MARGIN: f32 = 12.0;

/// Draws the messages at the foot of the picture's room; errors stay until they are closed. Where there is not room
/// for all, the newest are in sight.
pub(in crate::app) fn show(context: &Context, room: Rect, messages: &mut Messages) {
    let now = context.time();
    messages.list.retain(|message| {
        message.is_error || message.since.is_none_or(|since| now - since < NOTICE_SECONDS)
    });
    if messages.list.is_empty() {
        return;
    }
    // Errors go when they are closed.
    if messages.list.iter().any(|message| !message.is_error) {
        context.request_repaint_after(std::time::Duration::from_secs(1));
    }
    if messages.list.iter().any(|message| message.since.is_none()) {
        // How high they are is known once they are laid out: until then they would lie too low.
        context.request_discard("a message is new");
    }
    let foot = room.center_bottom() - Vec2::new(0.0, MARGIN);
    let area = Area::new(Id::unique("messages")).pivot(Align2::CENTER_BOTTOM).fixed_pos(foot);
    let width = (room.width() - 60.0).clamp(160.0, 620.0);
    area.show(context, |ui| {
        let most = (room.height() - 2.0 * MARGIN).max(0.0);
        // Or it is no higher than it was with fewer messages.
        let scroll = ScrollArea::vertical().min_scrolled_height(most).max_height(most);
        scroll.stick_to_bottom(true).show(ui, |ui| list(ui, width, now, messages));
    });
}

fn list(ui: &mut Ui, width: f32, now: f64, messages: &mut Messages) {
    let mut closed = None;
    for (i, message) in messages.list.iter_mut().enumerate() {
        message.since.get_or_insert(now);
        let color = if message.is_error { theme::ALERT } else { theme::TEXT };
        let edge = if message.is_error { theme::ALERT } else { Color32::from_rgb(70, 74, 82) };
        Frame::new()
            .fill(Color32::from_rgb(40, 42, 48))
            .stroke(Stroke::new(1.0, edge))
            .corner_radius(6)
            .inner_margin(Margin::symmetric(12, 7))
            .show(ui, |ui| {
                ui.set_max_width(width);
                ui.horizontal_top(|ui| {
                    let text = RichText::new(&message.sentence).color(color);
                    ui.scope(|ui| {
                        ui.set_max_width(width - CLOSE_WIDTH);
                        ui.add(Label::new(text).wrap());
                    });
                    if ui.small_button("×").on_hover_text("Close").clicked() {
                        closed = Some(i);
                    }
                });
            });
    }
    if let Some(index) = closed {
        messages.list.remove(index);
    }
}
