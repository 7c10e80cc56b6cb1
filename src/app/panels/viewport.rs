//! The picture.

use std::sync::Arc;

use egui::{
    Align2, CentralPanel, Color32, CursorIcon, FontId, Pos2, Rect, Sense, Shape, Stroke,
    StrokeKind, Ui, Vec2,
};

use super::gestures;
use super::scope::Scope;
use crate::app::comparison::AMPLIFIED;
use crate::app::display::Display;
use crate::app::drag::{Drag, Step};
use crate::app::dropped::Dropped;
use crate::app::interface::{Interface, Tab};
use crate::app::presenter::Shown;
use crate::app::screen::{Developed, Recipe};
use crate::app::speed_up::SpeedUp;
use crate::app::theme;
use crate::app::worker::{Activity, SessionSnapshot, Snapshot};
use crate::app::zoom::Zoom;
use crate::develop::{DevelopSettings, LinearPicture};
use crate::render::{Crop, View};

/// Draws the picture and takes gestures; the room it has.
pub(in crate::app) fn show(ui: &mut Ui, scope: &mut Scope<'_>) -> Rect {
    let panel = CentralPanel::default().frame(egui::Frame::new()).show(ui, |ui| {
        let area = ui.max_rect();
        let scale = ui.ctx().pixels_per_point();
        measure(ui, area, scope);
        let response = ui.interact(area, ui.scope_id().with("picture"), Sense::click_and_drag());
        let tone = scope.assets.looks.tone(&scope.document.look);
        let opacity = scope.interface.overlay_opacity;
        let settings = scope.display.settings(scope.document, tone, opacity);
        let shown = scope.display.shown.clone();
        let Some((shown, settings)) = shown.as_deref().zip(settings) else {
            ui.painter().rect_filled(area, 0.0, theme::BACKGROUND);
            return waiting(ui, area, scope.assets.loader.busy_with().next().is_some());
        };
        let places = Places::of((area, scale), shown, scope);
        let (whole, rect) = (places.whole, places.rect);
        let compared = shown.order.compared.as_ref();
        let ground = if compared.is_some() { rect } else { whole };
        let is_part = shown.order.snapshot.request.view.crop.is_some();
        surround(ui, area, if is_part { Rect::NOTHING } else { ground.intersect(rect) });
        picture(ui, (ground, rect), shown, settings.clone(), scope);
        labels(ui, rect, shown);
        let seen = rect.intersect(area);
        let mut handle = Rect::NOTHING;
        if let Some(other) = &shown.other {
            handle = beside(ui, &places, (shown, other), settings, scope);
        } else {
            scope.display.textures.other = None;
            if let Some(compared) = compared.filter(|compared| compared.is_difference) {
                difference_label(ui, seen, &compared.names, shown.difference);
            }
        }
        gestures::show(ui, (whole, rect), &response, handle, scope);
        gestures::zoom(ui, (area, whole), &response, scope);
        pin(ui, rect, scope.interface);
    });
    let area = panel.response.rect;
    what_would_open(ui, area);
    area
}

/// Where things lie.
struct Places {
    /// The room, with its pixels for a point.
    room: (Rect, f32),
    /// The whole of which a part may be shown.
    whole: Rect,
    /// What is shown.
    rect: Rect,
    /// Where the whole would fit.
    fitting: Rect,
    zoom: Zoom,
    /// Moves the magnified picture's corner onto one of the screen's pixels.
    shift: Vec2,
}

impl Places {
    /// Of what is shown in a room; the interface is told how large that would fit.
    fn of((area, scale): (Rect, f32), shown: &Shown, scope: &mut Scope<'_>) -> Self {
        let snapshot = scope.rendering.snapshot.as_ref().unwrap_or(&shown.order.snapshot);
        let view = &snapshot.request.view;
        let (fitting, rect) = match &shown.order.compared {
            // A kept picture may be of another shape, or of a part.
            Some(compared) => kept_rects((area, scale), shown.picture.size(), compared.regions[1]),
            None => {
                let whole = fitted((area, scale), view.whole_size());
                let view = &shown.order.snapshot.request.view;
                let rect = match view.crop {
                    Some(crop) => part_rect(middle_rect(whole, crop.whole), view, crop),
                    None => middle_rect(whole, shown.picture.size()),
                };
                (whole, rect)
            }
        };
        scope.interface.fitting_pixels = Some(fitting.width() * scale);
        let zoom = scope.interface.zoom;
        let corner = zoom.of(area, fitting, fitting).min.to_vec2() * scale;
        let shift = if zoom.is_some() { (corner.round() - corner) / scale } else { Vec2::ZERO };
        let fits = Self { room: (area, scale), whole: fitting, rect, fitting, zoom, shift };
        Self { whole: fits.zoomed(fitting), rect: fits.zoomed(rect), ..fits }
    }

