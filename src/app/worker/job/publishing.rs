//! What the window gets of a job.

use std::borrow::Cow;
use std::sync::Arc;
use std::time::{Duration, Instant};

use super::cached::{self, CachedPicture, worth};
use super::sessions::SLICE;
use super::{MAIN, PLAIN, PictureTask};
use crate::app::threads::lock;
use crate::app::worker::kept::PreviousFilm;
use crate::app::worker::{Activity, Backdrop, NoCache, Origin, Point, SessionSnapshot, Snapshot};
use crate::light_grid::LightGrid;
use crate::metrics;
use crate::radiance_cache::CacheFacts;
use crate::render::film::{Film, Pixel};
use crate::render::gpu::{DeviceFilm, Gpu};
use crate::render::{Figures, Session, View};

/// A point of a curve is drawn if it has so many times the samples of the one before.
const APART: f64 = 1.01;
/// A film that is shown in place is read back this seldom.
const READING_GAP: Duration = Duration::from_millis(250);
/// A film that is copied for being shown is replaced when it is so old, whoever still has others.
const OLDEST: Duration = Duration::from_secs(2);
/// Publishing may take at most about one part in this of the time.
const PUBLISH_SHARE: u32 = 40;
/// But a picture that changes is shown at least so often.
const MAX_GAP: Duration = Duration::from_millis(800);
/// A resized film is worth no more samples a pixel than this, for it is a little blurred.
const MAX_RESIZED_WEIGHT: f32 = 64.0;

/// A film as it was copied, or read back from the window's device, last.
#[derive(Clone)]
pub(super) struct FilmReadback {
    /// Where it is shown in place meanwhile.
    of: Option<(Gpu, DeviceFilm)>,
    film: Arc<Film>,
    /// Of the moment it was read, so that all belong together.
    samples: u32,
    figures: Figures,
    comparable_seconds: Option<f64>,
    noise: f64,
    invalid_samples: u64,
    at: Instant,
    /// Age at which it is too old.
    gap: Duration,
}

