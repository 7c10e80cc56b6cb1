//! Textures that materials ask for, and the images behind them.

use std::borrow::Cow;
use std::collections::{BTreeMap, HashMap};

use gltf::json;
use json::texture::{MagFilter, WrappingMode};
use json::validation::Checked;
use rayon::prelude::*;
use serde::Deserialize;

use super::buffers::{File, uri_of};
use super::document::Document;
use super::lenient::whole;
use super::limits::Fallible;
use super::uri::{self, Place};
use crate::error::Notices;
use crate::image::ldr::{LdrHeader, LdrImage, decode_ldr};
use crate::memory;
use crate::scene::lists::appended;
use crate::scene::{Material, Texture, TextureImage, TextureSlot, Wrap};

/// Most texels all images may have together: 4 GiB of 8 bits a channel.
const MAX_TEXELS: u64 = 1 << 30;

/// So many images that cannot be used are named.
const MAX_FAILURES: usize = 10;

/// How the JSON types say that a texture names no image.
const NO_IMAGE: u32 = u32::MAX;

/// What the materials have asked for so far. Until [`Wanted::decode`] the `image` of a texture is
/// the number of an image in the file.
#[derive(Default)]
pub(super) struct Wanted {
    textures: Vec<Texture>,
    /// Where in the list each is.
    places: HashMap<Texture, u32>,
    /// Images by which others are replaced that cannot be read.
    fallbacks: BTreeMap<u32, u32>,
}

/// Decoded textures and images, and where each wanted texture went (`None`: it cannot be read).
pub(super) struct Decoded {
    pub(super) textures: Vec<Texture>,
    pub(super) images: Vec<TextureImage>,
    pub(super) texture_map: Vec<Option<u32>>,
    /// Textures of roughness by those of glossiness that they were made of, and the bits of the factor on it.
    rough: HashMap<(u32, u32), u32>,
}

impl Wanted {
    /// Notes a texture of the file as colour (`srgb`) or data; the same one is kept once.
    pub(super) fn add(
        &mut self,
        document: &Document<'_>,
        index: json::Index<json::Texture>,
        srgb: bool,
    ) -> Fallible<u32> {
        let texture = document.textures.get(index)?;
        let sampler = texture.sampler.map(|sampler| document.samplers.get(sampler));
        let sampler = sampler.transpose()?.unwrap_or_default();
        let plain = u32::try_from(texture.source.value()).unwrap_or(NO_IMAGE);
        let image = image_of(&texture).unwrap_or(plain);
        if image != plain && plain != NO_IMAGE {
            self.fallbacks.entry(image).or_insert(plain);
        }
        let wanted = Texture {
            image,
            wrap_u: wrap(sampler.wrap_s),
            wrap_v: wrap(sampler.wrap_t),
            nearest: sampler.mag_filter == Some(Checked::Valid(MagFilter::Nearest)),
            srgb,
        };
        Ok(*self.places.entry(wanted).or_insert_with(|| appended(&mut self.textures, wanted)))
    }