    /// Where something lies that would lie here if all fitted.
    fn zoomed(&self, rect: Rect) -> Rect {
        self.zoom.of(self.room.0, self.fitting, rect).translate(self.shift)
    }
}

/// Draws the other picture at the left of the line that wipes it, and what both are called; where the line can be
/// taken hold of.
fn beside(
    ui: &Ui,
    places: &Places,
    (shown, other): (&Shown, &LinearPicture),
    settings: DevelopSettings,
    scope: &mut Scope<'_>,
) -> Rect {
    let number = other.is_live.then_some(shown.order.snapshot.number);
    let recipe = Recipe { picture: other.clone(), overlay: None, settings, number };
    let changes = changes(ui, other, scope);
    let Display { textures, screen, .. } = &mut *scope.display;
    let source = Developed::update(&mut textures.other, screen, recipe, changes);
    let seen = places.rect.intersect(places.room.0);
    let compared = shown.order.compared.as_ref();
    let of_left = compared.map_or(places.rect, |compared| {
        let (of_whole, part) = kept_rects(places.room, other.size(), compared.regions[0]);
        if !is_alike(of_whole, places.fitting) {
            // Beside another shape nothing is to be seen of what lies under it.
            let hidden = left_of(seen, seen, scope.interface.wipe);
            ui.painter().rect_filled(hidden, 0.0, theme::BACKGROUND);
        }
        places.zoomed(part)
    });
    let shape = source.shape(of_left, has_squares(other, shown, scope));
    let handle = wipe(ui, (seen, of_left), shape, scope.interface);
    match compared {
        Some(compared) => wipe_labels(ui, seen, &compared.names, None),
        None => split_labels(ui, seen, scope),
    }
    handle
}

/// Says what difference is shown, and how large it is.
fn difference_label(ui: &Ui, seen: Rect, [left, right]: &[String; 2], apart: Option<f64>) {
    let percent = apart.map(|apart| format!(", {:.1} % (RMS)", 100.0 * apart)).unwrap_or_default();
    let text = format!("{left} and {right}: difference × {AMPLIFIED:.0}{percent}");
    let at = Pos2::new(seen.center().x, seen.top() + 14.0);
    theme::badges(ui, &[(at, Align2::CENTER_TOP, &text, theme::TEXT)]);
}

/// Fills what the picture leaves of its room, and no more: software is slow to fill.
fn surround(ui: &Ui, area: Rect, covered: Rect) {
    // A bit under its edges, which lie between pixels.
    let covered = covered.shrink(1.0);
    // What lies above nothing is all.
    let is_met = covered.is_positive() && covered.intersects(area);
    let covered = if is_met { covered } else { Rect::from_min_max(area.max, area.max) };
    let rows = area.y_range().intersection(covered.y_range());
    let bars = [
        area.with_max_y(covered.top()),
        area.with_min_y(covered.bottom()),
        Rect::from_x_y_ranges(area.left()..=covered.left(), rows),
        Rect::from_x_y_ranges(covered.right()..=area.right(), rows),
    ];
    for bar in bars.into_iter().filter(|bar| bar.is_positive()) {
        ui.painter().rect_filled(bar, 0.0, theme::BACKGROUND);
    }
}

/// What happens if the files that are held over the window are let go.
fn what_would_open(ui: &Ui, area: Rect) {
    let paths: Vec<_> = ui.input(|input| {
        input.raw.hovered_files.iter().filter_map(|file| file.path.clone()).collect()
    });
    if paths.is_empty() {
        return;
    }
    let Dropped { scene, map, .. } = Dropped::of(&paths);
    let names: Vec<_> = scene.iter().chain(&map).map(|name| theme::file_name(name)).collect();
    let painter = ui.painter();
    painter.rect_filled(area, 0.0, Color32::from_black_alpha(150));
    painter.rect_stroke(area.shrink(8.0), 6.0, Stroke::new(2.0, theme::ACCENT), StrokeKind::Inside);
    let text = format!("Drop to open {}", names.join(" and "));
    let font = FontId::proportional(18.0);
    painter.text(area.center(), Align2::CENTER_CENTER, text, font, theme::TEXT);
}

