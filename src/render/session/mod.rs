//! One session: learn, then render pass by pass, until told to stop.
//!
//! [`View`] says what is wanted, [`Session::advance`] does a bounded piece of work and says how far
//! it is, [`Film`] holds the sums. A seed gives the same picture whatever the threads: every
//! sample's random numbers depend on its pixel and index alone, a pixel's samples are added in
//! order, and learning counts integers.

use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};
#[cfg(feature = "window")]
use std::sync::{Arc, Weak};
use std::time::{Duration, Instant};

mod host_film;
mod learning;
mod noise;
mod state;

use host_film::HostFilm;
use learning::{Learning, Stage};
pub use noise::Doubling;
use noise::MIN_SAMPLES_FOR_NOISE;
pub(crate) use state::SessionState;
use state::Spent;

use super::film::{BEGINNINGS, Film};
use super::gi::{CacheTraining, PATHS_AT_A_TIME};
use super::pass::{Coverage, Pass};
use super::{Figures, Phase, Sampling, StopRule, View, cpu, gpu};
use crate::environment::Environment;
use crate::error::Result;
use crate::light_grid::{LearningGrid, LightGrid};
use crate::path::{PathTracer, World};
use crate::sampler::Sequence;

/// Seconds a pass on a GPU should take: what is told to the user between two is this old at most.
const GPU_PASS_SECONDS: f64 = 0.1;
/// A GPU's film is read at least this often: so much work is lost with a device.
const KEPT_SECONDS: Duration = Duration::from_secs(5);
/// Learning takes at most this share of the seconds asked for.
const LEARNING_TIME_SHARE: f64 = 0.05;

/// A picture in the making.
pub struct Session<'a> {
    world: &'a World,
    environment: &'a Environment,
    /// Does the work, if it is there, in place of the CPU.
    gpu: Option<Box<gpu::Renderer>>,
    state: SessionState,
}

impl<'a> Session<'a> {
    /// Starts a session on the CPU; nothing is traced yet.
    pub fn new(world: &'a World, environment: &'a Environment, mut view: View) -> Self {
        view.sharing = view.sharing.decided(world, &view);
        let rays = view.rays();
        let whole_map = match view.sampling {
            Sampling::Bsdf => None,
            _ if environment.is_black() => None,
            _ => LightGrid::whole_map(environment.tile_energies()),
        };
        let learning = Learning::new(world, environment, &view, &rays);
        let training = CacheTraining::new(world, environment, &view, &rays);
        let state = SessionState {
            view,
            rays,
            film: HostFilm::new(),
            samples: 0,
            skipped: 0,
            doubling: Mutex::default(),
            whole_map,
            learned: None,
            sequence: Sequence::default(),
            learning,
            training,
            figures: Figures::default(),
            here: Spent::default(),
        };
        Self { world, environment, gpu: None, state }
    }

    /// Starts a session on a GPU, to which this world and this environment are uploaded.
    ///
    /// # Errors
    /// If it does not fit on the device.
    pub fn on_gpu(
        world: &'a World,
        environment: &'a Environment,
        view: View,
        uploaded: &gpu::UploadedScene,
    ) -> Result<Self> {
        Self::on(world, environment, view, Some(uploaded))
    }

    /// Starts a session on the CPU or, if this world and this environment are uploaded to one, on a GPU.
    ///
    /// # Errors
    /// If it does not fit on the device.
    pub fn on(
        world: &'a World,
        environment: &'a Environment,
        view: View,
        uploaded: Option<&gpu::UploadedScene>,
    ) -> Result<Self> {
        let mut session = Self::new(world, environment, view);
        if let Some(uploaded) = uploaded {
            session.continue_on_gpu(uploaded)?;
        }
        Ok(session)
    }

    /// Does one piece of work: a learning pass, or one that brings every pixel `samples` further.
    /// Returns early, with what is done so far kept, when `cancel` becomes true. A GPU may still be at
    /// work on the last hundredths of a second of it; see [`Self::settle`].
    ///
    /// # Errors
    /// If the GPU fails; the film as it was read last is kept, and [`Self::continue_on_cpu`] goes on
    /// from there.
    pub fn advance(&mut self, samples: u32, cancel: &AtomicBool) -> Result<()> {
        match self.phase() {
            Phase::Learning => {
                let start = Instant::now();
                let result = self.learn(cancel);
                self.state.figures.learning_seconds += start.elapsed().as_secs_f64();
                result
            }
            Phase::Rendering => {
                self.train(1, cancel)?;
                self.render_timed(samples, Coverage::All, cancel)
            }
        }
    }

