//! The picture, and moving about in it.

use egui::{
    Align2, CentralPanel, Color32, CursorIcon, FontId, Key, PointerButton, Pos2, Rect, Response,
    Sense, Shape, Stroke, StrokeKind, TextureId, Ui, Vec2,
};
use glam::Vec3;

use crate::app::commands::Command;
use crate::app::document::{Document, Viewpoint};
use crate::app::interface::{Interface, Tab};
use crate::app::loader::LoadedScene;
use crate::app::presenter::Shown;
use crate::app::screen::{Developed, Recipe, Screen};
use crate::app::speed_up::SpeedUp;
use crate::app::surface_map::look_at_place;
use crate::app::theme;
use crate::app::worker::{Activity, Snapshot};
use crate::bvh::Ray;
use crate::develop::{DevelopSettings, LinearPicture};
use crate::render::View;

/// Developed pictures.
#[derive(Default)]
pub(in crate::app) struct Textures {
    /// The last whole picture.
    main: Option<Developed>,
    /// A part of it that is rendered alone.
    part: Option<Developed>,
    other: Option<Developed>,
}

impl Textures {
    /// The picture that is shown, if one was drawn as yet.
    pub(in crate::app) fn picture(&self, shown: Option<&Shown>) -> Option<&Developed> {
        let is_part = shown?.order.snapshot.request.view.crop.is_some();
        if is_part { self.part.as_ref() } else { self.main.as_ref() }
    }
}

/// What the viewport is drawn from.
pub(in crate::app) struct Scope<'a> {
    pub(in crate::app) document: &'a mut Document,
    pub(in crate::app) interface: &'a mut Interface,
    pub(in crate::app) textures: &'a mut Textures,
    pub(in crate::app) screen: &'a Screen,
    pub(in crate::app) shown: Option<&'a Shown>,
    /// How what is shown is developed.
    pub(in crate::app) settings: Option<DevelopSettings>,
    pub(in crate::app) snapshot: Option<&'a Snapshot>,
    pub(in crate::app) speed_up: Option<SpeedUp>,
    /// Name of the kept picture that is compared.
    pub(in crate::app) past: Option<&'a str>,
    pub(in crate::app) scene: Option<&'a LoadedScene>,
    pub(in crate::app) loading: bool,
    pub(in crate::app) commands: &'a mut Vec<Command>,
}

/// Draws the picture and takes gestures.
pub(in crate::app) fn show(ui: &mut Ui, scope: &mut Scope<'_>) {
    let frame = egui::Frame::new().fill(theme::BACKGROUND);
    CentralPanel::default().frame(frame).show(ui, |ui| {
        let area = ui.max_rect();
        let points = ui.ctx().pixels_per_point();
        let pixels = (area.size() * points).round();
        scope.interface.viewport_pixels =
            Some([pixels.x.max(1.0) as u32, pixels.y.max(1.0) as u32]);
        let response = ui.interact(area, ui.scope_id().with("picture"), Sense::click_and_drag());
        let Some((shown, settings)) = scope.shown.zip(scope.settings) else {
            waiting(ui, area, scope.loading);
            return;
        };
        let view = scope.snapshot.map_or(&shown.order.snapshot.request.view, |s| &s.request.view);
        let whole = fitted(area, view);
        let rect = part_rect(whole, &shown.order.snapshot.request.view);
        picture(ui, (whole, rect), shown, settings, scope);
        labels(ui, rect, shown);
        let mut is_wiping = false;
        if let Some(other) = &shown.other {
            let recipe = Recipe {
                picture: other.clone(),
                overlay: None,
                settings,
                number: shown.order.snapshot.number,
            };
            let changes = changes(ui, other, scope);
            let texture =
                Developed::update(&mut scope.textures.other, scope.screen, recipe, changes);
            is_wiping = wipe(ui, rect, texture, scope);
        }
        if scope.interface.is_marking {
            mark_region(ui, whole, &response, scope);
        } else if !is_wiping {
            gestures(ui, (whole, rect), &response, scope);
        }
        pin(ui, rect, scope.interface);
    });
}

/// The picture as large as fits, in its own shape.
fn fitted(area: Rect, view: &View) -> Rect {
    let [width, height] = view.whole_size();
    let size = Vec2::new(width as f32, height as f32);
    let scale = (area.width() / size.x).min(area.height() / size.y);
    Rect::from_center_size(area.center(), size * scale)
}