/// Notes how large a picture may be. A panel that opens leaves it as it is: it would begin anew, and
/// what one wants to look at would be gone.
fn measure(ui: &Ui, area: Rect, scope: &mut Scope<'_>) {
    let points = ui.ctx().pixels_per_point();
    let pixels = |size: Vec2| [size.x, size.y].map(|side| (side * points).round().max(1.0) as u32);
    let window = Some((pixels(ui.ctx().content_rect().size()), scope.interface.panels));
    if scope.interface.viewport_of != window || scope.display.shown.is_none() {
        scope.interface.viewport_of = window;
        scope.interface.viewport_pixels = Some(pixels(area.size()));
    }
}

/// Where a kept picture and the whole that it may be a part of lie.
fn kept_rects(room: (Rect, f32), size: [u32; 2], region: Option<[f32; 4]>) -> (Rect, Rect) {
    let Some([left, top, right, bottom]) = region else {
        let whole = fitted(room, size);
        return (whole, whole);
    };
    let whole = |pixels: u32, low: f32, high: f32| (pixels as f32 / (high - low)).round() as u32;
    let whole = fitted(room, [whole(size[0], left, right), whole(size[1], top, bottom)]);
    let at = |x: f32, y: f32| whole.min + Vec2::new(x, y) * whole.size();
    (whole, Rect::from_min_max(at(left, top), at(right, bottom)))
}

/// Whether two rectangles are the same but for rounding.
fn is_alike(a: Rect, b: Rect) -> bool {
    (a.min - b.min).length() + (a.max - b.max).length() < 4.0
}

/// What of a rectangle is left of the line of a wipe across `rect`.
fn left_of(all: Rect, rect: Rect, wipe: f32) -> Rect {
    all.with_max_x((rect.left() + rect.width() * wipe).max(all.left()))
}

/// The picture as large as fits into an area with so many pixels per point, in its own shape; its pixels are those of
/// the screen where it has about as many, or all would be blurred.
fn fitted((area, pixels_per_point): (Rect, f32), [width, height]: [u32; 2]) -> Rect {
    let size = Vec2::new(width as f32, height as f32);
    let scale = (area.width() / size.x).min(area.height() / size.y);
    let rect = Rect::from_center_size(area.center(), size * scale);
    let room = area.size() * pixels_per_point - size;
    if room.min_elem() <= -1.0 || room.abs().min_elem() >= 1.0 {
        return rect;
    }
    let corner = (rect.min.to_vec2() * pixels_per_point).round().to_pos2();
    Rect::from_min_size(corner, size) / pixels_per_point
}

/// Where a picture that may be from before the view got another shape lies beside the whole: the field of view is
/// vertical, so that they share their middle.
fn middle_rect(whole: Rect, [width, height]: [u32; 2]) -> Rect {
    let size = Vec2::new(whole.height() * width as f32 / height as f32, whole.height());
    // Small pictures are of whole pixels.
    let rounding = 1.0 / width as f32 + 1.0 / height as f32;
    let is_alike = (size.x / whole.width() - 1.0).abs() < 0.01 + rounding;
    if is_alike { whole } else { Rect::from_center_size(whole.center(), size) }
}

/// Where in the whole picture's rectangle the view's part of it lies.
fn part_rect(whole: Rect, view: &View, crop: Crop) -> Rect {
    let [width, height] = crop.whole.map(|pixels| pixels as f32);
    let scale = whole.size() / Vec2::new(width, height);
    let corner = Vec2::new(crop.corner[0] as f32, crop.corner[1] as f32);
    let size = Vec2::new(view.width as f32, view.height as f32);
    Rect::from_min_size(whole.min + corner * scale, size * scale)
}

