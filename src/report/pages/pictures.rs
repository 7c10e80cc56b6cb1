//! Pictures inside a page: PNG as data URIs, and which part of them to show large.

use crate::error::Result;
use crate::image::{Image, Rgb8, encode_png};
use crate::metrics;
use crate::tone::{ToneCurve, auto_exposure_ev, display_rgb8};

/// A picture as the value of an `src` attribute.
pub(super) fn data_uri(picture: &Rgb8) -> Result<String> {
    Ok(format!("data:image/png;base64,{}", base64(&encode_png(picture)?)))
}

/// A linear picture as a person sees it, at the exposure that suits `reference`.
pub(super) fn developed(image: &Image, reference: &Image) -> Rgb8 {
    display_rgb8(image, auto_exposure_ev(reference), ToneCurve::default())
}

/// RFC 4648, with padding.
pub(super) fn base64(bytes: &[u8]) -> String {
    const ALPHABET: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut text = String::with_capacity(bytes.len().div_ceil(3) * 4);
    for chunk in bytes.chunks(3) {
        let byte = |i: usize| u32::from(chunk.get(i).copied().unwrap_or(0));
        let bits = byte(0) << 16 | byte(1) << 8 | byte(2);
        for digit in 0..4 {
            let index = bits >> (18 - 6 * digit) & 63;
            let is_padding = digit as usize > chunk.len();
            text.push(if is_padding { '=' } else { ALPHABET[index as usize] as char });
        }
    }
    text
}

/// A part of a picture.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Window {
    x: u32,
    y: u32,
    width: u32,
    height: u32,
}

impl Window {
    /// A third of the picture along each side, where `noisy` is most unlike `reference`; single
    /// pixels cannot decide, for each counts at most 1.
    pub(super) fn most_telling(noisy: &Image, reference: &Image) -> Self {
        let (width, height) = (noisy.width.div_ceil(3), noisy.height.div_ceil(3));
        let mean = metrics::mean(reference) as f32;
        let floor = metrics::REL_MSE_EPSILON as f32 * mean * mean;
        let error = |x: u32, y: u32| -> f32 {
            let (a, r) = (noisy.at(x, y), reference.at(x, y));
            let squared = |c: usize| (a[c] - r[c]).powi(2) / (r[c] * r[c] + floor);
            ((squared(0) + squared(1) + squared(2)) / 3.0).min(1.0)
        };
        let (step_x, step_y) = ((noisy.width / 12).max(1), (noisy.height / 12).max(1));
        let mut best = (-1.0, Self { x: 0, y: 0, width, height });
        for y in (0..=noisy.height - height).step_by(step_y as usize) {
            for x in (0..=noisy.width - width).step_by(step_x as usize) {
                let pixels = (y..y + height).flat_map(|y| (x..x + width).map(move |x| (x, y)));
                let sum: f32 = pixels.map(|(x, y)| error(x, y)).sum();
                if sum > best.0 {
                    best = (sum, Self { x, y, width, height });
                }
            }
        }
        best.1
    }

    /// This part of a picture.
    pub(super) fn of(self, picture: &Rgb8) -> Rgb8 {
        let row = |y: u32| {
            let start = (y * picture.width + self.x) as usize;
            &picture.pixels[start..start + self.width as usize]
        };
        let pixels = (self.y..self.y + self.height).flat_map(row).copied().collect();
        Rgb8 { width: self.width, height: self.height, pixels }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn base64_is_as_in_the_standard() {
        for (plain, coded) in
            [("", ""), ("f", "Zg=="), ("fo", "Zm8="), ("foo", "Zm9v"), ("foobar", "Zm9vYmFy")]
        {
            assert_eq!(base64(plain.as_bytes()), coded);
        }
        assert_eq!(base64(&[0xfb, 0xff, 0xfe]), "+//+");
    }

    #[test]
    fn the_window_shows_where_the_noise_is() {
        let reference = Image::filled(36, 24, [1.0; 3]);
        let noisy =
            Image::from_fn(36, 24, |x, y| if x >= 24 && y < 8 { [2.0; 3] } else { [1.0; 3] });
        let window = Window::most_telling(&noisy, &reference);
        assert_eq!(window, Window { x: 24, y: 0, width: 12, height: 8 });
        let cut = window.of(&Rgb8 {
            width: 36,
            height: 24,
            pixels: (0..36 * 24).map(|i| [(i % 36) as u8, (i / 36) as u8, 0]).collect(),
        });
        assert_eq!((cut.pixels[0], cut.pixels[12 * 8 - 1]), ([24, 0, 0], [35, 7, 0]));
    }
}