    /// Decodes the images in parallel. One that cannot be read is named in a notice.
    pub(super) fn decode(self, file: &File<'_>, notices: &mut Notices) -> Decoded {
        let mut numbers: Vec<u32> = self.textures.iter().map(|texture| texture.image).collect();
        let mut shelf = Shelf::default();
        shelf.read(file, &mut numbers);
        let unread = |number: &u32| !shelf.places.get(number).is_some_and(Result::is_ok);
        let failed = numbers.iter().filter(|number| unread(number));
        let mut instead: Vec<u32> =
            failed.filter_map(|number| self.fallbacks.get(number)).copied().collect();
        shelf.read(file, &mut instead);
        let Shelf { images, places, premultiplied, .. } = shelf;

        let read = |number: &u32| places.get(number)?.as_ref().ok();
        let other = |number: &u32| self.fallbacks.get(number).filter(|other| read(other).is_some());
        let name = |number: u32| image_name(&file.document, number);
        let mut failures = Vec::new();
        for number in numbers {
            match &places[&number] {
                Ok(place) if premultiplied.contains(place) => notices.add(format!(
                    "{} has colours multiplied by their opacity, which glTF does not know; \
                     they are used as they are",
                    name(number)
                )),
                Ok(_) => {}
                Err(cause) => {
                    let instead = match other(&number) {
                        Some(other) => format!("{} is used instead", name(*other)),
                        None => "materials do without it".to_owned(),
                    };
                    failures.push(format!("{} cannot be used: {cause}; {instead}", name(number)));
                }
            }
        }
        let unnamed = failures.len().saturating_sub(MAX_FAILURES);
        failures.into_iter().take(MAX_FAILURES).for_each(|failure| notices.add(failure));
        if unnamed > 0 {
            notices.add(format!("{unnamed} more images cannot be used"));
        }
        let mut textures = Vec::new();
        let place = |texture: &Texture| {
            let image = *read(&texture.image).or_else(|| read(other(&texture.image)?))?;
            Some(appended(&mut textures, Texture { image, ..*texture }))
        };
        let texture_map = self.textures.iter().map(place).collect();
        Decoded { textures, images, texture_map, rough: HashMap::new() }
    }
}

impl Decoded {
    /// Puts roughness in place of the glossiness in the alpha of the texture that a material reads for it.
    pub(super) fn make_rough(&mut self, material: &mut Material, factor: f32) {
        let slot = &mut material.textures[TextureSlot::MetallicRoughness as usize];
        let Some(reference) = slot else { return };
        let glossy = (reference.texture, factor.to_bits());
        let known = self.rough.get(&glossy).copied();
        let Some(rough) = known.or_else(|| self.rough_texture(reference.texture, factor)) else {
            // It is the same everywhere, or there is no memory for it.
            *slot = None;
            return;
        };
        self.rough.insert(glossy, rough);
        reference.texture = rough;
        material.roughness = 1.0;
    }

    /// A texture of roughness made of the glossiness in another one's alpha, if it has any.
    fn rough_texture(&mut self, glossy: u32, factor: f32) -> Option<u32> {
        let texture = self.textures[glossy as usize];
        let image = &self.images[texture.image as usize];
        memory::check(image.texels.bytes().len() as u64).ok()?;
        let texels = image.texels.map_alpha(|alpha| 1.0 - factor * alpha)?;
        let rough = TextureImage { texels, ..*image };
        let image = appended(&mut self.images, rough);
        Some(appended(&mut self.textures, Texture { image, ..texture }))
    }
}

/// Images that were read.
#[derive(Default)]
struct Shelf {
    images: Vec<TextureImage>,
    /// Where the images of the file went, by their number there.
    places: BTreeMap<u32, Fallible<u32>>,
    /// Places of those whose colours are multiplied by their opacity.
    premultiplied: Vec<u32>,
    /// Of all images together, as their headers say.
    texels: u64,
}

impl Shelf {
    /// Reads images of these numbers, which are put in order, that are not there yet.
    fn read(&mut self, file: &File<'_>, numbers: &mut Vec<u32>) {
        numbers.sort_unstable();
        numbers.dedup();
        let new: Vec<u32> =
            numbers.iter().copied().filter(|number| !self.places.contains_key(number)).collect();
        // What several images of the file have in common is read and decoded once.
        let sources: Vec<Fallible<Source<'_>>> =
            new.iter().map(|&number| source(file, number)).collect();
        let mut distinct: Vec<&Source<'_>> = sources.iter().flatten().collect();
        distinct.sort_unstable();
        distinct.dedup();
        let mut encoded: Vec<_> = distinct.iter().map(|source| source.read(file)).collect();
        within_limit(&mut encoded, &mut self.texels);
        let decode = |bytes: Fallible<Cow<'_, [u8]>>| {
            decode_ldr(&bytes?, "its data").map_err(|cause| cause.to_string())
        };
        let decoded: Vec<Fallible<LdrImage>> = encoded.into_par_iter().map(decode).collect();
        let shelve = |result: Fallible<LdrImage>| {
            let LdrImage { width, height, pixels: texels, is_premultiplied } = result?;
            let place = appended(&mut self.images, TextureImage { width, height, texels });
            if is_premultiplied {
                self.premultiplied.push(place);
            }
            Ok(place)
        };
        let places: Vec<Fallible<u32>> = decoded.into_iter().map(shelve).collect();
        for (number, source) in new.into_iter().zip(&sources) {
            let place = source.as_ref().map_err(String::clone).and_then(|source| {
                let found = distinct.binary_search(&source).expect("all sources are in it");
                places[found].clone()
            });
            self.places.insert(number, place);
        }
    }
}