/// Draws the picture; a part lies on the last whole one, which steps back until the region is left.
fn picture(
    ui: &Ui,
    (whole, rect): (Rect, Rect),
    shown: &Shown,
    settings: DevelopSettings,
    scope: &mut Scope<'_>,
) {
    let painter = ui.painter();
    let has_squares = has_squares(&shown.picture, shown, scope);
    let number = shown.picture.is_live.then_some(shown.order.snapshot.number);
    let overlay = shown.painted.as_ref().map(|painted| painted.colors.clone());
    let recipe = Recipe { picture: shown.picture.clone(), overlay, settings, number };
    let changes = changes(ui, &shown.picture, scope);
    let request = &shown.order.snapshot.request;
    let latest = shown.order.latest();
    let of = (Arc::clone(&latest.world.geometry), latest.view.camera.clone());
    let Display { textures, screen, .. } = &mut *scope.display;
    if request.view.crop.is_none() {
        textures.main_of = (!shown.order.covers_now()).then_some(of);
        let source = Developed::update(&mut textures.main, screen, recipe, changes);
        ui.painter_at(whole).add(source.shape(rect, has_squares));
        textures.part = None;
        return;
    }
    textures.main.take_if(|_| {
        let main_of = textures.main_of.as_ref();
        main_of.is_none_or(|main_of| !Arc::ptr_eq(&main_of.0, &of.0) || !main_of.1.sees_like(&of.1))
    });
    let is_left = scope.document.region.is_none();
    if let Some(main) = &textures.main {
        let rect = middle_rect(whole, main.display.size());
        ui.painter_at(whole).add(main.source.shape(rect, has_squares));
        if !is_left {
            painter.rect_filled(whole, 0.0, Color32::from_black_alpha(165));
        }
    }
    let source = Developed::update(&mut textures.part, screen, recipe, changes);
    painter.add(source.shape(rect, has_squares));
    if !is_left {
        painter.rect_stroke(rect, 0.0, Stroke::new(1.0, theme::ACCENT), StrokeKind::Outside);
    }
}

/// Whether a picture's pixels are seen as such: of one that is smaller than it will be they would be others.
fn has_squares(picture: &LinearPicture, shown: &Shown, scope: &Scope<'_>) -> bool {
    let view = &shown.order.snapshot.request.view;
    let magnification = scope.interface.magnification(scope.document.size);
    magnification.is_some_and(|times| times >= 1.9) && picture.size() == [view.width, view.height]
}

/// Whether a picture is another one in every frame; then there is a next frame. Software would do
/// nothing else than draw: there it changes with the snapshots.
fn changes(ui: &Ui, picture: &LinearPicture, scope: &Scope<'_>) -> bool {
    let is_idle =
        |snapshot: &Snapshot| matches!(snapshot.activity, Activity::Paused | Activity::Done);
    let changes = picture.is_live
        && !scope.display.screen.gpu().facts().is_software()
        && !scope.rendering.snapshot.as_deref().is_none_or(is_idle);
    if changes {
        ui.ctx().request_repaint();
    }
    changes
}

/// Writes what the overlay has to say.
fn labels(ui: &Ui, rect: Rect, shown: &Shown) {
    let painter = ui.painter_at(rect);
    let font = FontId::proportional((rect.width() / 85.0).clamp(7.0, 12.0));
    for label in shown.painted.iter().flat_map(|painted| &painted.labels) {
        let at = rect.min + Vec2::new(label.place.x, label.place.y) * rect.size();
        painter.text(at, Align2::CENTER_CENTER, &label.text, font.clone(), Color32::BLACK);
    }
}

fn waiting(ui: &Ui, area: Rect, is_loading: bool) {
    let text = if is_loading { "Loading…" } else { "The first samples are on their way…" };
    let font = FontId::proportional(15.0);
    ui.painter().text(area.center(), Align2::CENTER_CENTER, text, font, theme::QUIET);
}

/// The other picture, which lies in a rectangle of its own, left of a line across `rect` that can be dragged;
/// where that can be taken hold of.
fn wipe(ui: &Ui, (rect, of_left): (Rect, Rect), picture: Shape, interface: &mut Interface) -> Rect {
    let x = rect.left() + rect.width() * interface.wipe;
    let left = left_of(of_left, rect, interface.wipe);
    ui.painter_at(left.intersect(ui.max_rect())).add(picture);
    let handle =
        Rect::from_center_size(Pos2::new(x, rect.center().y), Vec2::new(14.0, rect.height()));
    let response = ui.interact(handle, ui.scope_id().with("wipe"), Sense::drag());
    let is_free = !interface.is_modal();
    let drag = &mut interface.wipe_drag;
    let seen = handle.intersect(ui.clip_rect());
    let steps = Drag::follow_in(drag, ui, 0.0, |at| is_free && seen.contains(at));
    let ended = steps.iter().find_map(Step::end);
    let held = drag.and_then(|drag| drag.span()).map(|[_, at]| at);
    if let Some(at) = held.or(ended) {
        interface.wipe = ((at.x - rect.left()) / rect.width()).clamp(0.0, 1.0);
    }
    let is_active = response.hovered() || held.is_some();
    if is_active {
        ui.ctx().set_cursor_icon(CursorIcon::ResizeHorizontal);
    }
    let line = [Pos2::new(x, rect.top()), Pos2::new(x, rect.bottom())];
    let color = if is_active { theme::ACCENT } else { Color32::from_white_alpha(200) };
    ui.painter().line_segment(line, Stroke::new(1.5, color));
    ui.painter().circle_filled(Pos2::new(x, rect.center().y), 6.0, color);
    handle
}

