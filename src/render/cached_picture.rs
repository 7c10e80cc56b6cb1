//! The picture by light from a radiance cache: it is rendered beside the exact one, and denoised together with it.
//!
//! Its samples take half the time and have less noise, but the cache has an error of its own, which is coarser than a
//! denoiser's reach. Means over blocks of both films show it: each film counts by its error there, so the exact one takes
//! over as samples grow.

use super::Session;
use super::block_errors::{BlockErrors, block_errors};
use super::film::Film;
use super::view::{Gi, View};
use super::view_probe::{ROOM_ENCLOSURE, enclosure};
use crate::error::Result;
use crate::path::{Lit, World};

/// Samples of it for one exact sample, where the denoised picture is all that is wanted. Exact samples show the cache's
/// error; more of them leave the picture as it is (0 to 3 % of FLIP for 4 in place of 8) and take longer.
const PER_EXACT: u32 = 8;
/// Samples of it where exact samples are wanted for themselves: half as many as those, but not fewer than this.
const MIN_SAMPLES: u32 = 16;
/// What one of its samples counts beside an exact one until both films show their errors.
const FIRST_WORTH: f32 = 4.0;
/// While it has less than this share of the picture, exact samples lower the error faster.
const MIN_SHARE: f32 = 0.5;
/// Its random numbers are not those of the exact picture, so that both find different light.
const SEED: u32 = 0x6361_6368;

/// The picture by cached light.
pub(crate) struct CachedPicture<S> {
    /// What renders it, or will when it is gone on with.
    pub(crate) session: S,
    /// Exact samples a pixel when the films were compared last, and whether this one was to go on.
    compared: u32,
    goes_on: bool,
}

impl<S> CachedPicture<S> {
    /// One that this session renders.
    pub(crate) fn new(session: S) -> Self {
        Self { session, compared: 0, goes_on: true }
    }

    /// It with something else to render it.
    #[cfg(feature = "window")]
    pub(crate) fn map<T>(self, change: impl FnOnce(S) -> T) -> CachedPicture<T> {
        let Self { session, compared, goes_on } = self;
        CachedPicture { session: change(session), compared, goes_on }
    }
}

impl<'s> CachedPicture<Session<'s>> {
    /// That of a session which has learned, by the distributions that it has.
    ///
    /// # Errors
    /// As [`Session::set_grid`].
    pub(crate) fn beside(main: &Session<'_>, (world, environment): Lit<'s>) -> Result<Self> {
        let mut session = Session::new(world, environment, view(main.view()));
        session.finish_learning();
        main.grid().map_or(Ok(()), |grid| session.set_grid(grid.clone()))?;
        Ok(Self::new(session))
    }

    /// What renders it, if it gets its next sample before the exact picture: a few of them for each, fewer where exact
    /// samples `are_wanted` for themselves. Until it has one the exact one has every third turn, for what is shown must not
    /// stand still while the cache is trained.
    pub(crate) fn next(
        &mut self,
        main: &Session<'_>,
        turns: u32,
        are_wanted: bool,
    ) -> Option<&mut Session<'s>> {
        let (exact, cached) = (main.samples(), self.session.samples());
        if exact > self.compared && exact.is_power_of_two() && cached > 1 {
            self.compared = exact;
            let errors = block_errors(main.film(), Some(self.session.film()));
            self.goes_on = errors.is_none_or(|errors| errors.share() >= MIN_SHARE);
        }
        let most = match are_wanted {
            true => MIN_SAMPLES.max(exact / 2).min(2 + 4 * exact),
            false => 2 + PER_EXACT * exact,
        };
        let is_next = self.goes_on && cached < most && (cached > 0 || turns < 2);
        is_next.then_some(&mut self.session)
    }
}

/// The cached picture's view beside this one.
pub(crate) fn view(exact: &View) -> View {
    View { gi: Gi::Cached, seed: exact.seed ^ SEED, ..exact.clone() }
}

/// Whether a view's denoised pictures gain by it: inside, where most of the light has met several surfaces. Outside, its
/// errors are twice those of exact paths after as long.
pub(crate) fn suits(world: &World, view: &View) -> bool {
    view.limits.bounces >= 2 && enclosure(world, view) >= ROOM_ENCLOSURE
}

/// What a sample of the cached film counts beside one of the exact film, by the errors of both.
pub(crate) fn worth(exact: &Film, cached: &Film, errors: Option<&BlockErrors>) -> f32 {
    errors.map_or(FIRST_WORTH, |errors| {
        let [exact, cached] = [exact, cached].map(|film| film.total_samples() as f32);
        let share = errors.share();
        share / (1.0 - share) * exact / cached
    })
}
