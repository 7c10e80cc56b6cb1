//! How far a picture is, and when it is done.

use serde::{Deserialize, Serialize};

use super::film::Film;

/// When to stop; whichever comes first.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct StopRule {
    /// Samples per pixel.
    pub samples: Option<u32>,
    /// Seconds of learning and rendering.
    pub seconds: Option<f64>,
    /// Noise as [`super::Session::noise`] estimates it.
    pub noise: Option<f64>,
}

/// What a session is doing.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Phase {
    /// Tracing learning paths.
    Learning,
    /// Adding samples to the film.
    Rendering,
}

/// Figures of what has been done.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct Figures {
    /// Camera paths traced to learn from.
    pub learning_paths: u64,
    /// Rendered paths learned from besides.
    pub counted_paths: u64,
    /// Paths of both kinds that the distributions in use were made of.
    pub distribution_paths: u64,
    /// Rays traced while learning.
    pub learning_rays: u64,
    /// Seconds of learning, distributions included; what counting costs while rendering is not apart.
    pub learning_seconds: f64,
    /// Seconds of learning that went into making distributions.
    pub distribution_seconds: f64,
    /// Cells that learning paths visited.
    pub visited_cells: usize,
    /// Cells with a distribution of their own.
    pub learned_cells: usize,
    /// Most bytes the grid held while learning: counters and distributions.
    pub grid_peak_bytes: usize,
    /// Bytes the grid holds, counters included.
    pub grid_bytes: usize,
    /// Camera paths that have trained the radiance cache.
    pub training_paths: u64,
    /// Camera paths rendered.
    pub samples: u64,
    /// Rays traced while rendering, shadow rays included.
    pub rays: u64,
    /// Seconds of rendering.
    pub render_seconds: f64,
    /// The share of the variance of pixels' means, as samples' own spread tells it, that is not there: points
    /// of a sequence do better than chance. 0 until it is known; below 0 where they do worse.
    #[serde(default)]
    pub variance_saved: f64,
}

impl Figures {
    /// Seconds of learning and rendering.
    pub fn elapsed_seconds(&self) -> f64 {
        self.learning_seconds + self.render_seconds
    }

    /// Counts what was done for a film that is gone on from, or shown together with this one.
    pub(crate) fn add(&mut self, before: &Self) {
        self.samples += before.samples;
        // Paths that taught what it was made with, though nothing may have been learned again.
        self.learning_paths = self.learning_paths.max(before.learning_paths);
        self.rays += before.rays;
        self.learning_rays += before.learning_rays;
        self.learning_seconds += before.learning_seconds;
        self.distribution_seconds += before.distribution_seconds;
        self.render_seconds += before.render_seconds;
    }

    /// Estimated root of the relative mean squared error of these figures' film: [`Film::noise`], less what
    /// low-discrepancy samples save.
    pub fn noise_of(&self, film: &Film) -> f64 {
        film.noise() * (1.0 - self.variance_saved).max(0.0).sqrt()
    }
}
