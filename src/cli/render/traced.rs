//! What was rendered: one picture or, for a light mix, one by each group of light, which add up to it.

use std::borrow::Cow;

use super::beside::Beside;
use crate::render::block_errors::block_errors;
use crate::render::cached_picture::worth;
use crate::render::film::Film;
use crate::render::light_groups::{GroupImage, LightGroup, mixed};
use crate::render::{Driver, Figures};

/// A picture and the one by cached light beside it.
pub(super) struct Traced<'a> {
    pub(super) driver: Driver<'a>,
    pub(super) beside: Beside<'a>,
}

/// What pictures add up to.
pub(super) struct Sums<'a> {
    pub(super) film: Cow<'a, Film>,
    /// The film by cached light, and what one of its samples counts.
    cached: Option<(Cow<'a, Film>, f32)>,
    pub(super) figures: Figures,
    /// Seconds of cached light.
    pub(super) cached_seconds: f64,
    pub(super) groups: Vec<GroupImage>,
}

impl<'a> Sums<'a> {
    /// Of the one picture that there is, or of one for each group.
    pub(super) fn of(pictures: &'a [Traced<'_>], groups: &[LightGroup]) -> Self {
        let mut films: Vec<_> = pictures.iter().map(|picture| picture.driver.film()).collect();
        if !groups.is_empty() {
            // Where one has no sample of a pixel, the light of the others is not lost.
            let whole = |film: &Cow<'_, Film>| Cow::Owned(film.without_gaps().into_owned());
            films = films.iter().map(whole).collect();
        }
        let image = |(group, film): (&LightGroup, &Cow<'_, Film>)| GroupImage {
            name: group.name.clone(),
            factor: 1.0,
            image: film.image(),
        };
        let groups = groups.iter().zip(&films).map(image).collect();
        let cached: Vec<_> = pictures.iter().filter_map(|it| it.beside.film()).collect();
        let has_all = cached.len() == films.len();
        let cached = has_all.then(|| sum(cached.into_iter().map(Cow::Borrowed).collect()));
        let film = sum(films);
        let cached = cached.map(|cached| {
            let worth = worth(&film, &cached, block_errors(&film, Some(&cached)).as_ref());
            (cached, worth)
        });
        let mut figures =
            pictures.first().map_or(Figures::default(), |it| it.driver.session.figures());
        for other in pictures.iter().skip(1) {
            figures.add(&other.driver.session.figures());
            // That of the sum is not known.
            figures.variance_saved = 0.0;
        }
        let cached_seconds = pictures.iter().map(|picture| picture.beside.seconds).sum();
        Self { film, cached, figures, cached_seconds, groups }
    }

    /// The film by cached light, and what one of its samples counts beside one of the film's.
    pub(super) fn cached(&self) -> Option<(&Film, f32)> {
        self.cached.as_ref().map(|(film, worth)| (&**film, *worth))
    }
}

fn sum(mut films: Vec<Cow<'_, Film>>) -> Cow<'_, Film> {
    match films.len() {
        1 => films.swap_remove(0),
        _ => Cow::Owned(mixed(&films.iter().map(|film| (&**film, 1.0)).collect::<Vec<_>>())),
    }
}