    /// Gives every `every`-th pixel of every `every`-th row its first sample: a picture can be made of
    /// so few that shows the whole view. It is the sample that [`Self::advance`] would take, which
    /// goes on with the others; but a radiance cache is trained by so many fewer paths, and no pixels share:
    /// where they do, [`Self::advance`] takes samples in place of these. With an `every` of 1 it gives each
    /// pixel its next one alone. Does nothing on a GPU, whose first samples come all at once.
    pub fn begin(&mut self, every: u32, cancel: &AtomicBool) {
        let every = every.max(1);
        if (self.state.samples == 0 || every == 1) && !self.is_on_gpu() {
            // Only a GPU fails.
            let _ = self.train(every, cancel);
            let _ = self.render_timed(1, Coverage::Every(every), cancel);
        }
    }

    /// How far apart the pixels are that [`Self::begin`] should give their first sample next: nearer and
    /// nearer. `None` when enough have one to go on with all, and on a GPU.
    pub fn next_beginning(&self) -> Option<u32> {
        if self.state.samples > 0 || self.is_on_gpu() {
            return None;
        }
        let pixels = |every| {
            let [columns, rows] =
                [self.state.view.width, self.state.view.height].map(|n| n.div_ceil(every));
            u64::from(columns) * u64::from(rows)
        };
        BEGINNINGS.into_iter().find(|every| self.state.figures.samples < pixels(*every))
    }

    /// Whether pixels all over the picture have a sample: those that [`Self::begin`] begins with or, on a
    /// GPU, all.
    pub fn is_begun(&self) -> bool {
        self.state.samples > 0 || (!self.is_on_gpu() && self.film().is_begun())
    }

    /// Waits for what a GPU is still at work on and reads its film, so that film and figures are those
    /// of now.
    ///
    /// # Errors
    /// As [`Self::advance`].
    pub fn settle(&mut self) -> Result<()> {
        let start = Instant::now();
        if let Some(renderer) = &mut self.gpu {
            renderer.settle()?;
            self.state.film.update(&self.state.view, |film| renderer.read_film(film))?;
            self.spend(start.elapsed().as_secs_f64(), 0);
        }
        Ok(())
    }

    /// Lets the CPU take over from a GPU, with everything learned and rendered so far, as far as it can
    /// still be read.
    pub fn continue_on_cpu(&mut self) {
        if !self.is_on_gpu() {
            return;
        }
        let film = self.film();
        let skipped = u64::from(self.state.skipped) * film.pixels().len() as u64;
        (self.state.samples, self.state.figures.samples) =
            (film.min_samples(), film.total_samples() - skipped);
        self.state.figures.rays = self.figures().rays;
        // With a device goes what was done since its film was read.
        self.state.sequence.first_sample = self.state.sequence.first_sample.min(self.state.samples);
        self.gpu = None;
        self.state.here = Spent::default();
    }

    /// Lets a GPU take over from the CPU, to which this session's world and environment are uploaded, with
    /// everything learned and rendered so far.
    ///
    /// # Errors
    /// If it does not fit on the device; the session stays where it is.
    pub fn continue_on_gpu(&mut self, uploaded: &gpu::UploadedScene) -> Result<()> {
        let (lit, learns) = ((self.world, self.environment), self.phase() == Phase::Learning);
        let (view, rays, film) = (&self.state.view, &self.state.rays, self.film_to_go_on());
        let renderer = gpu::Renderer::new(uploaded, lit, view, rays, film, learns)?;
        self.move_to(renderer)
    }

    /// [`Self::continue_on_gpu`] if that need not wait for kernels. Otherwise a thread compiles them, which holds what
    /// `until_then` gave, unless it has begun before, for as long; it is returned.
    ///
    /// # Errors
    /// As [`Self::continue_on_gpu`]; or, once, if kernels were refused that were to be compiled.
    #[cfg(feature = "window")]
    pub(crate) fn continue_on_gpu_if_compiled(
        &mut self,
        uploaded: &gpu::UploadedScene,
        until_then: impl FnOnce() -> Arc<gpu::CompileGuard>,
    ) -> Result<Option<Weak<gpu::CompileGuard>>> {
        let (lit, learns) = ((self.world, self.environment), self.phase() == Phase::Learning);
        let (view, rays, film) = (&self.state.view, &self.state.rays, self.film_to_go_on());
        match gpu::Renderer::new_or_held(uploaded, lit, view, rays, film, learns, until_then)? {
            gpu::MaybeReady::CompileGuard(held) => Ok(Some(held)),
            gpu::MaybeReady::Ready(renderer) => self.move_to(renderer).map(|()| None),
        }
    }