impl PictureTask<'_> {
    /// A film of this view from before, if there is one.
    fn backdrop(&self) -> Option<Arc<Film>> {
        let PreviousFilm { request, film, .. } = self.kept.backdrop.as_ref()?;
        if !request.looks_like(&self.request) {
            return None;
        }
        if let Some(resized) = &self.resized {
            return resized.film.clone();
        }
        let aspect = |view: &View| f64::from(view.width) / f64::from(view.height);
        let is_as_wide = 1.02 * aspect(&request.view) >= aspect(&self.request.view);
        is_as_wide.then(|| Arc::clone(film))
    }

    /// What one of its samples counts as it is.
    fn backdrop_worth(&self) -> f32 {
        self.kept.backdrop.as_ref().map_or(1.0, |seen| seen.worth)
    }

    /// Resizes the film from before to the picture's size, if it was a whole one of about as many rows: the picture
    /// goes on with what it shows.
    pub(super) fn resize_backdrop(&mut self) {
        let view = &self.request.view;
        let size = [view.width, view.height];
        let before =
            self.kept.backdrop.as_ref().filter(|PreviousFilm { request: of, film, .. }| {
                let is_whole = !of.moving && film.width == of.view.width && view.crop.is_none();
                let is_alike = film.height <= 2 * view.height && view.height <= 2 * film.height;
                is_whole && is_alike && size != [film.width, film.height]
            });
        let before = before.filter(|seen| seen.request.looks_like(&self.request));
        self.resized = before.map(|seen| Resized::of(seen, size));
    }

    /// Whether the film from before says so much that no cached light is needed beside it.
    pub(super) fn has_rich_backdrop(&self) -> bool {
        let enough = 2.0 / 3.0 * cached::SAMPLES as f32;
        let is_rich = |resized: &Resized| {
            resized.worth * resized.samples as f32 >= enough * resized.pixels as f32
        };
        self.resized.as_ref().is_some_and(is_rich)
    }

    /// Keeps the film for the next one's first moments, unless there is a better one of the same view.
    pub(super) fn keep_backdrop(&mut self, film: Cow<'_, Film>, worth: f32) {
        let known = match &self.resized {
            Some(resized) => resized.known(),
            None => {
                let samples = self.backdrop().map_or(0, |film| film.total_samples());
                self.backdrop_worth() * samples as f32
            }
        };
        if film.min_samples() > 0 && worth * film.total_samples() as f32 > known {
            let (request, film) = (Arc::clone(&self.request), Arc::new(film.into_owned()));
            self.kept.backdrop = Some(PreviousFilm { request, film, worth });
        }
    }

    /// The distributions in use. They are megabytes and seldom change: they are copied once.
    pub(super) fn distributions_of(&mut self, session: &Session<'_>) -> Option<Arc<LightGrid>> {
        let grid = session.grid()?;
        let key = (std::ptr::from_ref(grid).addr(), session.figures().distribution_paths);
        Some(match &self.distributions {
            Some((old, distributions)) if *old == key => Arc::clone(distributions),
            _ => {
                let distributions = Arc::new(grid.clone());
                self.distributions = Some((key, Arc::clone(&distributions)));
                distributions
            }
        })
    }

    pub(super) fn publish(
        &mut self,
        activity: Activity,
        main: &Session<'_>,
        plain: Option<&Session<'_>>,
        cached: &mut CachedPicture<'_>,
    ) {
        let start = Instant::now();
        self.kept.snapshots += 1;
        if let Some(resized) = self.resized.as_mut().filter(|r| r.worth(main.samples()) == 0.0) {
            resized.film = None;
            self.kept.backdrop = None;
        }
        let is_final = matches!(activity, Activity::Paused | Activity::Done);
        let rests = !is_final && (self.shared.rest.lasts(MAX_GAP) || self.is_ahead());
        let (main_snapshot, main_cost) = self.session_snapshot(MAIN, main, is_final, rests);
        let plain_snapshot =
            plain.map(|session| self.session_snapshot(PLAIN, session, is_final, rests));
        let reading = main_cost + plain_snapshot.as_ref().map_or(Duration::ZERO, |(_, cost)| *cost);
        let snapshot = Snapshot {
            number: self.kept.snapshots,
            request: Arc::clone(&self.request),
            activity,
            main: main_snapshot,
            now: main.figures(),
            plain: plain_snapshot.map(|(snapshot, _)| snapshot),
            counters: self.counters.clone(),
            backdrop: self.shown_backdrop(activity, main, cached, rests),
            cached_seconds: self.cached_seconds,
            cache: self.cache_facts(cached.session().unwrap_or(main)),
            curves: self.curves.clone(),
            rest: Arc::clone(&self.shared.rest),
        };
        *lock(&self.shared.snapshot) = Some(Arc::new(snapshot));
        (self.shared.wake)();
        self.published = Instant::now();
        if !rests {
            let cost = (self.published - start).saturating_sub(reading);
            self.publish_gap = gap_after(cost);
        }
    }

    /// What is in the radiance cache that `session` trains or, if it trains none, that was trained before.
    fn cache_facts(&mut self, session: &Session<'_>) -> Result<Arc<CacheFacts>, NoCache> {
        let request = &self.request;
        if !request.inspects_cache {
            return Err(NoCache::Unasked);
        }
        let is_kept = self.kept.has_training_for(request);
        let kept = self.kept.training.as_ref().filter(|_| is_kept).map(|(training, _)| training);
        let missing = if request.view.limits.bounces < 2 {
            NoCache::OneBounce
        } else if !request.wants_cached {
            NoCache::NotDenoised
        } else if request.split {
            NoCache::Split
        } else if self.kept.device.is_quick(request) {
            NoCache::QuickDevice
        } else {
            NoCache::Untrained
        };
        let training = session.training().or(kept).ok_or(missing)?;
        let state = training.state();
        if let Some((_, facts)) = self.cache.as_ref().filter(|(of, _)| *of == state) {
            return Ok(Arc::clone(facts));
        }
        let facts = Arc::new(training.facts().ok_or(missing)?);
        self.cache = Some((state, Arc::clone(&facts)));
        Ok(facts)
    }

    /// What is shown together with the session's own film: the cached one once it has clearly more to say
    /// than what was seen before, as chance and gaps between its first pixels count against it.
    fn shown_backdrop(
        &self,
        activity: Activity,
        main: &Session<'_>,
        cached: &mut CachedPicture<'_>,
        rests: bool,
    ) -> Option<Backdrop> {
        // What this job itself has kept has the same samples.
        let is_own = |seen: &PreviousFilm| Arc::ptr_eq(&seen.request, &self.request);
        let before = self.backdrop().filter(|_| !self.kept.backdrop.as_ref().is_some_and(is_own));
        let resized = self.resized.as_ref();
        let total = || before.as_ref().map_or(0, |film| film.total_samples());
        let seen = resized.map_or_else(total, |resized| resized.samples);
        let film = cached.film(3 * seen / 2, rests).filter(|_| self.request.wants_cached);
        let shown = match film {
            Some((samples, film)) => {
                let worth = worth(main.samples());
                Some(Backdrop { film, samples, worth, origin: Origin::Cache })
            }
            None => before.map(|film| {
                let (worth, origin) = match resized {
                    Some(resized) => (resized.worth(main.samples()), Origin::Resized),
                    None => (self.backdrop_worth(), Origin::Before),
                };
                Backdrop { film, samples: seen, worth, origin }
            }),
        };
        // What is compared, and what is done, is what will be saved.
        let is_plain = self.request.split || activity == Activity::Done;
        let is_wanted = |backdrop: &Backdrop| {
            backdrop.worth > 0.0 && !(is_plain && backdrop.origin == Origin::Resized)
        };
        shown.filter(is_wanted)
    }

    /// Brings a curve up to date: its last point is of now, those before are apart.
    pub(super) fn note(&mut self, curve: usize, session: &Session<'_>) {
        let film = session.film();
        let point =
            Point {
                seconds: session.elapsed_seconds(),
                samples: film.total_samples() as f64 / film.pixels().len().max(1) as f64,
                noise: session.noise(),
                error: self.request.reference.as_ref().and_then(|reference| {
                    metrics::relative_rms_error(&film.image(), &reference.image)
                }),
            };
        if !(point.noise.is_finite() && point.noise > 0.0) {
            return;
        }
        let curve = &mut self.curves[curve];
        if let [.., before, last] = curve.as_slice()
            && last.samples < APART * before.samples
        {
            curve.pop();
        }
        match curve.last_mut() {
            Some(last) if point.samples <= last.samples => last.error = point.error.or(last.error),
            _ => curve.push(point),
        }
    }

    /// The session's picture, and what reading a film that is shown in place took of the time.
    fn session_snapshot(
        &mut self,
        role: usize,
        session: &Session<'_>,
        is_final: bool,
        rests: bool,
    ) -> (SessionSnapshot, Duration) {
        let in_place = self.in_place(session);
        let is_in_place = in_place.is_some();
        // The first picture with a sample in every pixel is shown at once.
        let is_due = session.samples() > 0
            && self.readings[role].as_ref().is_some_and(|reading| reading.samples == 0);
        // Nobody looks at one whose first pixels are not everywhere.
        let is_unseen = !is_in_place && !session.is_begun();
        let unseen = self.readings[role].as_ref().filter(|_| is_unseen);
        let kept = unseen
            .or_else(|| self.reading(role, in_place.as_ref(), rests && !is_due))
            .filter(|_| !is_final && !is_due)
            .cloned();
        let (reading, cost) = match kept {
            Some(reading) => (reading, Duration::ZERO),
            None => {
                let start = Instant::now();
                let film = self.film_of(role, session);
                let (noise, figures) = (session.noise(), session.figures());
                let comparable_seconds = session.comparable_seconds();
                let invalid_samples = film.invalid_samples();
                let cost = if is_in_place { start.elapsed() } else { Duration::ZERO };
                let (at, gap) = (Instant::now(), gap_after(cost).max(READING_GAP));
                let (of, samples) = (in_place, session.samples());
                let reading = FilmReadback {
                    of,
                    film,
                    samples,
                    figures,
                    comparable_seconds,
                    noise,
                    invalid_samples,
                    at,
                    gap,
                };
                self.readings[role] = Some(reading.clone());
                if session.figures().samples > 0 {
                    self.films.push(Arc::downgrade(&reading.film));
                }
                (reading, cost)
            }
        };
        let snapshot = SessionSnapshot {
            // Of what is shown.
            samples: if is_in_place { session.samples() } else { reading.samples },
            sampling: session.view().sampling,
            noise: reading.noise,
            invalid_samples: reading.invalid_samples,
            film: reading.film,
            figures: reading.figures,
            comparable_seconds: reading.comparable_seconds,
            gpu: session.gpu_figures().map(Arc::new),
            on_device: session.film_on_device(),
            grid: self.distributions_of(session),
        };
        (snapshot, cost)
    }

    /// The session's film; before the main one's first sample, one of the same view from before.
    fn film_of(&self, role: usize, session: &Session<'_>) -> Arc<Film> {
        let is_empty = role == MAIN && session.figures().samples == 0;
        let before = if is_empty { self.backdrop() } else { None };
        before.unwrap_or_else(|| Arc::new(session.film().clone()))
    }

    /// The session's film if the window shows it in every frame without its being read. Small ones are
    /// filtered on the CPU, and software does not draw so often.
    fn in_place(&self, session: &Session<'_>) -> Option<(Gpu, DeviceFilm)> {
        let (gpu, film) = session.film_on_device()?;
        let is_small = film.width < self.request.view.width;
        let is_live = !gpu.facts().is_software() && gpu.is_same(&lock(&self.shared.screen));
        (is_live && !is_small).then_some((gpu, film))
    }

    /// Whether those who show films have one that they have not come to yet: a third would only take memory.
    fn is_ahead(&mut self) -> bool {
        self.films.retain(|film| film.strong_count() > 0);
        let of_session = self.readings.iter().flatten().count().max(1);
        let is_fresh = |reading: &FilmReadback| reading.at.elapsed() < OLDEST;
        self.films.len() > of_session && self.readings.iter().flatten().any(is_fresh)
    }

    /// The last reading of a film, unless a newer one is wanted: by its age where it is shown in place,
    /// else when it will be shown.
    fn reading(
        &self,
        role: usize,
        of: Option<&(Gpu, DeviceFilm)>,
        rests: bool,
    ) -> Option<&FilmReadback> {
        self.readings[role].as_ref().filter(|reading| match (&reading.of, of) {
            (Some(read), Some(of)) => is_same(read, of) && reading.at.elapsed() < reading.gap,
            // Before the first sample it was another picture, and none before pixels everywhere have one.
            (None, None) => rests && reading.figures.samples > 0 && reading.film.is_begun(),
            _ => false,
        })
    }

    /// Whether figures that need the film are to be taken anew.
    pub(super) fn is_reading_due(&self, session: &Session<'_>) -> bool {
        session.samples() > 0
            && self.reading(MAIN, self.in_place(session).as_ref(), false).is_none()
    }
}

