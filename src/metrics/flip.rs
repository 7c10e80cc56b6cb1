//! FLIP, the perceptual metric.

use nv_flip::{DEFAULT_PIXELS_PER_DEGREE, FlipImageRgb8, FlipPool};

use crate::image::Image;
use crate::tone::{ToneCurve, display_rgb8};

/// Mean LDR-FLIP error of both pictures through the same exposure and curve.
pub(super) fn mean(image: &Image, reference: &Image, exposure_ev: f32) -> Option<f64> {
    let display = |image: &Image| {
        let shown = display_rgb8(image, exposure_ev, ToneCurve::Aces);
        FlipImageRgb8::with_data(shown.width, shown.height, shown.pixels.as_flattened())
    };
    let errors = nv_flip::flip(display(reference), display(image), DEFAULT_PIXELS_PER_DEGREE);
    Some(f64::from(FlipPool::from_image(&errors).mean()))
}