    fn film_to_go_on(&self) -> Option<&Film> {
        (self.state.figures.samples > 0).then(|| self.film())
    }

    fn move_to(&mut self, mut renderer: gpu::Renderer) -> Result<()> {
        renderer.set_grid(self.state.learned.as_ref().or(self.state.whole_map.as_ref()))?;
        renderer.set_cache(self.state.training.as_ref().and_then(CacheTraining::cache))?;
        self.gpu = Some(Box::new(renderer));
        self.state.here = Spent::default();
        Ok(())
    }

    /// Figures of the GPU at work; `None` on the CPU.
    pub fn gpu_figures(&self) -> Option<gpu::GpuFigures> {
        self.gpu.as_ref().map(|renderer| renderer.figures())
    }

    /// Samples per pixel that the next pass should take: growing with what is there, so that few
    /// passes are needed and none is much longer than those before it. Where noise is asked for, or
    /// something is learned of what is rendered, it depends on counts alone, so that the picture is
    /// repeatable; else a GPU takes as many as it can in a moment.
    pub fn next_pass(&self, rule: &StopRule) -> u32 {
        let samples = self.state.samples;
        let is_counting =
            self.state.learning.as_ref().is_some_and(|learning| learning.stage == Stage::Counting);
        let pass = match self.gpu {
            // Each look at the noise reads the film.
            Some(_) if rule.noise.is_some() => (samples / 8).clamp(1, 64),
            Some(_) if !is_counting => {
                let pixels = self.state.view.pixels() as f64;
                let affordable = self
                    .seconds_per_sample()
                    .map_or(1, |each| (GPU_PASS_SECONDS / (each * pixels).max(1e-9)) as u32);
                affordable.max(samples / 16).min(samples).clamp(1, 64)
            }
            _ => (samples / 16).clamp(1, 64),
        };
        // Where samples are a power of two the radiance cache and the distributions learn, and it is found out
        // how good the picture is.
        let pass = pass.min((samples + 1).next_power_of_two() - samples);
        rule.samples.map_or(pass, |limit| pass.min(limit.saturating_sub(samples)).max(1))
    }

    /// Fewest samples any pixel has: [`Film::min_samples`] without a film.
    pub fn samples(&self) -> u32 {
        self.state.samples
    }

    /// What the next [`Self::advance`] will do.
    pub fn phase(&self) -> Phase {
        match &self.state.learning {
            Some(Learning { stage: Stage::Tracing, .. }) => Phase::Learning,
            _ => Phase::Rendering,
        }
    }

    /// Whether another learning pass, as long as all before it, would take more than its share of the
    /// seconds asked for.
    pub fn has_learned_enough(&self, rule: &StopRule) -> bool {
        let share = |seconds| LEARNING_TIME_SHARE * seconds;
        rule.seconds.is_some_and(|s| 2.0 * self.state.figures.learning_seconds >= share(s))
    }

    /// Goes over to rendering with what was learned so far.
    pub fn finish_learning(&mut self) {
        if self.phase() == Phase::Rendering {
            return;
        }
        let stage = if self.counts_rendered() { Stage::Counting } else { Stage::Over };
        if let Some(learning) = &mut self.state.learning {
            learning.stage = stage;
        }
    }

    /// Replaces what was learned; for tests of unbiasedness and for inspection.
    ///
    /// # Errors
    /// If it does not fit on the GPU.
    pub fn set_grid(&mut self, grid: LightGrid) -> Result<()> {
        self.state.learning = None;
        self.state.learned = Some(grid).filter(|_| !self.environment.is_black());
        self.take_up_distributions()
    }

    /// Goes on with a radiance cache that paths have trained before, in the same world with the same
    /// light. It is to suit the camera ([`CacheTraining::suits`]).
    ///
    /// # Errors
    /// If it does not fit on the GPU.
    pub(crate) fn set_training(&mut self, training: CacheTraining) -> Result<()> {
        let training = self.state.training.insert(training);
        self.gpu.as_mut().map_or(Ok(()), |renderer| renderer.set_cache(training.cache()))
    }

    /// The training of the radiance cache so far, for another session; this one follows all paths to
    /// their end from now on.
    pub(crate) fn take_training(&mut self) -> Option<CacheTraining> {
        self.state.training.take()
    }

    /// The radiance cache in the making, for inspection.
    pub(crate) fn training(&self) -> Option<&CacheTraining> {
        self.state.training.as_ref()
    }

    /// Whether no samples to come change what is sampled by: each is then a matter of its pixel and its
    /// index alone.
    pub fn has_final_distributions(&self) -> bool {
        self.state.learning.as_ref().is_none_or(Learning::is_over)
    }

