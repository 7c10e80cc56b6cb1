//! Pictures of 8 or 16 bits a channel (PNG, JPEG, WebP, KTX 2 and whatever else the library is built with).

use std::io::Cursor;

use image::ImageDecoder;

use super::guard::{guarded, limits};
use super::{Texels, ktx2, tiff};
use crate::error::{At as _, Error, Result};
use crate::memory;

/// Widest and highest picture that is decoded.
const MAX_SIDE: u32 = 32_768;

/// Most pixels of a picture: 16384 x 16384.
const MAX_PIXELS: u64 = 1 << 28;

/// Most bytes one picture may take while it is decoded: 16384 x 16384 RGBA.
const MAX_BYTES: u64 = 1 << 30;

/// A decoder's complaint.
pub(crate) fn decoder_cause(cause: &image::ImageError, file_bytes: u64) -> String {
    match cause {
        image::ImageError::Limits(_) => {
            format!("claims more pixels than its {file_bytes} bytes can hold or lightgrid reads")
        }
        other => other.to_string(),
    }
}

/// Picture as it is stored (usually sRGB-encoded), row 0 at the top.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct LdrImage {
    /// Pixels per row.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// `width * height` of them, row after row, with the file's channels but an alpha that says nothing.
    pub pixels: Texels,
    /// Whether the file says that colours are multiplied by alpha; they are left so.
    pub is_premultiplied: bool,
}

/// What a picture's header claims.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct LdrHeader {
    /// Pixels per row.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Of one pixel once it is decoded.
    pub bytes_per_pixel: u8,
}

impl LdrHeader {
    /// That of a picture in a file, without decoding more than it.
    ///
    /// # Errors
    /// When the format is not recognised or the header is damaged; the sentence begins with `name`.
    pub fn of(bytes: &[u8], name: &str) -> Result<Self> {
        if ktx2::is_ktx2(bytes) {
            let (width, height) = ktx2::size(bytes).at(name)?;
            return Ok(Self { width, height, bytes_per_pixel: 4 });
        }
        tiff::check(bytes).at(name)?;
        let decoder = reader(bytes, name)?.into_decoder().at(name)?;
        let (width, height) = decoder.dimensions();
        Ok(Self { width, height, bytes_per_pixel: decoder.color_type().bytes_per_pixel() })
    }

    /// Pixels of the whole picture.
    pub fn pixels(&self) -> u64 {
        u64::from(self.width) * u64::from(self.height)
    }

    /// Most bytes that decoding it takes: what the decoder makes, and what is made of that.
    pub fn decoding_bytes(&self) -> u64 {
        2 * u64::from(self.bytes_per_pixel) * self.pixels()
    }
}

/// Decodes a picture whose format is told by its content; channels of more than 8 bits have 16, of mip
/// levels the largest is taken.
///
/// # Errors
/// When the format is not recognised, the data is damaged, or the picture would take more than
/// 1 GiB or is wider or higher than 32768 pixels, or memory is short; the sentence begins with `name`.
pub fn decode_ldr(bytes: &[u8], name: &str) -> Result<LdrImage> {
    let header = LdrHeader::of(bytes, name)?;
    let LdrHeader { width, height, .. } = header;
    if width > MAX_SIDE || height > MAX_SIDE || header.pixels() > MAX_PIXELS {
        let cause = format!("claims {width} x {height} pixels, more than lightgrid reads");
        return Err(Error::at(name, cause));
    }
    if ktx2::is_ktx2(bytes) {
        let (pixels, is_premultiplied) = ktx2::decode(bytes).at(name)?;
        let pixels = Texels::from(pixels).without_opaque_alpha();
        return Ok(LdrImage { width, height, pixels, is_premultiplied });
    }
    memory::check(header.decoding_bytes()).at(name)?;
    let mut reader = reader(bytes, name)?;
    let file_bytes = bytes.len() as u64;
    reader.limits(limits(MAX_SIDE, MAX_BYTES, file_bytes));
    let cause = |cause| decoder_cause(&cause, file_bytes);
    let decoded = guarded(|| reader.decode().map_err(cause)).at(name)?;
    let color = decoded.color();
    let channels = color.channel_count();
    let pixels = match channels {
        // Of 8 bits each.
        _ if color.bytes_per_pixel() == channels => {
            Texels::new(channels.into(), decoded.into_bytes())
        }
        1 => Texels::deep(1, &decoded.into_luma16()),
        2 => Texels::deep(2, &decoded.into_luma_alpha16()),
        3 => Texels::deep(3, &decoded.into_rgb16()),
        _ => Texels::deep(4, &decoded.into_rgba16()),
    };
    Ok(LdrImage { width, height, pixels: pixels.without_opaque_alpha(), is_premultiplied: false })
}

