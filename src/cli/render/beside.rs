//! The picture by cached light beside the one that was asked for.

use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

use super::RenderArguments;
use crate::cli::progress::RelativeError;
use crate::error::Result;
use crate::memory;
use crate::path::Lit;
use crate::render::block_errors::block_errors;
use crate::render::cached_picture::{CachedPicture, suits};
use crate::render::film::Film;
use crate::render::{Driver, Sampling, Session, StopRule, View};

/// Least width and height of a picture that is worth a radiance cache: its first paths take as long as some samples of a
/// smaller one.
const MIN_SIZE: u32 = 64;

/// The picture by cached light, where it helps to denoise.
pub(super) struct Beside<'a> {
    lit: Lit<'a>,
    is_wanted: bool,
    /// Whether exact samples are wanted for themselves. Else what was asked for is the number of both together.
    wants_exact: bool,
    /// Whether noise of pixels is taken out of what is asked for.
    is_denoised: bool,
    picture: Option<CachedPicture<Session<'a>>>,
    /// Seconds that it has taken.
    pub(super) seconds: f64,
    asked: StopRule,
}

impl<'a> Beside<'a> {
    /// For one picture of these arguments: not of a video, whose frames would differ by the cache's own error, nor where
    /// there is no memory for another film of so many `bytes`.
    pub(super) fn new(arguments: &RenderArguments, lit: Lit<'a>, view: &View, bytes: u64) -> Self {
        let is_kept = arguments.part.is_some() || arguments.checkpoint.is_some();
        let is_denoised = arguments.picture.is_denoised(&arguments.pictures());
        let is_one = arguments.frames.is_none() && arguments.turntable.is_none();
        let is_wanted = arguments.gi.is_none()
            && !is_kept
            && is_one
            && view.sampling == Sampling::Adaptive
            && view.width.min(view.height) >= MIN_SIZE
            && is_denoised
            && suits(lit.0, view)
            && memory::check(bytes).is_ok();
        Self {
            lit,
            is_wanted,
            wants_exact: arguments.noise.is_some()
                || arguments.picture.shows_rendered(&arguments.pictures()),
            is_denoised,
            picture: None,
            seconds: 0.0,
            asked: arguments.stop_rule(),
        }
    }

    /// Its next sample, if it is its turn; whether it was.
    ///
    /// # Errors
    /// As [`Session::advance`].
    pub(super) fn advance(&mut self, driver: &mut Driver<'_>, cancel: &AtomicBool) -> Result<bool> {
        let main = &driver.session;
        let is_done =
            !self.wants_exact && driver.rule.samples.is_some_and(|limit| main.samples() >= limit);
        let may_go_on = self.is_wanted
            && !main.is_on_gpu()
            && main.samples() > 0
            && !is_done
            && !cancel.load(Ordering::Relaxed);
        if !may_go_on {
            return Ok(false);
        }
        let start = Instant::now();
        let picture = match &mut self.picture {
            Some(picture) => picture,
            None => self.picture.insert(CachedPicture::beside(main, self.lit)?),
        };
        let Some(session) = picture.next(main, 0, self.wants_exact) else { return Ok(false) };
        session.advance(1, cancel)?;
        self.seconds += start.elapsed().as_secs_f64();
        driver.rule.seconds = self.asked.seconds.map(|asked| asked - self.seconds);
        let counted = self.counted();
        driver.rule.samples = self.asked.samples.map(|asked| asked.saturating_sub(counted));
        Ok(true)
    }

    /// Its samples a pixel as far as they count among those that were asked for.
    pub(super) fn counted(&self) -> u32 {
        let picture = self.picture.as_ref().filter(|_| !self.wants_exact);
        picture.map_or(0, |picture| picture.session.samples())
    }

    /// What the picture is off by: noise of pixels or, where that is taken out of all that was asked for, the error of
    /// areas. `None` before it is known, and where some samples are others' ([`Session::noise`]).
    pub(super) fn error(&self, main: &Session<'_>) -> Option<RelativeError> {
        let noise = (main.samples() > 1).then(|| main.noise());
        let noise = noise.filter(|noise| noise.is_finite())?;
        if self.wants_exact || !self.is_denoised {
            return Some((noise, "noise"));
        }
        let errors = block_errors(main.film(), self.film())?;
        Some((f64::from(errors.left()), "denoised error"))
    }

    /// The film by cached light, once all of its pixels have a sample.
    pub(super) fn film(&self) -> Option<&Film> {
        let session = &self.picture.as_ref()?.session;
        (session.samples() > 0).then(|| session.film())
    }
}
