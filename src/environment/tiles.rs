//! The map cut into equal-size tiles, fixed to the map: a patch's tile is found in constant time.

use std::ops::Range;

/// A grid of tiles over a map of `width` x `height` patches (see [`super::patches`]). Tile edges lie on
/// patch edges: column `i` begins at patch `floor(i * width / columns)`, rows likewise, so tiles differ
/// by one patch at most.
#[derive(Debug, Clone)]
pub(crate) struct TileGrid {
    width: u32,
    columns: u32,
    rows: u32,
    /// Made once: finding them takes divisions.
    tiles: Vec<TilePatches>,
    column_of_patch: Vec<u32>,
    row_of_patch: Vec<u32>,
}

impl TileGrid {
    /// Cuts the map; there are never more tiles than patches along an axis, and at least one.
    pub(crate) fn new(width: u32, height: u32, columns: u32, rows: u32) -> Self {
        let column_edges = edges(width, columns);
        let row_edges = edges(height, rows);
        let tile = |x: &[u32], y: &[u32]| TilePatches { x: x[0]..x[1], y: y[0]..y[1] };
        let row = |y| column_edges.windows(2).map(move |x| tile(x, y));
        let tiles = row_edges.windows(2).flat_map(row).collect();
        Self {
            width,
            columns: column_edges.len() as u32 - 1,
            rows: row_edges.len() as u32 - 1,
            tiles,
            column_of_patch: owners(&column_edges),
            row_of_patch: owners(&row_edges),
        }
    }

    /// Columns and rows.
    pub(crate) fn size(&self) -> (u32, u32) {
        (self.columns, self.rows)
    }

    /// Number of tiles; tile `t` is in row `t / columns`, column `t % columns`.
    pub(crate) fn count(&self) -> u32 {
        self.columns * self.rows
    }

    /// The tile that holds patch `(x, y)`.
    pub(crate) fn tile_of_patch(&self, x: u32, y: u32) -> u32 {
        self.row_of_patch[y as usize] * self.columns + self.column_of_patch[x as usize]
    }

    /// Columns and rows of patches of a tile.
    pub(crate) fn patches(&self, tile: u32) -> &TilePatches {
        &self.tiles[tile as usize]
    }

    /// All patches of the map.
    pub(crate) fn whole(&self) -> TilePatches {
        TilePatches { x: 0..self.width, y: 0..self.row_of_patch.len() as u32 }
    }

    /// Where a tile's patches begin when tiles are stored one after another, row of tiles after row.
    pub(crate) fn first_patch(&self, patches: &TilePatches) -> usize {
        patches.y.start as usize * self.width as usize + patches.x.start as usize * patches.y.len()
    }

    /// Bytes the grid's look-up arrays take.
    pub(crate) fn memory_bytes(&self) -> usize {
        size_of_val(&self.tiles[..])
            + size_of_val(&self.column_of_patch[..])
            + size_of_val(&self.row_of_patch[..])
    }
}

/// The patches of one tile, never empty.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct TilePatches {
    /// Columns.
    pub(crate) x: Range<u32>,
    /// Rows.
    pub(crate) y: Range<u32>,
}

impl TilePatches {
    /// Number of patches.
    pub(crate) fn len(&self) -> usize {
        self.x.len() * self.y.len()
    }
}

fn edges(patches: u32, tiles: u32) -> Vec<u32> {
    let tiles = tiles.clamp(1, patches);
    (0..=tiles).map(|i| (u64::from(i) * u64::from(patches) / u64::from(tiles)) as u32).collect()
}

/// Which interval each patch lies in.
fn owners(edges: &[u32]) -> Vec<u32> {
    let lengths = edges.windows(2).map(|edge| (edge[1] - edge[0]) as usize);
    (0..).zip(lengths).flat_map(|(tile, length)| std::iter::repeat_n(tile, length)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_patch_lies_in_its_own_tile_and_tiles_are_equal_to_a_patch() {
        for (width, height, columns, rows) in
            [(1, 1, 32, 16), (2, 1, 32, 16), (3, 2, 32, 16), (100, 50, 32, 16), (65, 33, 7, 1)]
        {
            let grid = TileGrid::new(width, height, columns, rows);
            assert_eq!(grid.size(), (columns.min(width), rows.min(height)));
            let mut patches = 0;
            for tile in 0..grid.count() {
                let t = grid.patches(tile);
                assert_eq!(grid.first_patch(t), if tile == 0 { 0 } else { patches });
                patches += t.len();
                assert!(t.x.len().abs_diff((width / grid.size().0) as usize) <= 1);
                assert!(t.y.len().abs_diff((height / grid.size().1) as usize) <= 1);
                for y in t.y.clone() {
                    for x in t.x.clone() {
                        assert_eq!(grid.tile_of_patch(x, y), tile);
                    }
                }
            }
            assert_eq!(patches, (width * height) as usize);
        }
    }
}
