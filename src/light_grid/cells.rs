//! Cells of the Light Grid: from a point to its cell.

use glam::Vec3;

use crate::math::uv_from_direction;

/// The face of points in a medium, after the six of surfaces.
pub const MEDIUM_FACE: u32 = 6;

/// A uniform spherical grid around the camera, optionally split by the direction a surface faces.
///
/// The talk's grid has no faces. *Measured* (design study): six faces and a cosine weight give nearly the whole
/// gain over it in direct light, because a floor and a wall in one cell see different tiles.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SphericalGrid {
    /// World position of the grid's centre in metres; the camera when learning started.
    pub center: Vec3,
    /// Cells around the horizon.
    pub columns: u32,
    /// Cells from +Y to -Y.
    pub rows: u32,
    /// Whether a cell is split six-fold by the normal's dominant axis.
    pub faces: bool,
    /// Whether points in a medium have a face of their own; without faces they share the only one.
    pub medium: bool,
}

impl SphericalGrid {
    /// Number of faces a cell is split into: 1, 6, or 7 with that of the medium.
    pub fn face_count(&self) -> u32 {
        if self.faces { 6 + u32::from(self.medium) } else { 1 }
    }

    /// Number of cells, faces included.
    pub fn cell_count(&self) -> u32 {
        self.columns * self.rows * self.face_count()
    }

    /// Cell of a surface point at `position` whose unit normal on the lit side is `normal`.
    ///
    /// Cells are numbered face by face, then row by row.
    pub fn cell_of(&self, position: Vec3, normal: Vec3) -> u32 {
        self.cell_on_face(position, if self.faces { dominant_face(normal) } else { 0 })
    }

    /// Cell of a point in a medium.
    pub fn cell_in_medium(&self, position: Vec3) -> u32 {
        self.cell_on_face(position, if self.faces && self.medium { MEDIUM_FACE } else { 0 })
    }

    #[inline]
    fn cell_on_face(&self, position: Vec3, face: u32) -> u32 {
        // Not normalised: only its angles are used.
        let uv = uv_from_direction(position - self.center);
        // `as` saturates, so that rounding (or a NaN position) can never leave the grid.
        let column = ((uv.x * self.columns as f32) as u32).min(self.columns - 1);
        let row = ((uv.y * self.rows as f32) as u32).min(self.rows - 1);
        (face * self.rows + row) * self.columns + column
    }

    /// Face, row and column of a cell.
    pub fn coordinates(&self, cell: u32) -> (u32, u32, u32) {
        (cell / (self.columns * self.rows), cell / self.columns % self.rows, cell % self.columns)
    }

    /// Unit direction from the centre to the middle of a cell.
    pub fn direction_of(&self, cell: u32) -> Vec3 {
        let (_, row, column) = self.coordinates(cell);
        crate::math::direction_from_uv(glam::Vec2::new(
            (column as f32 + 0.5) / self.columns as f32,
            (row as f32 + 0.5) / self.rows as f32,
        ))
    }
}

/// Axis of the largest component of a vector: 0 and 1 are +X and -X, then Y, then Z.
pub fn dominant_face(normal: Vec3) -> u32 {
    let a = normal.abs();
    let axis = if a.x >= a.y && a.x >= a.z {
        0
    } else if a.y >= a.z {
        1
    } else {
        2
    };
    2 * axis + u32::from(normal[axis as usize] < 0.0)
}

/// Unit axis of a surface's face; inverse of [`dominant_face`].
pub fn face_axis(face: u32) -> Vec3 {
    let axis = [Vec3::X, Vec3::Y, Vec3::Z][(face / 2) as usize];
    if face.is_multiple_of(2) { axis } else { -axis }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_middle_of_every_cell_is_in_that_cell() {
        let grid = SphericalGrid {
            center: Vec3::new(1.0, -2.0, 3.0),
            columns: 64,
            rows: 32,
            faces: true,
            medium: true,
        };
        for cell in 0..grid.cell_count() {
            let (face, _, _) = grid.coordinates(cell);
            let point = grid.center + 7.5 * grid.direction_of(cell);
            let found = match face {
                MEDIUM_FACE => grid.cell_in_medium(point),
                _ => grid.cell_of(point, face_axis(face)),
            };
            assert_eq!(found, cell);
        }
    }

    #[test]
    fn odd_points_stay_inside_the_grid() {
        let grid =
            SphericalGrid { center: Vec3::ZERO, columns: 64, rows: 32, faces: true, medium: false };
        for position in [
            Vec3::ZERO,
            Vec3::Y,
            -Vec3::Y,
            -Vec3::X,
            Vec3::NAN,
            Vec3::splat(f32::MAX),
            Vec3::splat(1e-40),
        ] {
            for normal in [Vec3::ZERO, Vec3::NAN, -Vec3::Z, Vec3::ONE] {
                assert!(grid.cell_of(position, normal) < grid.cell_count());
            }
        }
    }
}