/// Number of the image that an extension prefers to the texture's own.
fn image_of(texture: &json::Texture) -> Option<u32> {
    let all = &texture.extensions.as_ref()?.others;
    let source = |name| u32::try_from(whole(all.get(name)?.get("source")?)?).ok();
    source("KHR_texture_basisu").or_else(|| source("EXT_texture_webp"))
}

fn wrap(mode: Checked<WrappingMode>) -> Wrap {
    match mode {
        Checked::Valid(WrappingMode::ClampToEdge) => Wrap::ClampToEdge,
        Checked::Valid(WrappingMode::MirroredRepeat) => Wrap::MirroredRepeat,
        Checked::Valid(WrappingMode::Repeat) | Checked::Invalid => Wrap::Repeat,
    }
}

fn image_name(document: &Document<'_>, number: u32) -> String {
    if number == NO_IMAGE {
        return "The image of a texture".into();
    }
    let index = json::Index::new(number);
    let name = document.images.get_as::<Label>(index).ok().and_then(|label| label.name);
    let uri = || document.images.text(index).and_then(uri_of).ok().flatten();
    match name.map(Cow::Owned).or_else(uri).filter(|name| !name.is_empty()) {
        Some(name) => format!("Image {number} ({})", uri::shown(&name)),
        None => format!("Image {number}"),
    }
}

/// What an image is called.
#[derive(Deserialize)]
struct Label {
    name: Option<String>,
}

/// The view that an image is in, if it is.
#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
struct InView {
    buffer_view: Option<json::Index<json::buffer::View>>,
}

/// Where the bytes of an image are.
#[derive(PartialEq, Eq, PartialOrd, Ord)]
enum Source<'a> {
    View(u32),
    Uri(Place<'a>),
}

fn source<'a>(file: &'a File<'_>, number: u32) -> Fallible<Source<'a>> {
    if number == NO_IMAGE {
        return Err("it has none in a supported format".into());
    }
    let index = json::Index::new(number);
    if let Some(view) = file.document.images.get_as::<InView>(index)?.buffer_view {
        return Ok(Source::View(view.value() as u32));
    }
    let uri = uri_of(file.document.images.text(index)?)?.ok_or("it has no data")?;
    file.folder.place(uri).map(Source::Uri)
}

impl Source<'_> {
    /// The file's bytes of an image, not decoded yet.
    fn read<'a>(&self, file: &'a File<'_>) -> Fallible<Cow<'a, [u8]>> {
        match self {
            Self::View(view) => Ok(Cow::Borrowed(file.view(json::Index::new(*view))?.0)),
            Self::Uri(place) => place.read().map(Cow::Owned),
        }
    }
}

/// Refuses images, by the sizes in their headers, from where all together become too large; `texels` is how
/// large they are.
fn within_limit(images: &mut [Fallible<Cow<'_, [u8]>>], texels: &mut u64) {
    let mut decoding_bytes = 0_u64;
    for image in images {
        let Ok(bytes) = image else { continue };
        let header = LdrHeader::of(bytes, "its data").map_err(|cause| cause.to_string());
        let checked = header.and_then(|header| {
            let more = texels.saturating_add(header.pixels());
            if more > MAX_TEXELS {
                return Err("all images together take more than 4 GiB".into());
            }
            let more_bytes = decoding_bytes.saturating_add(header.decoding_bytes());
            memory::check(more_bytes)?;
            (*texels, decoding_bytes) = (more, more_bytes);
            Ok(())
        });
        if let Err(cause) = checked {
            *image = Err(cause);
        }
    }
}
