//! Moving about in the picture, and marking a part of it.

use std::sync::Arc;

use egui::{Align2, CursorIcon, Key, PointerButton, Pos2, Rect, Response, Stroke, StrokeKind, Ui};
use glam::Vec3;

use super::scope::Scope;
use crate::app::commands::Command;
use crate::app::document::Viewpoint;
use crate::app::drag::{CLICK_DISTANCE, Drag, Step};
use crate::app::interface::{Tab, Tool};
use crate::app::theme;
use crate::render::surface_map::{Spot, look_at_place};

/// Takes gestures in the picture: `whole` is all of it, `rect` the part that is rendered, and what
/// begins on `handle` is not meant for it.
pub(super) fn show(
    ui: &Ui,
    (whole, rect): (Rect, Rect),
    response: &Response,
    handle: Rect,
    scope: &mut Scope<'_>,
) {
    let is_free = !scope.interface.is_modal();
    let accepts = |at: Pos2| is_free && response.rect.contains(at) && !handle.contains(at);
    let tool = scope.interface.tool;
    let slack = if tool == Some(Tool::Sun) { 0.0 } else { CLICK_DISTANCE };
    let steps = Drag::follow_in(&mut scope.interface.drag, ui, slack, accepts);
    match tool {
        Some(Tool::Region) => mark_region(ui, whole, &steps, scope),
        Some(Tool::Sun) => put_sun(ui, rect, &steps, scope),
        None => {
            point(ui, rect, response, scope);
            travel(ui, whole, response, &steps, scope);
        }
    }
}

/// Says what a tool does.
fn show_hint(ui: &Ui, over: Rect, hint: &str) {
    ui.ctx().set_cursor_icon(CursorIcon::Crosshair);
    let seen = over.intersect(ui.max_rect());
    let top = Pos2::new(seen.center().x, seen.top() + 14.0);
    theme::badges(ui, &[(top, Align2::CENTER_TOP, hint, theme::ACCENT)]);
}

/// Lets the sun follow the pointer while a button is held.
fn put_sun(ui: &Ui, rect: Rect, steps: &[Step], scope: &mut Scope<'_>) {
    show_hint(ui, rect, "Click or drag where the sun is to shine");
    let held = scope.interface.drag.and_then(|drag| drag.span()).map(|[_, at]| at);
    let end = steps.iter().find_map(Step::end);
    if held.is_some() || end.is_some() {
        scope.interface.keep_turning(ui.ctx());
    }
    if end.is_some() {
        scope.interface.tool = None;
    }
    let place = end.or(held.filter(|_| !steps.is_empty()));
    let place = place.filter(|at| rect.contains(*at)).map(|at| place_of(rect, at));
    scope.commands.extend(place.map(|place| Command::PutSun { place, is_last: end.is_some() }));
}

/// Lets a drag mark the part that is to be rendered.
fn mark_region(ui: &Ui, whole: Rect, steps: &[Step], scope: &mut Scope<'_>) {
    show_hint(ui, whole, "Drag over the part that is to be rendered");
    let marked = |[from, to]: [Pos2; 2]| Rect::from_two_pos(from, to).intersect(whole);
    if let Some(span) = scope.interface.drag.and_then(|drag| drag.span()) {
        let stroke = Stroke::new(1.5, theme::ACCENT);
        ui.painter().rect_stroke(marked(span), 0.0, stroke, StrokeKind::Inside);
    }
    for step in steps {
        let Step::End { from, to } = *step else { continue };
        let marked = marked([from, to]);
        scope.interface.tool = None;
        if marked.width() >= 4.0 && marked.height() >= 4.0 {
            let (low, high) = (place_of(whole, marked.min), place_of(whole, marked.max));
            scope.document.region = Some([low.x, low.y, high.x, high.y]);
        }
    }
}