fn reader<'a>(bytes: &'a [u8], name: &str) -> Result<image::ImageReader<Cursor<&'a [u8]>>> {
    let reader = image::ImageReader::new(Cursor::new(bytes)).with_guessed_format().at(name)?;
    if reader.format().is_none() {
        return Err(Error::at(name, "not a picture in a known format (PNG, JPEG, WebP, KTX 2)"));
    }
    Ok(reader)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn png(image: impl Into<image::DynamicImage>) -> Vec<u8> {
        let mut bytes = Cursor::new(Vec::new());
        image.into().write_to(&mut bytes, image::ImageFormat::Png).unwrap();
        bytes.into_inner()
    }

    #[test]
    fn pictures_keep_their_channels_and_depth() {
        let grey = |values: Vec<u16>| {
            let buffer = image::ImageBuffer::<image::Luma<u16>, _>::from_raw(2, 1, values);
            decode_ldr(&png(buffer.unwrap()), "grey").unwrap().pixels
        };
        assert_eq!(grey(vec![0xffff, 0x8080]), vec![[255], [128]].into());
        assert_eq!(grey(vec![0xffff, 0x8081]), Texels::deep(1, &[0xffff, 0x8081]));

        let values = vec![1_u16, 2, 3, 0xffff, 4, 5, 6, 0xffff];
        let color = image::ImageBuffer::<image::Rgba<u16>, _>::from_raw(2, 1, values).unwrap();
        let decoded = decode_ldr(&png(color), "color").unwrap();
        assert_eq!((decoded.width, decoded.height), (2, 1));
        assert_eq!(decoded.pixels, Texels::deep(3, &[1, 2, 3, 4, 5, 6]));

        let bytes = png(image::RgbImage::from_pixel(2, 1, image::Rgb([1, 2, 3])));
        let pixels = decode_ldr(&bytes, "color").unwrap().pixels;
        assert_eq!(pixels, vec![[1, 2, 3]; 2].into());
    }

    #[test]
    fn a_header_that_claims_too_much_is_refused_before_anything_is_allocated() {
        let mut bytes = png(image::RgbaImage::new(1, 1));
        // Width and height of the PNG header, then its checksum, which is not looked at first.
        bytes[16..24].copy_from_slice(&[0, 0, 0xff, 0xff, 0, 0, 0xff, 0xff]);
        let error = decode_ldr(&bytes, "bomb.png").unwrap_err().to_string();
        assert!(error.starts_with("bomb.png: "), "{error}");
    }

    #[test]
    fn the_three_formats_of_gltf_are_read() {
        let red = image::RgbImage::from_pixel(8, 4, image::Rgb([255, 0, 0]));
        for format in [image::ImageFormat::Png, image::ImageFormat::Jpeg, image::ImageFormat::WebP]
        {
            let mut bytes = Cursor::new(Vec::new());
            red.write_to(&mut bytes, format).unwrap();
            let bytes = bytes.into_inner();
            let header = LdrHeader { width: 8, height: 4, bytes_per_pixel: 3 };
            assert_eq!(LdrHeader::of(&bytes, "red").unwrap(), header);
            let decoded = decode_ldr(&bytes, "red").unwrap();
            assert_eq!((decoded.width, decoded.height, decoded.pixels.len()), (8, 4, 32));
            let [r, g, b, a] = decoded.pixels.rgba()[31];
            assert!(r > 250 && g < 5 && b < 5 && a == 255, "{format:?}");
        }
    }

    /// Some panic in the decoder.
    #[test]
    fn odd_samplings_of_jpeg_are_a_sentence_or_a_picture() {
        let mut bytes = Cursor::new(Vec::new());
        let green = image::RgbImage::from_pixel(11, 7, image::Rgb([9, 200, 30]));
        green.write_to(&mut bytes, image::ImageFormat::Jpeg).unwrap();
        let bytes = bytes.into_inner();
        let frame = bytes.windows(2).position(|marker| marker == [0xff, 0xc0]).unwrap();
        let mut refused = 0;
        for (component, sampling) in (0..3).flat_map(|c| (0..=255).map(move |s| (c, s))) {
            let mut spoilt = bytes.clone();
            spoilt[frame + 11 + 3 * component] = sampling;
            if let Err(error) = decode_ldr(&spoilt, "odd.jpg") {
                assert!(error.to_string().starts_with("odd.jpg: "), "{error}");
                refused += 1;
            }
        }
        assert!((1..768).contains(&refused), "{refused}");
    }

    #[test]
    fn text_is_not_a_picture() {
        let error = decode_ldr(b"hello", "note.txt").unwrap_err().to_string();
        assert!(error.contains("not a picture"), "{error}");
    }
}
