//! Numbers of cells, where there is room for them.

use std::collections::BTreeMap;

use glam::Vec2;

/// A word at a place of the picture.
#[derive(Debug, Clone, PartialEq)]
pub(in crate::app) struct Label {
    /// Its middle, both coordinates in `[0,1]`.
    pub(in crate::app) place: Vec2,
    /// What it says.
    pub(in crate::app) text: String,
}

/// Half the width and height of a number as shares of the picture's width.
const ROOM: [f32; 2] = [0.016, 0.007];

/// The number of every cell that has room for it, as near to the cell's middle as can be; `cells`
/// are the picture's pixels, row by row.
pub(super) fn of_cells(cells: &[Option<u32>], width: u32) -> Vec<Label> {
    let width = width.max(1) as usize;
    let height = cells.len() / width;
    let room = ROOM.map(|share| ((share * width as f32).ceil() as usize).max(1));
    let place = |i: usize| Vec2::new((i % width) as f32 + 0.5, (i / width) as f32 + 0.5);
    let mut middles: BTreeMap<u32, (Vec2, f32)> = BTreeMap::new();
    for (i, cell) in cells.iter().enumerate().filter_map(|(i, cell)| Some((i, (*cell)?))) {
        let (sum, count) = middles.entry(cell).or_default();
        (*sum, *count) = (*sum + place(i), *count + 1.0);
    }
    let has_room = |i: usize, cell: u32| {
        let (x, y) = (i % width, i / width);
        let is_inside = |x: usize, y: usize| cells[y * width + x] == Some(cell);
        x >= room[0]
            && x + room[0] < width
            && y >= room[1]
            && y + room[1] < height
            && [x - room[0], x, x + room[0]]
                .iter()
                .all(|x| [y - room[1], y, y + room[1]].iter().all(|y| is_inside(*x, *y)))
    };
    let mut best: BTreeMap<u32, (f32, usize)> = BTreeMap::new();
    for (i, cell) in cells.iter().enumerate().filter_map(|(i, cell)| Some((i, (*cell)?))) {
        let (sum, count) = middles[&cell];
        let distance = place(i).distance_squared(sum / count);
        if best.get(&cell).is_none_or(|(least, _)| distance < *least) && has_room(i, cell) {
            best.insert(cell, (distance, i));
        }
    }
    let size = Vec2::new(width as f32, height.max(1) as f32);
    best.into_iter()
        .map(|(cell, (_, i))| Label { place: place(i) / size, text: cell.to_string() })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cells_with_room_are_numbered_in_their_middle() {
        // Two halves, and a strip between them that is too narrow.
        let cell = |x: u32| match x {
            0..49 => Some(7),
            49..51 => Some(8),
            _ => Some(9),
        };
        let cells: Vec<Option<u32>> = (0..100 * 60).map(|i| cell(i % 100)).collect();
        let labels = of_cells(&cells, 100);
        let texts: Vec<&str> = labels.iter().map(|label| label.text.as_str()).collect();
        assert_eq!(texts, ["7", "9"]);
        assert!(labels[0].place.distance(Vec2::new(0.245, 0.5)) < 0.02, "{labels:?}");
    }
}
