//! The map as a small picture, plain or with what is known of its tiles.

use std::sync::Arc;

use egui::{Color32, Pos2, Rect, Response, Sense, TextureHandle, TextureOptions, Ui, Vec2};

use crate::app::loader::LoadedMap;
use crate::app::screen::color_image;
use crate::app::small_maps::displayed;
use crate::image::Image;

/// Points of a small picture.
const SMALL: Vec2 = Vec2::new(48.0, 24.0);

/// Draws the map across the panel, turned by `turn` of a circle; it can be dragged.
pub(super) fn preview(ui: &mut Ui, map: &LoadedMap, turn: f32) -> Response {
    let (rect, response) = place(ui, Sense::drag());
    let texture = texture(ui, &map.preview);
    // What the map shows at u is seen at u + turn: two pieces that wrap around.
    let turn = turn.rem_euclid(1.0);
    let (left, right) = rect.split_left_right_at_x(rect.left() + rect.width() * turn);
    let painter = ui.painter_at(rect);
    let uv = |a: f32, b: f32| Rect::from_min_max(Pos2::new(a, 0.0), Pos2::new(b, 1.0));
    painter.image(texture.id(), left, uv(1.0 - turn, 1.0), Color32::WHITE);
    painter.image(texture.id(), right, uv(0.0, 1.0 - turn), Color32::WHITE);
    response
}

/// Draws the map, not turned, dimmed, as a ground for tiles; it can be clicked.
pub(super) fn ground(ui: &mut Ui, map: &LoadedMap) -> (Rect, Response) {
    let (rect, response) = place(ui, Sense::click());
    let texture = texture(ui, &map.preview);
    let uv = Rect::from_min_max(Pos2::ZERO, Pos2::new(1.0, 1.0));
    ui.painter_at(rect).image(texture.id(), rect, uv, Color32::from_gray(110));
    (rect, response)
}

/// A small picture of a map, for lists.
pub(super) fn small(texture: &TextureHandle) -> egui::Image<'static> {
    egui::Image::new((texture.id(), SMALL)).fit_to_exact_size(SMALL).corner_radius(2.0)
}

/// The part of `rect` that a tile covers.
pub(super) fn tile_rect(rect: Rect, (columns, rows): (u32, u32), tile: u32) -> Rect {
    let size = rect.size() / Vec2::new(columns as f32, rows as f32);
    let place = Vec2::new((tile % columns) as f32, (tile / columns) as f32);
    Rect::from_min_size(rect.min + place * size, size)
}

/// The tile at a place of `rect`.
pub(super) fn tile_at(rect: Rect, (columns, rows): (u32, u32), at: Pos2) -> Option<u32> {
    let place = (at - rect.min) / rect.size();
    let column = (place.x * columns as f32).floor();
    let row = (place.y * rows as f32).floor();
    let is_inside = (0.0..columns as f32).contains(&column) && (0.0..rows as f32).contains(&row);
    is_inside.then_some(row as u32 * columns + column as u32)
}

fn place(ui: &mut Ui, sense: Sense) -> (Rect, Response) {
    let width = ui.available_width();
    ui.allocate_exact_size(Vec2::new(width, 0.5 * width), sense)
}

/// The texture of a preview, made once and kept with the context until there is another.
fn texture(ui: &Ui, image: &Arc<Image>) -> TextureHandle {
    let id = egui::Id::unique("map preview");
    let kept: Option<(TextureHandle, Arc<Image>)> = ui.ctx().data(|data| data.get_temp(id));
    if let Some((texture, _)) = kept.filter(|(_, of)| Arc::ptr_eq(of, image)) {
        return texture;
    }
    let picture = color_image(&displayed(image));
    let texture = ui.ctx().load_texture("map", picture, TextureOptions::LINEAR);
    ui.ctx().data_mut(|data| data.insert_temp(id, (texture.clone(), Arc::clone(image))));
    texture
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_tile_is_found_in_its_own_rectangle() {
        let rect = Rect::from_min_size(Pos2::new(10.0, 20.0), Vec2::new(320.0, 160.0));
        for tile in 0..512 {
            let middle = tile_rect(rect, (32, 16), tile).center();
            assert_eq!(tile_at(rect, (32, 16), middle), Some(tile));
        }
        assert_eq!(tile_at(rect, (32, 16), Pos2::new(9.0, 30.0)), None);
    }
}
