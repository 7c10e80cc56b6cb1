//! Kept pictures beside each other, or what tells them apart.

use std::sync::Arc;

use rayon::prelude::*;

use super::history::History;
use super::interface::Chosen;
use super::kept_picture::{KeptPicture, Pixels};
use crate::develop::LinearPicture;
use crate::image::Image;
use crate::metrics::relative_rms_error;
use crate::render::gpu::Gpu;

/// Differences are shown so many times as bright as they are.
pub(super) const AMPLIFIED: f32 = 4.0;

/// What is compared; equal ones are of the very same pictures.
#[derive(Clone)]
pub(crate) struct Comparison {
    /// What to call the left and the right picture.
    pub names: [String; 2],
    /// Of what part of the whole they are, as [`super::document::Document::region`] says.
    pub regions: [Option<[f32; 4]>; 2],
    /// A kept picture.
    pub left: Arc<Pixels>,
    /// Another one, or `None` for what is rendered now.
    pub right: Option<Arc<Pixels>>,
    /// Whether their difference is shown, and not one beside the other.
    pub is_difference: bool,
}

impl PartialEq for Comparison {
    fn eq(&self, other: &Self) -> bool {
        let address = |pixels: &Option<Arc<Pixels>>| pixels.as_ref().map(Arc::as_ptr);
        Arc::ptr_eq(&self.left, &other.left)
            && address(&self.right) == address(&other.right)
            && self.is_difference == other.is_difference
    }
}

/// A comparison on the device.
#[derive(Clone, Default)]
pub(super) struct Compared {
    /// What is shown in place of the picture that is rendered.
    pub(super) picture: Option<LinearPicture>,
    /// What the wipe uncovers.
    pub(super) other: Option<LinearPicture>,
    /// [`relative_rms_error`] of the left picture against the right one, where their difference is shown.
    pub(super) difference: Option<f64>,
    /// What was read for it, lest it be read again.
    read: Vec<Arc<Image>>,
    /// Why it is not what was asked for.
    pub(super) failure: Option<String>,
}

impl Comparison {
    /// Of what was chosen of the kept pictures, if anything.
    pub(super) fn new(chosen: Chosen, history: &History) -> Option<Self> {
        let left = history.list.get(chosen.left?)?;
        let right = chosen.right.and_then(|right| history.list.get(right));
        let name = right.map_or("Now", |kept| &kept.name).to_owned();
        let region = |kept: &KeptPicture| kept.document.seen_region();
        Some(Self {
            names: [left.name.clone(), name],
            regions: [region(left), right.and_then(region)],
            left: Arc::clone(&left.pixels),
            right: right.map(|kept| Arc::clone(&kept.pixels)),
            is_difference: chosen.is_difference,
        })
    }

    /// Makes it ready; `now` is the picture that is rendered.
    pub(super) fn prepare(&self, gpu: &Gpu, now: impl FnOnce() -> Arc<Image>) -> Compared {
        let mut compared = Compared::default();
        let right = self.right.as_ref().map(|pixels| pixels.get()).transpose();
        let (left, right) = match self.left.get().and_then(|left| Ok((left, right?))) {
            Ok(both) => both,
            Err(failure) => return Compared { failure: Some(failure), ..compared },
        };
        compared.read = right.iter().chain([&left]).cloned().collect();
        if self.is_difference {
            let [of_left, of_right] = self.regions;
            let found = if of_left == of_right {
                let right = right.clone().unwrap_or_else(now);
                difference(&left, &right).map(|image| (image, relative_rms_error(&left, &right)))
            } else {
                Err("pictures of different parts have no difference".to_owned())
            };
            match found {
                Ok((image, difference)) => {
                    let picture = Some(LinearPicture::of_image(gpu, &image));
                    return Compared { picture, difference, ..compared };
                }
                Err(sentence) => compared.failure = Some(sentence),
            }
        }
        compared.picture = right.map(|image| LinearPicture::of_image(gpu, &image));
        compared.other = Some(LinearPicture::of_image(gpu, &left));
        compared
    }
}

/// How far apart the pixels of two pictures are, amplified; or why that cannot be said.
fn difference(a: &Image, b: &Image) -> Result<Image, String> {
    if (a.width, a.height) != (b.width, b.height) {
        return Err(format!(
            "a picture of {} x {} and one of {} x {} have no difference that can be shown",
            a.width, a.height, b.width, b.height
        ));
    }
    let apart = |(a, b): (&[f32; 3], &[f32; 3])| {
        std::array::from_fn(|channel| AMPLIFIED * (a[channel] - b[channel]).abs())
    };
    let pixels = a.pixels.par_iter().zip(&b.pixels).map(apart).collect();
    Ok(Image { width: a.width, height: a.height, pixels })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equal_pictures_differ_by_nothing_and_others_by_what_they_do() {
        let grey = |level: f32| Image::filled(3, 2, [level, 1.0, 0.0]);
        let black = difference(&grey(0.5), &grey(0.5)).expect("of one size");
        assert!(black.pixels.iter().all(|pixel| *pixel == [0.0; 3]));
        let found = difference(&grey(0.5), &grey(0.25)).expect("of one size");
        assert!(found.pixels.iter().all(|pixel| *pixel == [AMPLIFIED * 0.25, 0.0, 0.0]));
        let failure = difference(&grey(0.5), &Image::filled(2, 2, [0.0; 3])).expect_err("smaller");
        assert!(failure.contains("3 x 2") && failure.contains("2 x 2"), "{failure}");
    }
}