    /// Goes on from another film of this view with what was learned so far, as if its samples were
    /// this session's. The first `skipped` of each pixel are others': [`Self::film`] counts them without
    /// their light. Whoever took the rest learned as this session did, so that all films of a view
    /// together are the one that a single session would have made.
    ///
    /// # Errors
    /// If the GPU fails; [`Self::continue_on_cpu`] goes on from that film.
    pub(crate) fn continue_from(&mut self, mut film: Film, skipped: u32) -> Result<()> {
        // A GPU counts its rays on its film; if it fails, it will be heard of below.
        let _ = self.settle();
        self.state.figures.rays = self.figures().rays;
        film.skip(skipped);
        self.state.skipped = skipped;
        self.state.samples = film.min_samples();
        let set = self.gpu.as_mut().map_or(Ok(()), |renderer| renderer.set_film(&film));
        self.state.film.put(film);
        set
    }

    /// Counts what an earlier process did for the film that is gone on from.
    pub(crate) fn add_figures(&mut self, before: &Figures) {
        let figures = &mut self.state.figures;
        figures.samples += before.samples;
        // Paths that taught what it was made with, though nothing may have been learned again.
        figures.learning_paths = figures.learning_paths.max(before.learning_paths);
        figures.rays += before.rays;
        figures.learning_rays += before.learning_rays;
        figures.learning_seconds += before.learning_seconds;
        figures.distribution_seconds += before.distribution_seconds;
        figures.render_seconds += before.render_seconds;
    }

    /// What was counted, for inspection.
    pub fn counters(&self) -> Option<&LearningGrid> {
        self.state.learning.as_ref().map(|learning| &learning.grid)
    }

    /// The film so far. A GPU's is read back at the first call after an [`Self::advance`], which takes
    /// its time; should the GPU fail meanwhile, it is the film as it was read last, and the next call of
    /// [`Self::advance`] or [`Self::settle`] says why.
    pub fn film(&self) -> &Film {
        self.state.film.get(&self.state.view, |film| {
            if let Some(renderer) = &self.gpu {
                // What fails is heard of at the next call.
                let _ = renderer.read_film(film);
            }
        })
    }

    /// The film, of which nobody needs a copy then.
    pub(crate) fn into_film(mut self) -> Film {
        self.film();
        self.state.film.take(&self.state.view)
    }

    /// Whether a GPU is at work.
    pub fn is_on_gpu(&self) -> bool {
        self.gpu.is_some()
    }

    /// The film where a GPU keeps it, and that GPU; `None` on the CPU.
    pub(crate) fn film_on_device(&self) -> Option<(gpu::Gpu, gpu::DeviceFilm)> {
        self.gpu.as_ref()?.film_on_device()
    }

    /// What is rendered; it is decided whether pixels share.
    pub fn view(&self) -> &View {
        &self.state.view
    }

    /// The grid in use, once learning has ended.
    pub fn grid(&self) -> Option<&LightGrid> {
        self.state.learned.as_ref().or(self.state.whole_map.as_ref())
    }

    /// What has been done so far. A GPU's rays are those up to the last reading of its film.
    pub fn figures(&self) -> Figures {
        let rays = self.gpu.as_ref().map_or(0, |renderer| renderer.rays());
        let variance_saved = self.doubling().saved();
        Figures { rays: self.state.figures.rays + rays, variance_saved, ..self.state.figures }
    }

    /// Seconds of learning and rendering so far.
    pub fn elapsed_seconds(&self) -> f64 {
        self.state.figures.elapsed_seconds()
    }

    /// Seconds that a sample takes on the device at work; `None` until it has taken a thousand.
    pub(crate) fn seconds_per_sample(&self) -> Option<f64> {
        let Spent { seconds, samples } = self.state.here;
        (samples > 1000).then(|| seconds / samples as f64)
    }

    /// Whether a rule says to stop. Noise is only asked for from 16 samples on.
    pub fn is_done(&self, rule: &StopRule) -> bool {
        let samples = self.state.samples;
        rule.samples.is_some_and(|limit| samples >= limit)
            || (samples > 0 && rule.seconds.is_some_and(|limit| self.elapsed_seconds() >= limit))
            || (samples >= MIN_SAMPLES_FOR_NOISE
                && rule.noise.is_some_and(|limit| self.noise() <= limit))
    }

    fn tracer<'b>(&'b self, counts: Option<&'b LearningGrid>) -> PathTracer<'b> {
        let cache = self.state.training.as_ref().and_then(CacheTraining::cache);
        let tracer = self.state.view.tracer(self.world, self.environment, self.grid());
        PathTracer { counts, cache, ..tracer }
    }

