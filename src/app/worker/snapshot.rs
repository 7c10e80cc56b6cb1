//! What the render thread tells the window: a picture, and what was done for it.

use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use super::request::Request;
use crate::app::threads::lock;
use crate::light_grid::{LearningGrid, LightGrid};
use crate::radiance_cache::CacheFacts;
use crate::render::block_errors::BlockErrors;
use crate::render::film::Film;
use crate::render::gpu::{DeviceFilm, Gpu, GpuFigures};
use crate::render::light_groups::GroupImage;
use crate::render::{Figures, Sampling, View};

/// What the worker is doing.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Activity {
    /// A small picture while the camera moves.
    Moving,
    /// Learning, the share done in `[0,1]`.
    Learning(f32),
    /// Adding samples.
    Rendering,
    /// Asked to pause.
    Paused,
    /// A stop rule was met.
    Done,
}

/// How good a picture was at one moment.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Point {
    /// Seconds of learning and rendering.
    pub seconds: f64,
    /// Samples per pixel.
    pub samples: f64,
    /// Estimated relative RMS error.
    pub noise: f64,
    /// The true one, where there is a reference.
    pub error: Option<f64>,
}

/// One picture and what was done for it.
#[derive(Clone)]
pub(crate) struct SessionSnapshot {
    /// How the map was sampled.
    pub sampling: Sampling,
    /// The sums. While the window shows those on its own device in every frame, or shows no newer ones for
    /// now, they are as they were read last: at most a few seconds ago, and the last ones when nothing is
    /// rendered.
    pub film: Arc<Film>,
    /// Fewest samples of any of its pixels.
    pub samples: u32,
    /// What was done for them.
    pub figures: Figures,
    /// [`crate::render::Session::comparable_seconds`].
    pub comparable_seconds: Option<f64>,
    /// [`crate::render::Session::noise`].
    pub noise: f64,
    /// [`Film::invalid_samples`].
    pub invalid_samples: u64,
    /// The distributions in use.
    pub grid: Option<Arc<LightGrid>>,
    /// The GPU at work; `None` is the CPU.
    pub gpu: Option<Arc<GpuFigures>>,
    /// The sums of `film` or later ones where a GPU has them, and that GPU.
    pub(crate) on_device: Option<(Gpu, DeviceFilm)>,
}

impl SessionSnapshot {
    /// Samples a pixel, in the mean.
    pub(crate) fn mean_samples(&self) -> f64 {
        self.figures.samples as f64 / self.film.pixels().len().max(1) as f64
    }

    /// Whether pixels all over the picture have a sample: before, there would be streaks.
    pub(crate) fn is_begun(&self) -> bool {
        self.samples > 0 || self.film.is_begun()
    }
}

/// Why there is no radiance cache to be looked at.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum NoCache {
    /// Nobody has asked for it.
    Unasked,
    /// It is there for cached light, which only denoised pictures show.
    NotDenoised,
    /// A split view compares pictures, and shows no cached light.
    Split,
    /// The device has many samples before a cache would be trained.
    QuickDevice,
    /// A light mix has one for each group.
    Mixed,
    /// Light that has met one surface needs none.
    OneBounce,
    /// It will be.
    Untrained,
}

/// The latest picture.
#[derive(Clone)]
pub(crate) struct Snapshot {
    /// Counts snapshots.
    pub number: u64,
    /// The step of learning whose grid and counters these are; `None` is the last.
    pub learning_step: Option<usize>,
    /// What it was rendered for.
    pub request: Arc<Request>,
    /// What is going on.
    pub activity: Activity,
    /// The picture.
    pub main: SessionSnapshot,
    /// What has been done for it by now; its own figures are those of its film.
    pub now: Figures,
    /// The plain picture of a split view.
    pub plain: Option<SessionSnapshot>,
    /// What learning counted, once it has ended.
    pub counters: Option<Arc<LearningGrid>>,
    /// What is in the radiance cache of cached light.
    pub cache: Result<Arc<CacheFacts>, NoCache>,
    /// How the error of `main` and of `plain` fell.
    pub curves: [Vec<Point>; 2],
    /// The film by cached light that is shown together with `main`.
    pub backdrop: Option<Backdrop>,
    /// Seconds spent on a backdrop whose light comes from a radiance cache, which are none of `main`'s.
    pub cached_seconds: f64,
    /// Errors of the films that are shown without noise, where they are known.
    pub errors: Option<BlockErrors>,
    /// A sentence where paths end with much of their light left.
    pub cut_off: Option<Arc<str>>,
    /// The light of each group of a light mix, without factors.
    pub groups: Arc<[GroupImage]>,
    /// Whoever shows it says here when the next one will be wanted.
    pub(in crate::app) rest: Arc<PublishThrottle>,
}

