//! A film of the view from before, which is shown until there is a better one.

use std::sync::Arc;

use super::request::Request;
use super::snapshot::{Backdrop, Origin};
use crate::render::View;
use crate::render::film::{Film, Pixel};

/// A resized film is worth no more samples a pixel than this, for it is a little blurred.
const MAX_RESIZED_WEIGHT: f32 = 64.0;

/// A film of what was seen.
pub(super) struct EarlierFilm {
    /// What it was rendered for.
    request: Arc<Request>,
    film: Arc<Film>,
    /// What one of its samples counts beside an exact one: more where there is cached light in it.
    worth: f32,
    /// It in the size of the picture, if that has another one.
    resized: Option<Resized>,
}

/// A film from before in the size of the picture.
struct Resized {
    film: Arc<Film>,
    /// Of all its pixels.
    samples: u64,
    /// Of the pixel that has fewest, and of that which has most.
    span: [u32; 2],
    /// What it is worth at most in samples a pixel.
    most: f32,
}

impl EarlierFilm {
    /// `worth` is what one of its samples counts beside an exact one.
    pub(super) fn new(request: Arc<Request>, film: Arc<Film>, worth: f32) -> Self {
        Self { request, film, worth, resized: None }
    }

    /// Whether it was kept of this very request.
    pub(super) fn is_of(&self, request: &Arc<Request>) -> bool {
        Arc::ptr_eq(&self.request, request)
    }

    /// It for another request, if it looks like that.
    pub(super) fn begin(self, request: &Request) -> Option<Self> {
        self.request.looks_like(request).then_some(Self { resized: None, ..self })
    }

    /// Whether it is of the very same picture, which is gone on with: it has the same samples.
    pub(super) fn is_of_same(&self, request: &Request) -> bool {
        self.request.is_resumed_by(request)
    }

    /// Resizes it to the picture's size, if it was a whole one of about as many rows: the picture goes on with what
    /// it shows.
    pub(super) fn resize(&mut self, view: &View) {
        let (of, film, size) = (&self.request, &self.film, [view.width, view.height]);
        let is_whole = !of.moving && film.width == of.view.width && view.crop.is_none();
        let is_alike = film.height <= 2 * view.height && view.height <= 2 * film.height;
        if !(is_whole && is_alike && size != [film.width, film.height]) {
            return;
        }
        let resized = film.resized(size);
        let counts = || resized.pixels().iter().map(Pixel::samples);
        let span = [counts().min().unwrap_or(0), counts().max().unwrap_or(0)];
        let samples = resized.total_samples();
        // What is enlarged is blurred.
        let enlarged = (size[1] as f32 / film.height as f32).max(1.0);
        let most = MAX_RESIZED_WEIGHT / (enlarged * enlarged);
        self.resized = Some(Resized { film: Arc::new(resized), samples, span, most });
    }

    /// It as it is shown in a view.
    pub(super) fn film_for(&self, view: &View) -> Option<Arc<Film>> {
        if let Some(resized) = &self.resized {
            return Some(Arc::clone(&resized.film));
        }
        let aspect = |view: &View| f64::from(view.width) / f64::from(view.height);
        let is_as_wide = 1.02 * aspect(&self.request.view) >= aspect(view);
        is_as_wide.then(|| Arc::clone(&self.film))
    }

    /// It as it is shown with a picture of so many samples a pixel.
    pub(super) fn backdrop(&self, view: &View, samples: u32) -> Option<Backdrop> {
        let film = self.film_for(view)?;
        Some(match &self.resized {
            Some(resized) => {
                let worth = self.resized_worth(resized, samples);
                Backdrop { film, samples: resized.samples, worth, origin: Origin::Resized }
            }
            None => {
                let (samples, worth) = (film.total_samples(), self.worth);
                Backdrop { film, samples, worth, origin: Origin::Before }
            }
        })
    }

    /// What one sample of it resized counts where the picture has so many of its own: it fades out.
    fn resized_worth(&self, resized: &Resized, samples: u32) -> f32 {
        let faded = (1.0 - samples as f32 / (4.0 * resized.most)).max(0.0);
        (resized.most / resized.span[1].max(1) as f32).min(self.worth) * faded
    }

    /// Whether it counts no more beside so many samples a pixel.
    pub(super) fn has_faded(&self, samples: u32) -> bool {
        let is_worthless = |resized| self.resized_worth(resized, samples) == 0.0;
        self.resized.as_ref().is_some_and(is_worthless)
    }

    /// Whether it is resized, and worth at least so many samples a pixel.
    pub(super) fn is_resized_worth(&self, samples: f32) -> bool {
        let is_worth = |resized: &Resized| {
            self.worth * resized.samples as f32 >= samples * resized.film.pixels().len() as f32
        };
        self.resized.as_ref().is_some_and(is_worth)
    }

    /// What another film must be worth more than to take its place, in samples.
    pub(super) fn weight(&self, view: &View) -> f32 {
        match &self.resized {
            Some(resized) if resized.span[0] == 0 => 0.0,
            Some(resized) => {
                let most = resized.most * resized.film.pixels().len() as f32;
                (self.worth * resized.samples as f32).min(most)
            }
            None => {
                let samples = self.film_for(view).map_or(0, |film| film.total_samples());
                self.worth * samples as f32
            }
        }
    }
}
