//! The picture by light from a radiance cache: it is rendered beside the exact one, and denoised together with it until
//! that has more to say.

use std::sync::Arc;

use super::Session;
use super::film::Film;
use super::view::{Gi, View};
use super::view_probe::{ROOM_ENCLOSURE, enclosure};
use crate::environment::Environment;
use crate::error::Result;
use crate::path::World;

/// Samples a pixel of it: with them it is as good, denoised, as the exact one with twice as many, in half the
/// time.
pub(crate) const SAMPLES: u32 = 16;
/// What one of them counts beside an exact one. (Before filtering it is worth five to ten; but its error
/// falls no further.)
const WORTH: f32 = 4.0;

/// How far it is; `S` renders it, or will when it is gone on with.
#[derive(Default)]
pub(crate) enum CachedPicture<S> {
    /// There is none.
    #[default]
    Absent,
    /// It is rendered.
    UnderWay(Box<S>),
    /// All of it, of so many samples in all.
    #[cfg_attr(
        not(feature = "window"),
        expect(dead_code, reason = "the window alone shows it for long")
    )]
    Complete(u64, Arc<Film>),
}

impl<S> CachedPicture<S> {
    /// It with something else to render it.
    #[cfg(feature = "window")]
    pub(crate) fn map<T>(self, change: impl FnOnce(S) -> T) -> CachedPicture<T> {
        match self {
            Self::Absent => CachedPicture::Absent,
            Self::UnderWay(session) => CachedPicture::UnderWay(Box::new(change(*session))),
            Self::Complete(samples, film) => CachedPicture::Complete(samples, film),
        }
    }

    /// What renders it.
    #[cfg(feature = "window")]
    pub(crate) fn session(&self) -> Option<&S> {
        if let Self::UnderWay(session) = self { Some(session) } else { None }
    }
}

impl<'s> CachedPicture<Session<'s>> {
    /// That of a session which has learned, by the distributions that it has.
    ///
    /// # Errors
    /// As [`Session::set_grid`].
    pub(crate) fn beside(
        main: &Session<'_>,
        world: &'s World,
        environment: &'s Environment,
    ) -> Result<Self> {
        let view = View { gi: Gi::Cached, ..main.view().clone() };
        let mut session = Session::new(world, environment, view);
        session.finish_learning();
        main.grid().map_or(Ok(()), |grid| session.set_grid(grid.clone()))?;
        Ok(Self::UnderWay(Box::new(session)))
    }

    /// Its film, once all of its pixels have a sample.
    pub(crate) fn film_so_far(&self) -> Option<&Film> {
        match self {
            Self::UnderWay(session) if session.samples() > 0 => Some(session.film()),
            Self::Complete(_, film) => Some(film),
            _ => None,
        }
    }

    /// What renders it, if it gets its next sample before the exact picture: a few of them for each. Until it
    /// has one the exact one has every third turn, for what is shown must not stand still while the cache is
    /// trained.
    pub(crate) fn next(&mut self, main: &Session<'_>, turns: u32) -> Option<&mut Session<'s>> {
        let Self::UnderWay(session) = self else { return None };
        let is_shown = session.samples() > 0;
        let is_next =
            session.samples() < SAMPLES.min(2 + 4 * main.samples()) && (is_shown || turns < 2);
        is_next.then_some(session)
    }

    /// Ends with it if it is complete: its film is shown from then on, and no copy of it. `keep` gets what
    /// rendered it before.
    #[cfg(feature = "window")]
    pub(crate) fn complete(&mut self, keep: impl FnOnce(&mut Session<'s>)) {
        if self.session().is_some_and(|session| session.samples() >= SAMPLES)
            && let Some(session) = self.end(keep)
        {
            *self =
                Self::Complete(session.figures().samples, Arc::new(session.suspend().into_film()));
        }
    }

    /// Drops it. `keep` gets what rendered it, which is returned.
    #[cfg(feature = "window")]
    pub(crate) fn end(&mut self, keep: impl FnOnce(&mut Session<'s>)) -> Option<Box<Session<'s>>> {
        let Self::UnderWay(mut session) = std::mem::take(self) else { return None };
        keep(&mut session);
        Some(session)
    }
}

/// Whether a view's denoised pictures gain by it: inside, where most of the light has met several surfaces. Outside, its
/// errors are twice those of exact paths after as long.
pub(crate) fn suits(world: &World, view: &View) -> bool {
    view.limits.bounces >= 2 && enclosure(world, view) >= ROOM_ENCLOSURE
}

/// What a sample of it counts where the exact picture has so many: it fades out.
pub(crate) fn worth(samples: u32) -> f32 {
    let all = WORTH * SAMPLES as f32;
    WORTH * ((4.0 * all - samples as f32) / (3.0 * all)).clamp(0.0, 1.0)
}