/// Where in the whole picture's rectangle the view's part of it lies.
fn part_rect(whole: Rect, view: &View) -> Rect {
    let Some(crop) = view.crop else { return whole };
    let [width, height] = crop.whole.map(|pixels| pixels as f32);
    let scale = whole.size() / Vec2::new(width, height);
    let corner = Vec2::new(crop.corner[0] as f32, crop.corner[1] as f32);
    let size = Vec2::new(view.width as f32, view.height as f32);
    Rect::from_min_size(whole.min + corner * scale, size * scale)
}

/// Draws the picture; a part lies on the last whole one, which steps back.
fn picture(
    ui: &Ui,
    (whole, rect): (Rect, Rect),
    shown: &Shown,
    settings: DevelopSettings,
    scope: &mut Scope<'_>,
) {
    let full = Rect::from_min_max(Pos2::ZERO, Pos2::new(1.0, 1.0));
    let painter = ui.painter();
    let recipe = Recipe {
        picture: shown.picture.clone(),
        overlay: shown.overlay.clone(),
        settings,
        number: shown.order.snapshot.number,
    };
    let changes = changes(ui, &shown.picture, scope);
    if shown.order.snapshot.request.view.crop.is_none() {
        let texture = Developed::update(&mut scope.textures.main, scope.screen, recipe, changes);
        painter.image(texture, whole, full, Color32::WHITE);
        return;
    }
    if let Some(main) = &scope.textures.main {
        painter.image(main.id, whole, full, Color32::from_gray(90));
    }
    let texture = Developed::update(&mut scope.textures.part, scope.screen, recipe, changes);
    painter.image(texture, rect, full, Color32::WHITE);
    painter.rect_stroke(rect, 0.0, Stroke::new(1.0, theme::ACCENT), StrokeKind::Outside);
}

/// Whether a picture is another one in every frame; then there is a next frame. Software would do
/// nothing else than draw: there it changes with the snapshots.
fn changes(ui: &Ui, picture: &LinearPicture, scope: &Scope<'_>) -> bool {
    let is_idle =
        |snapshot: &Snapshot| matches!(snapshot.activity, Activity::Paused | Activity::Done);
    let changes = picture.is_live()
        && !scope.screen.gpu().facts().is_software()
        && !scope.snapshot.is_none_or(is_idle);
    if changes {
        ui.ctx().request_repaint();
    }
    changes
}

/// Writes what the overlay has to say.
fn labels(ui: &Ui, rect: Rect, shown: &Shown) {
    let painter = ui.painter_at(rect);
    let font = FontId::proportional((rect.width() / 85.0).clamp(7.0, 12.0));
    for label in &shown.labels {
        let at = rect.min + Vec2::new(label.place.x, label.place.y) * rect.size();
        painter.text(at, Align2::CENTER_CENTER, &label.text, font.clone(), Color32::BLACK);
    }
}

/// Lets a drag mark the part that is to be rendered.
fn mark_region(ui: &Ui, whole: Rect, response: &Response, scope: &mut Scope<'_>) {
    ui.ctx().set_cursor_icon(CursorIcon::Crosshair);
    let hint = "Drag over the part that is to be rendered";
    let top = Pos2::new(whole.center().x, whole.top() + 14.0);
    badge(ui, top, Align2::CENTER_TOP, hint, theme::ACCENT);
    let start = ui.ctx().input(|i| i.pointer.press_origin());
    let (Some(start), Some(now)) = (start, response.interact_pointer_pos()) else { return };
    let marked = Rect::from_two_pos(start, now).intersect(whole);
    ui.painter().rect_stroke(marked, 0.0, Stroke::new(1.5, theme::ACCENT), StrokeKind::Inside);
    if response.drag_stopped() {
        scope.interface.is_marking = false;
        if marked.width() >= 4.0 && marked.height() >= 4.0 {
            let (low, high) = (place_of(whole, marked.min), place_of(whole, marked.max));
            scope.document.region = Some([low.x, low.y, high.x, high.y]);
        }
    }
}

fn waiting(ui: &Ui, area: Rect, is_loading: bool) {
    let text = if is_loading { "Loading…" } else { "The first samples are on their way…" };
    ui.painter().text(
        area.center(),
        Align2::CENTER_CENTER,
        text,
        FontId::proportional(15.0),
        theme::QUIET,
    );
}