/// Names both sides, and what is to be said of them.
fn wipe_labels(ui: &Ui, rect: Rect, [left, right]: &[String; 2], middle: Option<&str>) {
    let at = |x: f32| Pos2::new(x, rect.top() + 14.0);
    let mut badges: Vec<(Pos2, Align2, &str, Color32)> = vec![
        (at(rect.left() + 14.0), Align2::LEFT_TOP, left, theme::TEXT),
        (at(rect.right() - 14.0), Align2::RIGHT_TOP, right, theme::TEXT),
    ];
    badges
        .extend(middle.map(|text| (at(rect.center().x), Align2::CENTER_TOP, text, theme::ACCENT)));
    theme::badges(ui, &badges);
}

/// How far the plain method and the chosen one have come.
fn split_labels(ui: &Ui, rect: Rect, scope: &Scope<'_>) {
    let Some(snapshot) = &scope.rendering.snapshot else { return };
    let label = |name: &str, take: &SessionSnapshot| {
        let (samples, noise) = (theme::samples(take.mean_samples()), 100.0 * take.noise);
        let noise = if noise.is_finite() { format!(", noise {noise:.1} %") } else { String::new() };
        format!("{name}: {samples} samples{noise}")
    };
    let plain = snapshot.plain.as_ref().map_or_else(String::new, |plain| label("plain", plain));
    let name = crate::app::convergence::name_of(snapshot.main.sampling);
    let speed_up = scope.rendering.speed_up.as_ref().map(|SpeedUp { ratio, factor }| {
        format!("{ratio:.2} × as fast ({:.2} to {:.2})", ratio / factor, ratio * factor)
    });
    wipe_labels(ui, rect, &[plain, label(&name, &snapshot.main)], speed_up.as_deref());
}

/// A ring where the inspector stays.
fn pin(ui: &Ui, rect: Rect, interface: &Interface) {
    let Some(place) = interface.pinned.filter(|_| interface.tab == Tab::Inspect) else { return };
    let at = rect.min + Vec2::new(place.x, place.y) * rect.size();
    ui.painter().circle_stroke(at, 7.0, Stroke::new(3.0, Color32::from_black_alpha(160)));
    ui.painter().circle_stroke(at, 7.0, Stroke::new(1.5, theme::ACCENT));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn kept_pictures_keep_their_shape_and_parts_their_place() {
        let area = Rect::from_min_size(Pos2::new(10.0, 20.0), Vec2::new(400.0, 200.0));
        let (whole, part) = kept_rects((area, 1.0), [100, 100], None);
        assert!(
            whole == part && whole == Rect::from_center_size(area.center(), Vec2::splat(200.0))
        );
        // The right half of a picture of 100 x 50 pixels.
        let (whole, part) = kept_rects((area, 1.0), [50, 50], Some([0.5, 0.0, 1.0, 1.0]));
        assert_eq!(whole, area);
        assert_eq!(part, area.with_min_x(210.0));
        assert_eq!(left_of(area, part, 0.25).right(), 260.0);
        // From before the view got wider or narrower, and a small one of the same.
        assert_eq!(middle_rect(area, [100, 100]).size(), Vec2::splat(200.0));
        assert_eq!(middle_rect(area, [300, 100]).size(), Vec2::new(600.0, 200.0));
        assert_eq!(middle_rect(area, [51, 25]), area);
    }

    #[test]
    fn pixels_of_a_picture_of_the_room_s_size_are_those_of_the_screen() {
        let area = Rect::from_min_size(Pos2::new(10.2, 20.4), Vec2::new(300.3, 200.9));
        let wide = Rect::from_min_size(area.min, Vec2::new(3840.1, 999.6));
        for (area, pixels_per_point, size) in [
            (area, 1.0, [300, 200]),
            (area, 2.0, [600, 401]),
            (area, 1.5, [450, 301]),
            (wide, 1.0, [3840, 1000]),
        ] {
            let pixels = fitted((area, pixels_per_point), size) * pixels_per_point;
            let whole = |v: f32| (v - v.round()).abs() < 1e-3;
            assert!(whole(pixels.min.x) && whole(pixels.min.y), "{pixels:?}");
            let missing = pixels.size() - Vec2::new(size[0] as f32, size[1] as f32);
            assert!(missing.length() < 1e-3, "{pixels:?}");
        }
        assert_eq!(fitted((area, 1.0), [150, 100]).width(), 300.3);
    }
}