/// Where the pointer is, and what a click does there.
fn point(ui: &Ui, rect: Rect, response: &Response, scope: &mut Scope<'_>) {
    if scope.display.shown.as_ref().is_some_and(|shown| shown.order.covers_now()) {
        // A kept picture has colours and no more.
        scope.interface.pointed = None;
        return;
    }
    scope.interface.pointed =
        response.hover_pos().filter(|at| rect.contains(*at)).map(|at| place_of(rect, at));
    if response.double_clicked() {
        pick(rect, response, scope, Viewpoint::set_pivot);
    } else if response.clicked() && ui.input(|input| input.modifiers.command) {
        pick(rect, response, scope, Viewpoint::focus_on);
    } else if response.clicked() {
        let place = response.interact_pointer_pos().map(|at| place_of(rect, at));
        scope.interface.pinned = place.filter(|_| scope.interface.tab == Tab::Inspect);
        let spot = clicked_spot(rect, response, scope);
        scope.interface.choose_material(spot.map(|spot| spot.material));
    }
}

/// Magnifies the picture, and moves the magnified one: `area` is its room, `shown` where the whole lies.
pub(super) fn zoom(
    ui: &Ui,
    (area, shown): (Rect, Rect),
    response: &Response,
    scope: &mut Scope<'_>,
) {
    scope.interface.pointed_in_whole = response.hover_pos().map(|at| place_of(shown, at));
    let zoom = &mut scope.interface.zoom;
    let factor = ui.input(|input| input.zoom_delta());
    if let Some(at) = response.hover_pos().filter(|_| factor != 1.0 && factor.is_finite()) {
        *zoom = zoom.by(factor, at, area, shown);
        ui.ctx().request_repaint();
    }
}

/// Moves the camera.
fn travel(ui: &Ui, whole: Rect, response: &Response, steps: &[Step], scope: &mut Scope<'_>) {
    let context = ui.ctx();
    let scene = scope.scene();
    let Some(viewpoint) = &mut scope.document.viewpoint else { return };
    // Holding still counts too: letting go ends it.
    let is_zoomed = scope.interface.zoom.is_some();
    let pans = |has_command: bool| has_command && is_zoomed;
    let mut moved =
        scope.interface.drag.is_some_and(|drag| drag.span().is_some() && !pans(drag.has_command));
    for step in steps {
        let Step::Move { button, by, modifiers } = *step else { continue };
        let by = glam::Vec2::new(by.x, by.y);
        if pans(modifiers.command) && button == PointerButton::Primary {
            scope.interface.zoom = scope.interface.zoom.moved(egui::vec2(by.x, by.y), whole);
            continue;
        }
        moved = true;
        if button == PointerButton::Secondary {
            viewpoint.look_around(-by);
        } else if button == PointerButton::Middle || modifiers.shift {
            viewpoint.pan(by, whole.height());
        } else {
            viewpoint.orbit_within(scene.map(|scene| &*scene.world), by);
        }
    }
    let wheel = context.input(|i| i.smooth_scroll_delta().y);
    if response.hovered() && wheel != 0.0 {
        moved = true;
        viewpoint.dolly(wheel / 50.0);
    }
    let may_fly = !context.text_edit_focused() && !scope.interface.is_modal();
    hold_keys(context, may_fly, &mut scope.interface.flying);
    // Metres per second that suit the scene: a walk in a room, faster outdoors.
    let speed = scene.map_or(1.0, |scene| {
        let (low, high) = scene.world.bvh.bounds();
        (0.25 * (high - low).length()).clamp(0.05, 50.0)
    });
    if let Some(metres) = flight(context, &scope.interface.flying, speed) {
        moved = true;
        viewpoint.fly(metres);
        context.request_repaint();
    }
    if moved {
        scope.interface.keep_moving(context);
    }
}

fn place_of(rect: Rect, at: Pos2) -> glam::Vec2 {
    let place = (at - rect.min) / rect.size();
    glam::Vec2::new(place.x, place.y)
}