/// The other picture left of a line that can be dragged; whether it is being dragged.
fn wipe(ui: &Ui, rect: Rect, texture: TextureId, scope: &mut Scope<'_>) -> bool {
    let x = rect.left() + rect.width() * scope.interface.wipe;
    let left = Rect::from_min_max(rect.min, Pos2::new(x, rect.bottom()));
    let uv = Rect::from_min_max(Pos2::ZERO, Pos2::new(scope.interface.wipe, 1.0));
    ui.painter().image(texture, left, uv, Color32::WHITE);
    let handle =
        Rect::from_center_size(Pos2::new(x, rect.center().y), Vec2::new(14.0, rect.height()));
    let response = ui.interact(handle, ui.scope_id().with("wipe"), Sense::drag());
    if let Some(at) = response.interact_pointer_pos().filter(|_| response.dragged()) {
        scope.interface.wipe = ((at.x - rect.left()) / rect.width()).clamp(0.0, 1.0);
    }
    let is_active = response.hovered() || response.dragged();
    if is_active {
        ui.ctx().set_cursor_icon(CursorIcon::ResizeHorizontal);
    }
    let line = [Pos2::new(x, rect.top()), Pos2::new(x, rect.bottom())];
    let color = if is_active { theme::ACCENT } else { Color32::from_white_alpha(200) };
    ui.painter().line_segment(line, Stroke::new(1.5, color));
    ui.painter().circle_filled(Pos2::new(x, rect.center().y), 6.0, color);
    wipe_labels(ui, rect, scope);
    response.dragged()
}

fn wipe_labels(ui: &Ui, rect: Rect, scope: &Scope<'_>) {
    let corner = |x: f32, align: Align2, text: &str| {
        badge(ui, Pos2::new(x, rect.top() + 14.0), align, text, theme::TEXT);
    };
    let noise =
        |noise: f64, samples: u32| format!("{samples} samples, noise {:.1} %", 100.0 * noise);
    let (left, right) = match (scope.past, scope.snapshot) {
        (Some(name), _) => (name.to_owned(), "Now".to_owned()),
        (None, Some(snapshot)) => {
            let take = &snapshot.main;
            let name = crate::app::convergence::name_of(take.sampling);
            let plain = snapshot.plain.as_ref().map_or_else(String::new, |plain| {
                format!("plain: {}", noise(plain.noise, plain.film.min_samples()))
            });
            (plain, format!("{name}: {}", noise(take.noise, take.film.min_samples())))
        }
        (None, None) => return,
    };
    corner(rect.left() + 14.0, Align2::LEFT_TOP, &left);
    corner(rect.right() - 14.0, Align2::RIGHT_TOP, &right);
    if let Some(speed_up) = scope.speed_up.filter(|_| scope.past.is_none()) {
        let text = format!(
            "{:.1} × as fast, ± {:.0} %",
            speed_up.ratio,
            (100.0 * speed_up.relative_error).max(1.0)
        );
        let at = Pos2::new(rect.center().x, rect.top() + 14.0);
        badge(ui, at, Align2::CENTER_TOP, &text, theme::ACCENT);
    }
}

/// Text on a dark plate.
fn badge(ui: &Ui, at: Pos2, align: Align2, text: &str, color: Color32) {
    let galley = ui.painter().layout_no_wrap(text.to_owned(), FontId::proportional(13.0), color);
    let rect = align.anchor_size(at, galley.size());
    let plate = rect.expand2(Vec2::new(8.0, 4.0));
    ui.painter().add(Shape::rect_filled(plate, 5.0, Color32::from_black_alpha(170)));
    ui.painter().galley(rect.min, galley, color);
}

fn place_of(rect: Rect, at: Pos2) -> glam::Vec2 {
    let place = (at - rect.min) / rect.size();
    glam::Vec2::new(place.x, place.y)
}

