//! One session: learn, then render pass by pass, until told to stop.
//!
//! [`View`] says what is wanted, [`Session::advance`] does a bounded piece of work and says how far
//! it is, [`Film`] holds the sums. A seed gives the same picture whatever the threads: every
//! sample's random numbers depend on its pixel and index alone, a pixel's samples are added in
//! order, and learning counts integers.

use std::sync::atomic::{AtomicBool, Ordering};
#[cfg(feature = "window")]
use std::sync::{Arc, Weak};
use std::time::{Duration, Instant};

mod host_film;
mod learning;
mod noise;
mod state;

use host_film::HostFilm;
use learning::{Learning, Stage, Tiles};
pub use noise::Doubling;
pub(super) use noise::MIN_SAMPLES_FOR_NOISE;
use noise::Noise;
pub(crate) use state::SessionState;
use state::Spent;

use super::film::Film;
use super::gi::{CacheTraining, PATHS_AT_A_TIME};
use super::pass::{Coverage, Pass};
use super::{Figures, Phase, View, cpu, gpu, view_probe};
use crate::environment::Environment;
use crate::error::Result;
use crate::light_grid::{LearningGrid, LightGrid};
use crate::path::{Lit, World};
use crate::sampler::Sequence;

/// A GPU's film is read at least this often: so much work is lost with a device.
const KEPT_SECONDS: Duration = Duration::from_secs(5);
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
        let tiles = Tiles::new((world, environment), &view);
        let training = CacheTraining::new((world, environment), &view);
        let start = Instant::now();
        let lights = view_probe::lights_of((world, environment), &view, tiles.grid());
        let learning_seconds = start.elapsed().as_secs_f64();
        let state = SessionState {
            lights,
            view,
            film: HostFilm::new(),
            samples: 0,
            skipped: 0,
            noise: Noise::default(),
            tiles,
            sequence: Sequence::default(),
            training,
            figures: Figures { learning_seconds, ..Figures::default() },
            here: Spent::default(),
        };
        Self { world, environment, gpu: None, state }
    }

    /// Starts a session on the CPU or, if this world and this environment are uploaded to one, on a GPU.
    ///
    /// # Errors
    /// If it does not fit on the device.
    pub fn on(lit: Lit<'a>, view: View, uploaded: Option<&gpu::UploadedScene>) -> Result<Self> {
        let mut session = Self::new(lit.0, lit.1, view);
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
                self.render(samples, Coverage::All, cancel)
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
            let _ = self.render(1, Coverage::Every(every), cancel);
        }
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
            self.state.spend(start.elapsed().as_secs_f64(), 0);
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
        self.move_to(gpu::Renderer::new(uploaded, lit, self.state.asked(), learns)?)
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
        match gpu::Renderer::new_or_held(uploaded, lit, self.state.asked(), learns, until_then)? {
            gpu::MaybeReady::CompileGuard(held) => Ok(Some(held)),
            gpu::MaybeReady::Ready(renderer) => self.move_to(renderer).map(|()| None),
        }
    }

    fn move_to(&mut self, mut renderer: gpu::Renderer) -> Result<()> {
        if self.state.figures.samples > 0 {
            renderer.set_film(self.film())?;
        }
        renderer.set_grid(self.state.tiles.grid())?;
        renderer.set_cache(self.state.training.as_ref().and_then(CacheTraining::cache))?;
        self.gpu = Some(Box::new(renderer));
        self.state.here = Spent::default();
        Ok(())
    }

    /// Figures of the GPU at work; `None` on the CPU.
    pub fn gpu_figures(&self) -> Option<gpu::GpuFigures> {
        self.gpu.as_ref().map(|renderer| renderer.figures())
    }

    /// Fewest samples any pixel has: [`Film::min_samples`] without a film.
    pub fn samples(&self) -> u32 {
        self.state.samples
    }

    /// What the next [`Self::advance`] will do.
    pub fn phase(&self) -> Phase {
        match self.state.tiles.stage() {
            Stage::Tracing => Phase::Learning,
            Stage::Counting | Stage::Over => Phase::Rendering,
        }
    }

    /// Whether rendered paths are learned from.
    pub(super) fn is_counting(&self) -> bool {
        self.state.tiles.stage() == Stage::Counting
    }

    /// Goes over to rendering with what was learned so far.
    pub fn finish_learning(&mut self) {
        self.state.tiles.finish_tracing(self.world, &self.state.view);
    }

    /// Goes on from what paths have counted before in the same world under the same map, for another
    /// camera near by: it is rendered with what they know, and rendered paths add to it. `false` if it
    /// does not suit, as where rendered paths add nothing, and nothing has changed.
    ///
    /// # Errors
    /// If it does not fit on the GPU.
    pub(crate) fn continue_learning(&mut self, counted: &LearningGrid) -> Result<bool> {
        let state = &mut self.state;
        if !state.tiles.continue_from(counted, self.world, &state.view) {
            return Ok(false);
        }
        state.tiles.update(self.environment, &mut state.figures);
        self.take_up_distributions().map(|()| true)
    }

    /// Replaces what was learned; for tests of unbiasedness and for inspection.
    ///
    /// # Errors
    /// If it does not fit on the GPU.
    pub fn set_grid(&mut self, grid: LightGrid) -> Result<()> {
        self.state.tiles.set(Some(grid).filter(|_| !self.environment.is_black()));
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
        self.state.tiles.stage() == Stage::Over
    }

    /// Goes on from another film of this view with what was learned so far, as if its samples were
    /// this session's; `before` is what an earlier process did for it, and what its noise is found by. The
    /// first `skipped` of each pixel are others': [`Self::film`] counts them without their light. Whoever took
    /// the rest learned as this session did, so that all films of a view together are the one that a single
    /// session would have made.
    ///
    /// # Errors
    /// If the GPU fails; [`Self::continue_on_cpu`] goes on from that film.
    pub(super) fn continue_from(
        &mut self,
        mut film: Film,
        (before, noted): (&Figures, Doubling),
        skipped: u32,
    ) -> Result<()> {
        self.state.figures.add(before);
        self.state.noise.set(noted);
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

    /// What was counted, for inspection.
    pub fn counters(&self) -> Option<&LearningGrid> {
        self.state.tiles.counters()
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
        self.state.tiles.grid()
    }

    /// What has been done so far. A GPU's rays are those up to the last reading of its film.
    pub fn figures(&self) -> Figures {
        let rays = self.gpu.as_ref().map_or(0, |renderer| renderer.rays());
        let variance_saved = self.state.noise.noted().saved();
        Figures { rays: self.state.figures.rays + rays, variance_saved, ..self.state.figures }
    }

    /// Seconds of learning and rendering as if all samples had been taken on the device at work: another may be tens of
    /// times as fast. `None` while it is not known what they take there: until each pixel has had two, or so.
    #[cfg(feature = "window")]
    pub(crate) fn comparable_seconds(&self) -> Option<f64> {
        self.state.comparable_seconds()
    }

    /// Seconds that a sample takes on the device at work; `None` until it has taken a thousand.
    pub(crate) fn seconds_per_sample(&self) -> Option<f64> {
        self.state.here.seconds_per_sample()
    }

    /// [`Film::noise`] of [`Self::film`], which looks at every pixel once, less what low-discrepancy samples
    /// save ([`crate::render::Figures::variance_saved`]); infinite if some of its samples are others'.
    pub fn noise(&self) -> f64 {
        let noise = || match self.state.skipped {
            0 => {
                let film = self.film();
                self.state.noise.note(film, self.state.samples, self.is_on_gpu());
                self.figures().noise_of(film)
            }
            _ => f64::INFINITY,
        };
        self.state.film.noise(noise)
    }

    /// What noise is found by, for a checkpoint.
    pub(crate) fn noted(&self) -> Doubling {
        self.state.noise.noted().clone()
    }

    /// One learning pass.
    fn learn(&mut self, cancel: &AtomicBool) -> Result<()> {
        let lit = (self.world, self.environment);
        let state = &mut self.state;
        let Some((range, counted)) = state.tiles.next_pass(&state.view) else { return Ok(()) };
        let rays = match &mut self.gpu {
            None => {
                let tracer = state.tracer(lit, Some(counted));
                let rays = cpu::learn(&tracer, &state.view, range.clone(), cancel);
                if cancel.load(Ordering::Relaxed) {
                    state.tiles.begin_again(Learning::new(lit, &state.view), &mut state.figures);
                    return self.take_up_distributions();
                }
                rays
            }
            Some(renderer) => match renderer.learn(range.clone(), counted, cancel)? {
                Some(rays) => rays,
                None => return Ok(()),
            },
        };
        state.figures.learning_rays += rays;
        state.tiles.note_traced(range.end, self.environment, &mut state.figures);
        if range.end >= state.view.learning_paths {
            self.finish_learning();
        }
        self.take_up_distributions()
    }

    /// Puts it aside, with what a GPU has as far as it can still be read.
    #[cfg(feature = "window")]
    pub(crate) fn suspend(mut self) -> SessionState {
        self.continue_on_cpu();
        self.film();
        self.state
    }

    /// Goes on, on the CPU, with what was put aside, in the same world under the same map. A radiance cache that was
    /// [taken](Self::take_training) is trained anew.
    #[cfg(feature = "window")]
    pub(crate) fn resume(lit: Lit<'a>, mut state: SessionState) -> Self {
        if state.training.is_none() {
            state.training = CacheTraining::new(lit, &state.view);
        }
        Self { world: lit.0, environment: lit.1, gpu: None, state }
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
            let sums = &training.sums;
            let (done, rays) = match &mut self.gpu {
                None => {
                    let paths = paths.start..paths.end.min(paths.start + PATHS_AT_A_TIME);
                    let tracer = self.state.tracer((self.world, self.environment), None);
                    let rays = cpu::train(&tracer, &self.state.view, paths.clone(), sums);
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
        let grid = self.state.tiles.grid();
        let generation = grid.map_or(0, |grid| grid.generation);
        if generation != self.state.sequence.generation {
            // Pixels that are ahead begin later in it.
            self.state.sequence = Sequence { generation, first_sample: self.state.samples };
        }
        self.gpu.as_mut().map_or(Ok(()), |renderer| renderer.set_grid(grid))
    }

    /// Brings the pixels of a pass `samples` further. Making distributions counts as learning.
    fn render(&mut self, samples: u32, coverage: Coverage, cancel: &AtomicBool) -> Result<()> {
        let (start, figures) = (Instant::now(), self.state.figures);
        let result = self.pass(self.state.samples.saturating_add(samples), coverage, cancel);
        let distributions = self.state.figures.distribution_seconds - figures.distribution_seconds;
        self.state.figures.learning_seconds += distributions;
        let samples = self.state.figures.samples - figures.samples;
        self.state.spend(start.elapsed().as_secs_f64() - distributions, samples);
        result
    }

    fn pass(&mut self, target: u32, coverage: Coverage, cancel: &AtomicBool) -> Result<()> {
        let is_on_gpu = self.is_on_gpu();
        let state = &mut self.state;
        let stride = state.tiles.prepare_counting(&state.view, target - state.samples);
        let pass = Pass { target, coverage, stride, sequence: state.sequence };
        let samples = match &mut self.gpu {
            None => {
                let mut film = state.film.take(&state.view);
                let tracer =
                    state.tracer((self.world, self.environment), state.tiles.counted_into());
                let (samples, rays) = cpu::render(&tracer, &state.view, pass, &mut film, cancel);
                state.samples = film.min_samples();
                state.film.put(film);
                state.figures.rays += rays;
                samples
            }
            Some(renderer) => {
                state.film.outdate();
                let done = renderer.render(pass, state.tiles.counted_into(), cancel)?;
                state.samples = done.least;
                if state.film.is_older_than(KEPT_SECONDS) {
                    // What is on the host outlives the device; what fails is heard of at the next call.
                    let _ = state.film.update(&state.view, |film| renderer.read_film(film));
                }
                done.samples
            }
        };
        state.figures.samples += samples;
        // A GPU's film may have been read for the clock's sake: noise does not depend on that.
        let is_noted = state.skipped == 0 && !is_on_gpu;
        if let Some(film) = state.film.known().filter(|_| is_noted) {
            state.noise.note(film, state.samples, is_on_gpu);
        }
        let paths = samples.div_ceil(u64::from(stride));
        let whole = (state.samples >= target).then_some(state.samples);
        let (environment, figures) = (self.environment, &mut state.figures);
        let are_new = state.tiles.note_rendered(paths, whole, environment, figures);
        if are_new { self.take_up_distributions() } else { Ok(()) }
    }
}