/// How long no newer picture will be shown: films are large, and none is copied for nothing.
pub(in crate::app) struct PublishThrottle(Mutex<Instant>);

impl PublishThrottle {
    pub(super) fn new() -> Self {
        Self(Mutex::new(Instant::now()))
    }

    /// No newer picture will be shown before this.
    pub(in crate::app) fn set_end(&self, end: Instant) {
        *lock(&self.0) = end;
    }

    /// Whether it lasts for longer than this.
    pub(super) fn lasts(&self, time: Duration) -> bool {
        *lock(&self.0) > Instant::now() + time
    }
}

/// A film of the same view and size by light from a radiance cache. It is shown together with the picture's own.
#[derive(Clone)]
pub(crate) struct Backdrop {
    /// The sums.
    pub film: Arc<Film>,
    /// Its samples, of all pixels together.
    pub samples: u64,
    /// What one of its samples counts beside one of the picture's own.
    pub worth: f32,
}

impl Snapshot {
    /// Equal snapshots alone have the same.
    pub(crate) fn key(&self) -> (u64, Option<usize>) {
        (self.number, self.learning_step)
    }

    /// Samples a pixel of the picture by now, in the mean, of cached light too.
    pub(crate) fn mean_samples(&self) -> f64 {
        let main = self.now.samples as f64 / self.main.film.pixels().len().max(1) as f64;
        main + self.cached_samples()
    }

    /// The same of the films that are shown.
    pub(crate) fn film_samples(&self) -> f64 {
        self.main.mean_samples() + self.cached_samples()
    }

    fn cached_samples(&self) -> f64 {
        let cached = self.backdrop.as_ref();
        cached.map_or(0.0, |it| it.samples as f64 / it.film.pixels().len().max(1) as f64)
    }

    /// Seconds of learning and rendering, cached light included.
    pub(crate) fn seconds(&self) -> f64 {
        self.now.elapsed_seconds() + self.cached_seconds
    }

    /// What is seen in the film: while the camera moves it is one of another size.
    pub(crate) fn view(&self) -> View {
        let (view, film) = (&self.request.view, &self.main.film);
        if view.crop.is_some() { view.clone() } else { view.of_size(film.width, film.height) }
    }

    /// Seconds of the picture that was begun last, of those that are shown.
    pub(crate) fn youngest_seconds(&self) -> f64 {
        let plain = self.plain.as_ref().map(|plain| plain.figures.elapsed_seconds());
        plain.map_or(self.seconds(), |seconds| seconds.min(self.seconds()))
    }

    /// Whether the picture has its full size and every pixel a sample: it has not at first and while
    /// the camera moves.
    pub(crate) fn is_whole(&self) -> bool {
        self.main.samples > 0 && self.main.film.width == self.request.view.width
    }

    /// Whether it may be saved and kept: a movement's pictures are of less, whatever their size.
    pub(crate) fn is_lasting(&self) -> bool {
        self.is_whole() && !self.request.moving
    }

    /// Whether there is anything to be seen.
    pub(crate) fn has_picture(&self) -> bool {
        let is_paused = self.activity == Activity::Paused && self.main.figures.samples > 0;
        self.backdrop.is_some() || is_paused || self.main.is_begun()
    }
}