fn gestures(ui: &Ui, (whole, rect): (Rect, Rect), response: &Response, scope: &mut Scope<'_>) {
    let context = ui.ctx();
    scope.interface.pointed =
        response.hover_pos().filter(|at| rect.contains(*at)).map(|at| place_of(rect, at));
    let modifiers = context.input(|i| i.modifiers);
    if response.double_clicked() {
        pick(rect, response, scope, Viewpoint::set_pivot);
    } else if response.clicked() && modifiers.command {
        pick(rect, response, scope, Viewpoint::focus_on);
    } else if response.clicked() {
        let place = response.interact_pointer_pos().map(|at| place_of(rect, at));
        let is_inspecting = scope.interface.tab == Tab::Inspect;
        scope.interface.pinned = place.filter(|_| is_inspecting);
    }
    let Some(viewpoint) = &mut scope.document.viewpoint else { return };
    let mut moved = false;
    let delta = response.drag_delta();
    let drag = glam::Vec2::new(delta.x, delta.y);
    // Holding still counts too: letting go ends it.
    moved |= response.dragged();
    if drag != glam::Vec2::ZERO {
        let by = |button| response.dragged_by(button);
        if by(PointerButton::Secondary) {
            viewpoint.look_around(-drag);
        } else if by(PointerButton::Middle) || modifiers.shift {
            viewpoint.pan(drag, whole.height());
        } else {
            orbit(viewpoint, drag, scope.scene);
        }
    }
    if response.hovered() {
        let wheel = context.input(|i| i.smooth_scroll_delta().y);
        if wheel != 0.0 {
            moved = true;
            viewpoint.dolly(wheel / 50.0);
        }
    }
    if !context.text_edit_focused() && !scope.interface.is_modal() {
        let speed = scope.scene.map_or(1.0, |scene| flying_speed(&scene.world));
        if let Some(metres) = flight(context, speed) {
            moved = true;
            viewpoint.fly(metres);
            context.request_repaint();
        }
    }
    if moved {
        scope.interface.keep_moving(context.time(), context.input(|i| i.unstable_dt));
    }
}

/// Orbits, unless a wall is in the way: then the camera turns where it is, and stays in its room.
fn orbit(viewpoint: &mut Viewpoint, drag: glam::Vec2, scene: Option<&LoadedScene>) {
    let mut moved = viewpoint.clone();
    moved.orbit(drag);
    let step = moved.eye() - viewpoint.eye();
    let is_blocked = scene.is_some_and(|scene| {
        // Some room to the wall is kept.
        let margin = 0.1 * step.length() + 0.02 * viewpoint.pivot_distance;
        let direction = step.normalize_or_zero();
        let ray =
            Ray { origin: viewpoint.eye(), direction, t_min: 0.0, t_max: step.length() + margin };
        direction != Vec3::ZERO && scene.world.bvh.any_hit(&ray, |_| true)
    });
    if is_blocked {
        viewpoint.look_around(drag);
    } else {
        *viewpoint = moved;
    }
}

/// Does something with the surface under a click.
fn pick(rect: Rect, response: &Response, scope: &mut Scope<'_>, act: fn(&mut Viewpoint, Vec3)) {
    let (Some(at), Some(snapshot)) = (response.interact_pointer_pos(), scope.snapshot) else {
        return;
    };
    let request = &snapshot.request;
    let spot = look_at_place(&request.world, &request.view, place_of(rect, at));
    if let (Some(spot), Some(viewpoint)) = (spot, &mut scope.document.viewpoint) {
        let mut moved = viewpoint.clone();
        act(&mut moved, spot.position);
        scope.commands.push(Command::LookFrom(moved));
    }
}

/// Metres per second that suit the scene: a walk in a room, faster outdoors.
fn flying_speed(world: &crate::path::World) -> f32 {
    let (low, high) = world.bvh.bounds();
    (0.25 * (high - low).length()).clamp(0.05, 50.0)
}

/// Metres along right, up and forward that the keys held down ask for.
fn flight(context: &egui::Context, speed: f32) -> Option<Vec3> {
    context.input(|input| {
        if input.modifiers.command || input.modifiers.alt {
            return None;
        }
        let axis = |plus: Key, minus: Key| {
            f32::from(input.key_down(plus)) - f32::from(input.key_down(minus))
        };
        let direction = Vec3::new(axis(Key::D, Key::A), axis(Key::E, Key::Q), axis(Key::W, Key::S));
        let faster = if input.modifiers.shift { 4.0 } else { 1.0 };
        let seconds = input.stable_dt.min(0.1);
        (direction != Vec3::ZERO).then(|| direction.normalize() * speed * faster * seconds)
    })
}

/// A ring where the inspector stays.
fn pin(ui: &Ui, rect: Rect, interface: &Interface) {
    let Some(place) = interface.pinned.filter(|_| interface.tab == Tab::Inspect) else { return };
    let at = rect.min + Vec2::new(place.x, place.y) * rect.size();
    ui.painter().circle_stroke(at, 7.0, Stroke::new(3.0, Color32::from_black_alpha(160)));
    ui.painter().circle_stroke(at, 7.0, Stroke::new(1.5, theme::ACCENT));
}