    /// Trains the radiance cache, if there is one, as far as it is to be before the next pass, which is about
    /// every `every`-th pixel of every `every`-th row. What has been cut short goes on at the next call.
    fn train(&mut self, every: u32, cancel: &AtomicBool) -> Result<()> {
        let start = Instant::now();
        if let Some(training) = &mut self.state.training {
            training.begin(&self.state.view, self.state.samples, every);
        }
        while let Some(training) = &self.state.training
            && let Some(paths) = training.next()
            && !cancel.load(Ordering::Relaxed)
        {
            let sums = training.sums();
            let (done, rays) = match &mut self.gpu {
                None => {
                    let paths = paths.start..paths.end.min(paths.start + PATHS_AT_A_TIME);
                    let rays = cpu::train(
                        &self.tracer(None),
                        &self.state.rays,
                        &self.state.view,
                        paths.clone(),
                        sums,
                    );
                    (paths.end, rays)
                }
                Some(renderer) => renderer.train(paths, sums, cancel)?,
            };
            self.state.figures.learning_rays += rays;
            if let Some(training) = &mut self.state.training {
                self.state.figures.training_paths = training.advance(done);
                if let Some(renderer) = &mut self.gpu {
                    renderer.set_cache(training.cache())?;
                }
            }
        }
        self.state.figures.learning_seconds += start.elapsed().as_secs_f64();
        Ok(())
    }

    /// Begins the sequence that goes with the distributions in use, and gives them to the GPU, if one is at
    /// work.
    fn take_up_distributions(&mut self) -> Result<()> {
        let grid = self.state.learned.as_ref().or(self.state.whole_map.as_ref());
        let generation = grid.map_or(0, LightGrid::generation);
        if generation != self.state.sequence.generation {
            // Pixels that are ahead begin later in it.
            self.state.sequence = Sequence { generation, first_sample: self.state.samples };
        }
        self.gpu.as_mut().map_or(Ok(()), |renderer| renderer.set_grid(grid))
    }

    /// [`Self::render`], `samples` further. Making distributions counts as learning.
    fn render_timed(
        &mut self,
        samples: u32,
        coverage: Coverage,
        cancel: &AtomicBool,
    ) -> Result<()> {
        let (start, figures) = (Instant::now(), self.state.figures);
        let result = self.render(self.state.samples.saturating_add(samples), coverage, cancel);
        let distributions = self.state.figures.distribution_seconds - figures.distribution_seconds;
        self.state.figures.learning_seconds += distributions;
        let samples = self.state.figures.samples - figures.samples;
        self.spend(start.elapsed().as_secs_f64() - distributions, samples);
        result
    }

    /// Notes seconds of rendering and the samples taken in them.
    fn spend(&mut self, seconds: f64, samples: u64) {
        self.state.figures.render_seconds += seconds;
        self.state.here.seconds += seconds;
        self.state.here.samples += samples;
    }

    fn render(&mut self, target: u32, coverage: Coverage, cancel: &AtomicBool) -> Result<()> {
        let stride = self.prepare_counting(target - self.state.samples);
        let pass = Pass { target, coverage, stride, sequence: self.state.sequence };
        let learning = self.state.learning.as_ref().filter(|learning| !learning.is_over());
        let counts = learning.map(|learning| &learning.grid);
        let samples = match &mut self.gpu {
            None => {
                let mut film = self.state.film.take(&self.state.view);
                let tracer = self.tracer(counts);
                let (samples, rays) = cpu::render(
                    &tracer,
                    &self.state.rays,
                    &self.state.view,
                    pass,
                    &mut film,
                    cancel,
                );
                self.state.samples = film.min_samples();
                self.state.film.put(film);
                self.state.figures.rays += rays;
                samples
            }
            Some(renderer) => {
                self.state.film.outdate();
                let done = renderer.render(pass, counts, cancel)?;
                self.state.samples = done.least;
                if self.state.film.is_older_than(KEPT_SECONDS) {
                    // What is on the host outlives the device; what fails is heard of at the next call.
                    let _ =
                        self.state.film.update(&self.state.view, |film| renderer.read_film(film));
                }
                done.samples
            }
        };
        self.state.figures.samples += samples;
        // A GPU's film may have been read for the clock's sake: noise does not depend on that.
        let is_noted = self.state.skipped == 0 && !self.is_on_gpu();
        if let Some(film) = self.state.film.known().filter(|_| is_noted) {
            self.note_doubling(film);
        }
        let is_whole = self.state.samples >= target;
        self.learn_from_rendered(samples.div_ceil(u64::from(stride)), is_whole)
    }
}