/// A film from before in the size of the picture.
pub(super) struct Resized {
    /// Until there are enough other samples.
    film: Option<Arc<Film>>,
    pixels: u64,
    /// Of all its pixels.
    samples: u64,
    /// What one of them counts at most.
    worth: f32,
    /// Of the pixel that has fewest, and of that which has most.
    span: [u32; 2],
    /// What it is worth at most in samples a pixel.
    most: f32,
}

impl Resized {
    fn of(before: &PreviousFilm, size: [u32; 2]) -> Self {
        let film = before.film.resized(size);
        let counts = || film.pixels().iter().map(Pixel::samples);
        let span = [counts().min().unwrap_or(0), counts().max().unwrap_or(0)];
        let (pixels, samples) = (film.pixels().len() as u64, film.total_samples());
        // What is enlarged is blurred.
        let enlarged = (size[1] as f32 / before.film.height as f32).max(1.0);
        let most = MAX_RESIZED_WEIGHT / (enlarged * enlarged);
        Self { film: Some(Arc::new(film)), pixels, samples, worth: before.worth, span, most }
    }

    /// What one of its samples counts where the picture has so many of its own: it fades out.
    fn worth(&self, samples: u32) -> f32 {
        let faded = (1.0 - samples as f32 / (4.0 * self.most)).max(0.0);
        (self.most / self.span[1].max(1) as f32).min(self.worth) * faded
    }

    /// What another film must be worth more than to take its place.
    fn known(&self) -> f32 {
        let most = self.most * self.pixels as f32;
        let own = self.worth * self.samples as f32;
        if self.film.is_none() || self.span[0] == 0 { 0.0 } else { own.min(most) }
    }
}

fn is_same((gpu, film): &(Gpu, DeviceFilm), other: &(Gpu, DeviceFilm)) -> bool {
    gpu.is_same(&other.0) && *film == other.1
}

/// Time until something that took `cost` may be done again.
fn gap_after(cost: Duration) -> Duration {
    (cost * PUBLISH_SHARE).clamp(SLICE, MAX_GAP)
}
