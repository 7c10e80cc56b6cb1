//! Conversion from the primaries an OpenEXR file declares to Rec.709.

use exr::math::Vec2;
use exr::meta::header::Header;
use glam::{DMat3, DVec2, DVec3, Mat3};

use super::exr_channels::Channels;
use crate::error::Notices;

/// The matrix to linear Rec.709 if the file says that its primaries are others.
pub(crate) fn rec709_conversion(
    header: &Header,
    channels: Channels,
    notices: &mut Notices,
) -> Option<Mat3> {
    let given = header.shared_attributes.chromaticities?;
    let point = |v: Vec2<f32>| DVec2::new(f64::from(v.0), f64::from(v.1));
    let given = [given.red, given.green, given.blue, given.white].map(point);
    let same = given.iter().zip(&REC709).all(|(a, b)| (*a - *b).abs().max_element() < 2e-3);
    if same || matches!(channels, Channels::Grey(_)) {
        return None;
    }
    // Primaries at the corners of the diagram: the pixels are XYZ, which knows no white of its own.
    let is_xyz = given[..3] == [DVec2::X, DVec2::Y, DVec2::ZERO];
    let neutral = header.own_attributes.adopted_neutral.map_or(given[3], point);
    let white = if is_xyz { REC709[3] } else { neutral };
    let matrix = xyz_from_rgb(REC709).inverse() * bradford(white, REC709[3]) * xyz_from_rgb(given);
    if !matrix.is_finite() {
        notices.add("the chromaticities of the file make no sense; it is read as Rec.709");
        return None;
    }
    notices.add("the colours of the file are converted to Rec.709 from its own primaries");
    Some(matrix.as_mat3())
}

/// Rec.709 primaries and white D65 as `xy`.
const REC709: [DVec2; 4] = [
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
