//! Conversion from the primaries a file declares to Rec.709.

use glam::{DMat3, DVec2, DVec3, Mat3, Vec3};

use crate::error::Notices;

/// Red, green, blue and white as `xy`.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Primaries(pub(crate) [DVec2; 4]);

impl Primaries {
    /// Luminance of its red, green and blue; that of Rec.709 if these make no sense.
    pub(crate) fn luminance(self) -> Vec3 {
        let weights = |primaries| xyz_from_rgb(primaries).row(1).as_vec3();
        let own = weights(self.0);
        if own.is_finite() && own.y != 0.0 { own } else { weights(REC709) }
    }

    /// Whether these are others' but for rounding.
    pub(crate) fn is(self, others: [DVec2; 4]) -> bool {
        self.0.iter().zip(&others).all(|(a, b)| (*a - *b).abs().max_element() < 2e-3)
    }
}

/// The matrix to linear Rec.709 of a file that says that its primaries are others, and perhaps which white is
/// neutral in it.
pub(crate) fn rec709_conversion(
    given: Primaries,
    neutral: Option<DVec2>,
    notices: &mut Notices,
) -> Option<Mat3> {
    if given.is(REC709) {
        return None;
    }
    let Primaries(given) = given;
    // Primaries at the corners of the diagram: the pixels are XYZ, which knows no white of its own.
    let is_xyz = given[..3] == [DVec2::X, DVec2::Y, DVec2::ZERO];
    let white = if is_xyz { REC709[3] } else { neutral.unwrap_or(given[3]) };
    let matrix = xyz_from_rgb(REC709).inverse() * bradford(white, REC709[3]) * xyz_from_rgb(given);
    if !matrix.is_finite() {
        notices.add("the chromaticities of the file make no sense; it is read as Rec.709");
        return None;
    }
    notices.add("the colours of the file are converted to Rec.709 from its own primaries");
    Some(matrix.as_mat3())
}

/// Rec.709 primaries and white D65 as `xy`.
pub(crate) const REC709: [DVec2; 4] = [
    DVec2::new(0.64, 0.33),
    DVec2::new(0.30, 0.60),
    DVec2::new(0.15, 0.06),
    DVec2::new(0.3127, 0.3290),
];

/// `XYZ` of `Y = 1` at a chromaticity.
fn xyz_of(xy: DVec2) -> DVec3 {
    DVec3::new(xy.x, xy.y, 1.0 - xy.x - xy.y) / xy.y
}

/// XYZ from RGB of given primaries and white (SMPTE RP 177-1993).
fn xyz_from_rgb([r, g, b, white]: [DVec2; 4]) -> DMat3 {
    let column = |xy: DVec2| DVec3::new(xy.x, xy.y, 1.0 - xy.x - xy.y);
    let primaries = DMat3::from_cols(column(r), column(g), column(b));
    primaries * DMat3::from_diagonal(primaries.inverse() * xyz_of(white))
}

/// Bradford chromatic adaptation of XYZ between two whites (Lindbloom, "Chromatic Adaptation").
fn bradford(from: DVec2, to: DVec2) -> DMat3 {
    let cone = DMat3::from_cols_array(&[
        0.8951, -0.7502, 0.0389, 0.2664, 1.7135, -0.0685, -0.1614, 0.0367, 1.0296,
    ]);
    let gain = (cone * xyz_of(to)) / (cone * xyz_of(from));
    cone.inverse() * DMat3::from_diagonal(gain) * cone
}

#[cfg(test)]
mod tests {
    use super::*;

    fn assert_near(got: DMat3, want_rows: [[f64; 3]; 3], tolerance: f64) {
        let want = DMat3::from_cols_array_2d(&want_rows).transpose();
        assert!(got.abs_diff_eq(want, tolerance), "{got} is not {want}");
    }

    #[test]
    fn rec709_and_its_inverse_are_the_published_matrices() {
        let published = [
            [0.412_390_8, 0.357_584_3, 0.180_480_8],
            [0.212_639_0, 0.715_168_7, 0.072_192_3],
            [0.019_330_8, 0.119_194_8, 0.950_532_2],
        ];
        assert_near(xyz_from_rgb(REC709), published, 1e-6);
        let product = crate::color::REC709_FROM_XYZ.as_dmat3() * xyz_from_rgb(REC709);
        assert!(product.abs_diff_eq(DMat3::IDENTITY, 1e-5), "{product}");
    }

    /// Lindbloom's table, whites by their tristimulus values to four digits.
    #[test]
    fn bradford_from_d50_to_d65() {
        let published = [
            [0.955_576_6, -0.023_039_3, 0.063_163_6],
            [-0.028_289_5, 1.009_941_6, 0.021_007_7],
            [0.012_298_2, -0.020_483_0, 1.329_909_8],
        ];
        assert_near(bradford(DVec2::new(0.345_7, 0.358_5), REC709[3]), published, 1e-3);
    }
}