/// The surface under a click.
fn clicked_spot(rect: Rect, response: &Response, scope: &Scope<'_>) -> Option<Spot> {
    let place = place_of(rect, response.interact_pointer_pos()?);
    let (scene, snapshot) = (scope.scene()?, &scope.display.shown.as_ref()?.order.snapshot);
    let world = &snapshot.request.world;
    // The last picture of another scene says nothing about this one.
    let is_of_scene = Arc::ptr_eq(&world.geometry, &scene.world.geometry);
    is_of_scene.then(|| look_at_place(world, &snapshot.view(), place))?
}

/// Does something with the surface under a click.
fn pick(rect: Rect, response: &Response, scope: &mut Scope<'_>, act: fn(&mut Viewpoint, Vec3)) {
    let spot = clicked_spot(rect, response, scope);
    if let (Some(spot), Some(viewpoint)) = (spot, &mut scope.document.viewpoint) {
        let mut moved = viewpoint.clone();
        act(&mut moved, spot.position);
        scope.commands.push(Command::LookFrom(moved));
    }
}

/// Keys that fly: right, left, up, down, forward, back.
const FLYING: [Key; 6] = [Key::D, Key::A, Key::E, Key::Q, Key::W, Key::S];

/// Follows which of them are held: those that were pressed on their own. What is part of a shortcut
/// never flies, however the releases of its keys fall into frames.
fn hold_keys(context: &egui::Context, may_fly: bool, held: &mut Vec<Key>) {
    context.input(|input| {
        for event in &input.events {
            if let egui::Event::Key { key, pressed: true, repeat: false, modifiers, .. } = event
                && FLYING.contains(key)
                && !(modifiers.command || modifiers.alt)
            {
                held.push(*key);
            }
        }
        held.retain(|key| may_fly && input.key_down(*key));
    });
}

/// Metres along right, up and forward that the keys held down ask for.
fn flight(context: &egui::Context, held: &[Key], speed: f32) -> Option<Vec3> {
    let axis =
        |plus: Key, minus: Key| f32::from(held.contains(&plus)) - f32::from(held.contains(&minus));
    let [right, left, up, down, forward, back] = FLYING;
    let direction = Vec3::new(axis(right, left), axis(up, down), axis(forward, back));
    context.input(|input| {
        let faster = if input.modifiers.shift { 4.0 } else { 1.0 };
        let seconds = input.stable_dt.min(0.1);
        (direction != Vec3::ZERO).then(|| direction.normalize() * speed * faster * seconds)
    })
}

#[cfg(test)]
mod tests {
    use egui::{Event, Modifiers, RawInput};

    use super::*;

    fn key(key: Key, pressed: bool, modifiers: Modifiers) -> Event {
        Event::Key { key, physical_key: None, pressed, repeat: false, modifiers }
    }

    #[test]
    fn a_key_flies_alone_and_not_as_part_of_a_shortcut() {
        let context = egui::Context::default();
        let mut held = Vec::new();
        let mut frame = |events: Vec<Event>, may_fly| {
            let _ = context.run_ui(RawInput { events, ..RawInput::default() }, |_| {});
            hold_keys(&context, may_fly, &mut held);
            flight(&context, &held, 1.0).is_some()
        };
        let (none, control) = (Modifiers::NONE, Modifiers::COMMAND);
        assert!(frame(vec![key(Key::W, true, none)], true));
        assert!(frame(Vec::new(), true));
        assert!(!frame(vec![key(Key::W, false, none)], true));
        // Ctrl is let go before S.
        assert!(!frame(vec![key(Key::S, true, control)], true));
        assert!(!frame(Vec::new(), true));
        assert!(!frame(vec![key(Key::S, false, none)], true));
        // Typing is no flight, nor what is held when it ends.
        assert!(!frame(vec![key(Key::A, true, none)], false));
        assert!(!frame(Vec::new(), true));
    }
}
