//! The picture by cached light beside the one that was asked for.

use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

use super::RenderArguments;
use crate::environment::Environment;
use crate::error::Result;
use crate::memory;
use crate::path::World;
use crate::render::cached_picture::{CachedPicture, suits, worth};
use crate::render::film::Film;
use crate::render::{Driver, Sampling, Session, View};

/// Least width and height of a picture that is worth a radiance cache: its first paths take as long as some samples of a
/// smaller one.
const MIN_SIZE: u32 = 64;

/// The picture by cached light, where it helps to denoise.
pub(super) struct Beside<'a> {
    world: &'a World,
    environment: &'a Environment,
    is_wanted: bool,
    picture: CachedPicture<Session<'a>>,
    /// Seconds that it has taken, and those that were asked for.
    pub(super) seconds: f64,
    asked: Option<f64>,
}

impl<'a> Beside<'a> {
    /// For one picture of these arguments: not of a video, whose frames would differ by the cache's own error, nor where
    /// there is no memory for another film of `film_bytes`.
    pub(super) fn new(
        arguments: &RenderArguments,
        world: &'a World,
        environment: &'a Environment,
        view: &View,
        film_bytes: u64,
    ) -> Self {
        let is_kept = arguments.part.is_some() || arguments.checkpoint.is_some();
        let is_one = arguments.frames.is_none() && arguments.turntable.is_none();
        let is_wanted = arguments.gi.is_none()
            && !is_kept
            && is_one
            && worth(arguments.stop_rule().samples.unwrap_or(0)) > 0.0
            && view.sampling == Sampling::Adaptive
            && view.width.min(view.height) >= MIN_SIZE
            && arguments.picture.is_denoised(arguments.pictures())
            && suits(world, view)
            && memory::check(film_bytes).is_ok();
        Self {
            world,
            environment,
            is_wanted,
            picture: CachedPicture::Absent,
            seconds: 0.0,
            asked: arguments.seconds,
        }
    }

    /// Its next sample, if it is its turn; whether it was.
    ///
    /// # Errors
    /// As [`Session::advance`].
    pub(super) fn advance(&mut self, driver: &mut Driver<'_>, cancel: &AtomicBool) -> Result<bool> {
        let main = &driver.session;
        let may_go_on = self.is_wanted
            && !main.is_on_gpu()
            && main.samples() > 0
            && worth(main.samples()) > 0.0
            && !cancel.load(Ordering::Relaxed);
        if !may_go_on {
            return Ok(false);
        }
        let start = Instant::now();
        if matches!(self.picture, CachedPicture::Absent) {
            self.picture = CachedPicture::beside(main, self.world, self.environment)?;
        }
        let Some(session) = self.picture.next(main, 0) else { return Ok(false) };
        session.advance(1, cancel)?;
        self.seconds += start.elapsed().as_secs_f64();
        driver.rule.seconds = self.asked.map(|asked| asked - self.seconds);
        Ok(true)
    }

    /// The film by cached light, and the weight of its samples beside exact ones, of which each pixel has `samples`.
    pub(super) fn film(&self, samples: u32) -> Option<(&Film, f32)> {
        let worth = worth(samples);
        self.picture.film_so_far().filter(|_| worth > 0.0).map(|film| (film, worth))
    }
}
