//! A film of the view from before, which is shown until there is a better one.

use std::sync::Arc;

use super::request::Request;
use super::snapshot::{Backdrop, Origin};
use crate::render::View;
use crate::render::film::Film;

/// A film of what was seen.
pub(super) struct EarlierFilm {
    /// What it was rendered for.
    request: Arc<Request>,
    film: Arc<Film>,
    /// What one of its samples counts beside an exact one: more where there is cached light in it.
    worth: f32,
}

impl EarlierFilm {
    /// `worth` is what one of its samples counts beside an exact one.
    pub(super) fn new(request: Arc<Request>, film: Arc<Film>, worth: f32) -> Self {
        Self { request, film, worth }
    }

    /// Whether it was kept of this very request.
    pub(super) fn is_of(&self, request: &Arc<Request>) -> bool {
        Arc::ptr_eq(&self.request, request)
    }

    /// It for another request, if it looks like that.
    pub(super) fn begin(self, request: &Request) -> Option<Self> {
        self.request.looks_like(request).then_some(self)
    }

    /// Whether it is of the very same picture, which is gone on with: it has the same samples.
    pub(super) fn is_of_same(&self, request: &Request) -> bool {
        self.request.is_resumed_by(request)
    }

    /// It as it is shown in a view.
    pub(super) fn film_for(&self, view: &View) -> Option<Arc<Film>> {
        let aspect = |view: &View| f64::from(view.width) / f64::from(view.height);
        let is_as_wide = 1.02 * aspect(&self.request.view) >= aspect(view);
        is_as_wide.then(|| Arc::clone(&self.film))
    }

    /// It as it is shown with a picture.
    pub(super) fn backdrop(&self, view: &View) -> Option<Backdrop> {
        let film = self.film_for(view)?;
        let samples = film.total_samples();
        Some(Backdrop { film, samples, worth: self.worth, origin: Origin::Before })
    }

    /// What another film must be worth more than to take its place, in samples.
    pub(super) fn weight(&self, view: &View) -> f32 {
        let samples = self.film_for(view).map_or(0, |film| film.total_samples());
        self.worth * samples as f32
    }
}
