//! FLIP, the perceptual metric.

use nv_flip::{DEFAULT_PIXELS_PER_DEGREE, FlipImageRgb8, FlipPool};

use crate::image::Image;
use crate::tone::{ToneCurve, display_rgb8};

/// LDR-FLIP error of each pixel, in `[0,1]`, and its mean, of both pictures through the same exposure and curve. `None` if
/// their sizes differ.
pub(crate) fn errors(
    image: &Image,
    reference: &Image,
    exposure_ev: f32,
) -> Option<(Vec<f32>, f64)> {
    if (image.width, image.height) != (reference.width, reference.height) {
        return None;
    }
    let display = |image: &Image| {
        let shown = display_rgb8(image, exposure_ev, ToneCurve::Aces);
        FlipImageRgb8::with_data(shown.width, shown.height, shown.pixels.as_flattened())
    };
    let errors = nv_flip::flip(display(reference), display(image), DEFAULT_PIXELS_PER_DEGREE);
    Some((errors.to_vec(), f64::from(FlipPool::from_image(&errors).mean())))
}
