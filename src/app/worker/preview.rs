//! What is shown between samples and screen: copies of films in the making.

use std::sync::{Arc, Weak};
use std::time::{Duration, Instant};

use super::request::Request;
use super::sessions::SLICE;
use super::snapshot::{Backdrop, SessionSnapshot};
use crate::render::Session;
use crate::render::block_errors::{BlockErrors, block_errors};
use crate::render::cached_picture::{CachedPicture, worth};
use crate::render::film::Film;
use crate::render::gpu::{DeviceFilm, Gpu};

/// A film that is shown in place is read back this seldom.
const READING_GAP: Duration = Duration::from_millis(250);
/// A film that is copied for being shown is replaced when it is so old, whoever still has others.
const MAX_COPY_AGE: Duration = Duration::from_secs(2);
/// Publishing may take at most about one part in this of the time.
const PUBLISH_SHARE: u32 = 40;
/// But a picture that changes is shown at least so often.
pub(super) const MAX_GAP: Duration = Duration::from_millis(800);

/// Where a film is shown in place: the window's device, and the film on it.
pub(super) type InPlace = (Gpu, DeviceFilm);

/// Films by the session they are of.
pub(super) const MAIN: usize = 0;
pub(super) const PLAIN: usize = 1;

/// Decides when films are copied for the window, and which films it is shown together.
#[derive(Default)]
pub(super) struct Preview {
    /// The main film that was shown last, the number of cached samples beside it, and the errors of both.
    errors: Option<(Weak<Film>, u64, Option<BlockErrors>)>,
    /// The main and the plain picture, as they were copied last.
    pub(super) copies: [Option<FilmCopy>; 2],
    /// The cached picture, as it was copied last, of so many samples.
    cached_copy: Option<(u64, Arc<Film>)>,
    /// Copies that somebody still has.
    lent: Vec<Weak<Film>>,
    /// Whether the window wants no new copy for now.
    pub(super) rests: bool,
}

/// A session's picture as it was when its film was copied or, where it is shown in place, read back.
pub(super) struct FilmCopy {
    session: SessionSnapshot,
    /// Where the film is shown in place meanwhile.
    of: Option<InPlace>,
    at: Instant,
    /// Age at which it is too old, where it is shown in place.
    gap: Duration,
}

impl Preview {
    /// Whether those who show films have one that they have not come to yet: a third would only take memory.
    pub(super) fn is_ahead(&mut self) -> bool {
        self.lent.retain(|film| film.strong_count() > 0);
        let copies = || self.copies.iter().flatten();
        let is_fresh = |copy: &FilmCopy| copy.at.elapsed() < MAX_COPY_AGE;
        self.lent.len() > copies().count().max(1) && copies().any(is_fresh)
    }

    /// Whether the last copy of a session's film does not serve on, by its age where it is shown `in_place`.
    pub(super) fn is_stale(&self, role: usize, in_place: Option<&InPlace>, rests: bool) -> bool {
        let serves = |copy: &FilmCopy| match (&copy.of, in_place) {
            (Some((gpu, film)), Some((on, of))) => {
                gpu.is_same(on) && film == of && copy.at.elapsed() < copy.gap
            }
            // Before pixels everywhere have a sample there is nothing to be seen.
            (None, None) => rests && copy.session.film.is_begun(),
            _ => false,
        };
        !self.copies[role].as_ref().is_some_and(serves)
    }

    /// A session's picture, and what reading a film that is shown `in_place` took of the time.
    pub(super) fn session_snapshot(
        &mut self,
        role: usize,
        session: &Session<'_>,
        in_place: Option<InPlace>,
        is_final: bool,
    ) -> (SessionSnapshot, Duration) {
        let (is_in_place, mut cost) = (in_place.is_some(), Duration::ZERO);
        let is_due = self.copies[role].as_ref().is_none_or(|copy| {
            // The last picture, and the first one with a sample in every pixel, are shown at once.
            let is_awaited = is_final || session.samples() > 0 && copy.session.samples == 0;
            // Nobody looks at one whose first pixels are not everywhere.
            let is_unseen = !is_in_place && !session.is_begun();
            is_awaited || !is_unseen && self.is_stale(role, in_place.as_ref(), self.rests)
        });
        self.copies[role].take_if(|_| is_due);
        let copy = self.copies[role].get_or_insert_with(|| {
            let start = Instant::now();
            let film = Arc::new(session.film().clone());
            if session.figures().samples > 0 {
                self.lent.push(Arc::downgrade(&film));
            }
            let session = SessionSnapshot {
                sampling: session.view().sampling,
                samples: session.samples(),
                noise: session.noise(),
                figures: session.figures(),
                comparable_seconds: session.comparable_seconds(),
                invalid_samples: film.invalid_samples(),
                film,
                grid: None,
                gpu: None,
                on_device: None,
            };
            if is_in_place {
                cost = start.elapsed();
            }
            let gap = gap_after(cost).max(READING_GAP);
            FilmCopy { session, of: in_place, at: Instant::now(), gap }
        });
        let mut snapshot = copy.session.clone();
        if is_in_place {
            // That is what is shown.
            snapshot.samples = session.samples();
        }
        snapshot.gpu = session.gpu_figures().map(Arc::new);
        snapshot.on_device = session.film_on_device();
        (snapshot, cost)
    }

    /// The film that is shown together with the main picture's `exact` one, and the errors of both where they are known.
    pub(super) fn backdrop(
        &mut self,
        request: &Request,
        exact: &Arc<Film>,
        cached: Option<&CachedPicture<Session<'_>>>,
    ) -> (Option<Backdrop>, Option<BlockErrors>) {
        let cached = cached.filter(|_| request.wants_cached);
        let cached = cached.and_then(|cached| self.cached_film(&cached.session));
        let samples = cached.as_ref().map_or(0, |(samples, _)| *samples);
        let known = self.errors.take().filter(|(of, beside, _)| {
            std::ptr::eq(of.as_ptr(), Arc::as_ptr(exact)) && *beside == samples
        });
        let other = cached.as_ref().map(|(_, film)| &**film);
        let found = || block_errors(exact, other.filter(|film| exact.is_alike(film)));
        let errors = known.map_or_else(found, |(.., errors)| errors);
        self.errors = Some((Arc::downgrade(exact), samples, errors));
        let shown = cached.map(|(samples, film)| {
            let worth = worth(exact, &film, errors.as_ref());
            Backdrop { film, samples, worth }
        });
        (shown.filter(|backdrop| backdrop.worth > 0.0), errors)
    }

    /// The cached picture's film and how many samples that has, if these are all over the picture. A copy is made unless
    /// there is a new one already or, while the window rests, any: it is megabytes.
    fn cached_film(&mut self, session: &Session<'_>) -> Option<(u64, Arc<Film>)> {
        let copy = self.cached_copy.take();
        let samples = session.figures().samples;
        if !session.is_begun() {
            return None;
        }
        let copy = copy.filter(|(of, _)| self.rests || *of == samples);
        let copy = copy.unwrap_or_else(|| (samples, Arc::new(session.film().clone())));
        Some(self.cached_copy.insert(copy).clone())
    }
}

/// Time until something that took `cost` may be done again.
pub(super) fn gap_after(cost: Duration) -> Duration {
    (cost * PUBLISH_SHARE).clamp(SLICE, MAX_GAP)
}
