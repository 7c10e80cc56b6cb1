//! Textures that materials ask for, and the images behind them.

use std::borrow::Cow;
use std::collections::BTreeMap;

use gltf::json;
use json::texture::{MagFilter, WrappingMode};
use json::validation::Checked;
use rayon::prelude::*;
use serde_json::Value;

use super::Fallible;
use super::buffers::{File, find};
use super::uri;
use crate::error::Notices;
use crate::image::ldr;
use crate::scene::{Texture, TextureImage, Wrap};

/// Most texels all images may have together: 4 GiB.
const MAX_TEXELS: u64 = 1 << 30;

/// How the JSON types say that a texture names no image.
const NO_IMAGE: u32 = u32::MAX;

/// What the materials have asked for so far. Until [`Wanted::decode`] the `image` of a texture is
/// the number of an image in the file.
#[derive(Default)]
pub(super) struct Wanted {
    textures: Vec<Texture>,
}

/// Decoded textures and images, and where each wanted texture went (`None`: it cannot be read).
pub(super) struct Decoded {
    pub(super) textures: Vec<Texture>,
    pub(super) images: Vec<TextureImage>,
    pub(super) texture_map: Vec<Option<u32>>,
}

impl Wanted {
    /// Notes a texture of the file as colour (`srgb`) or data; the same one is kept once.
    pub(super) fn add(
        &mut self,
        root: &json::Root,
        index: json::Index<json::Texture>,
        srgb: bool,
    ) -> Fallible<u32> {
        let texture = find(&root.textures, index, "texture")?;
        let sampler = match texture.sampler {
            Some(sampler) => Some(find(&root.samplers, sampler, "sampler")?),
            None => None,
        };
        let wanted = Texture {
            image: image_of(texture),
            wrap_u: sampler.map_or(Wrap::Repeat, |sampler| wrap(sampler.wrap_s)),
            wrap_v: sampler.map_or(Wrap::Repeat, |sampler| wrap(sampler.wrap_t)),
            nearest: sampler.and_then(|sampler| sampler.mag_filter)
                == Some(Checked::Valid(MagFilter::Nearest)),
            srgb,
        };
        let known = self.textures.iter().position(|other| *other == wanted);
        let position = known.unwrap_or_else(|| {
            self.textures.push(wanted);
            self.textures.len() - 1
        });
        Ok(position as u32)
    }

    /// Decodes the images in parallel. One that cannot be read is named in a notice.
    pub(super) fn decode(self, file: &File<'_>, notices: &mut Notices) -> Decoded {
        let mut wanted: Vec<u32> = self.textures.iter().map(|texture| texture.image).collect();
        wanted.sort_unstable();
        wanted.dedup();
        let encoded: Vec<_> = wanted.iter().map(|&image| encoded(file, image)).collect();
        let decoded: Vec<Fallible<TextureImage>> =
            within_limit(encoded).into_par_iter().map(|bytes| decode(&bytes?)).collect();
        let mut images = Vec::new();
        let mut image_map = BTreeMap::new();
        for (&number, result) in wanted.iter().zip(decoded) {
            match result {
                Ok(image) => {
                    image_map.insert(number, images.len() as u32);
                    images.push(image);
                }
                Err(cause) => notices.add(format!(
                    "{} cannot be used: {cause}; materials do without it",
                    image_name(&file.root, number)
                )),
            }
        }
        let mut textures = Vec::new();
        let place = |texture: &Texture| {
            let image = *image_map.get(&texture.image)?;
            textures.push(Texture { image, ..*texture });
            Some(textures.len() as u32 - 1)
        };
        let texture_map = self.textures.iter().map(place).collect();
        Decoded { textures, images, texture_map }
    }
}

/// Number of the image of a texture, WebP preferred, or [`NO_IMAGE`].
fn image_of(texture: &json::Texture) -> u32 {
    let extension = texture.extensions.as_ref();
    let webp = extension.and_then(|all| all.others.get("EXT_texture_webp"));
    let webp = webp.and_then(|webp| webp.get("source")).and_then(Value::as_u64);
    webp.and_then(|image| u32::try_from(image).ok())
        .unwrap_or_else(|| u32::try_from(texture.source.value()).unwrap_or(NO_IMAGE))
}

fn wrap(mode: Checked<WrappingMode>) -> Wrap {
    match mode {
        Checked::Valid(WrappingMode::ClampToEdge) => Wrap::ClampToEdge,
        Checked::Valid(WrappingMode::MirroredRepeat) => Wrap::MirroredRepeat,
        Checked::Valid(WrappingMode::Repeat) | Checked::Invalid => Wrap::Repeat,
    }
}

fn image_name(root: &json::Root, number: u32) -> String {
    let image = root.images.get(number as usize);
    let name = image.and_then(|image| image.name.as_deref().or(image.uri.as_deref()));
    match name {
        Some(name) => format!("Image {number} ({})", uri::shown(name)),
        None if number == NO_IMAGE => "The image of a texture".into(),
        None => format!("Image {number}"),
    }
}

/// The file's bytes of an image, not decoded yet.
fn encoded<'a>(file: &'a File<'_>, number: u32) -> Fallible<Cow<'a, [u8]>> {
    if number == NO_IMAGE {
        return Err("it has none in a supported format".into());
    }
    let image = file.root.images.get(number as usize).ok_or("it is not in the file")?;
    match (image.buffer_view, &image.uri) {
        (Some(view), _) => Ok(Cow::Borrowed(file.view(view)?.0)),
        (None, Some(uri)) => Ok(Cow::Owned(uri::read(uri, file.base_dir)?)),
        (None, None) => Err("it has no data".into()),
    }
}

/// Refuses images, by the sizes in their headers, from where all together become too large.
fn within_limit(mut images: Vec<Fallible<Cow<'_, [u8]>>>) -> Vec<Fallible<Cow<'_, [u8]>>> {
    let mut texels = 0_u64;
    for image in &mut images {
        let Ok(bytes) = image else { continue };
        match ldr::ldr_size(bytes, "its data") {
            Ok((width, height)) => {
                texels = texels.saturating_add(u64::from(width) * u64::from(height));
                if texels > MAX_TEXELS {
                    *image = Err("all images together take more than 4 GiB".into());
                }
            }
            Err(cause) => *image = Err(cause.to_string()),
        }
    }
    images
}

fn decode(bytes: &[u8]) -> Fallible<TextureImage> {
    let image = ldr::decode_ldr(bytes, "its data").map_err(|cause| cause.to_string())?;
    Ok(TextureImage { width: image.width, height: image.height, texels: image.pixels })
}
