//! A light mix: a picture of each group of light, shown as their sum.

use std::sync::Arc;
use std::time::{Duration, Instant};

use super::inspection::Inspection;
use super::preview::{MAX_GAP, gap_after};
use super::request::Request;
use super::session_cache::{SuspendedPicture, SuspendedSession};
use super::sessions::Sessions;
use super::snapshot::{Activity, Backdrop, NoCache, SessionSnapshot, Snapshot};
use crate::render::block_errors::block_errors;
use crate::render::cached_picture::{CachedPicture, suits, worth};
use crate::render::film::Film;
use crate::render::light_groups::{GroupImage, LightFactors, LightGroup, mixed};
use crate::render::{Figures, Phase, Session};

/// Works on the groups of one request until something else is asked for.
pub(super) struct MixTask<'a> {
    sessions: Sessions<'a>,
    inspection: Inspection,
    /// When it was published last, for which request, and what had been done.
    published: Option<(Instant, Arc<Request>, Activity, u64)>,
    publish_gap: Duration,
    /// The exact samples of a sum, its noise, and the factors that it had.
    noise: (u32, f64, Option<LightFactors>),
}

/// The pictures by one group.
struct GroupPicture<'g> {
    group: &'g LightGroup,
    main: Session<'g>,
    cached: Option<CachedPicture<Session<'g>>>,
    /// Turns of the cached one in a row.
    turns: u32,
}

impl GroupPicture<'_> {
    fn sessions(&self) -> impl Iterator<Item = &Session<'_>> {
        [&self.main].into_iter().chain(self.cached.iter().map(|cached| &cached.session))
    }

    /// Samples of all pixels, of those by cached light as long as they are shown.
    fn samples(&self, shows_cached: bool) -> u64 {
        let sessions = self.sessions().take(if shows_cached { 2 } else { 1 });
        sessions.map(|session| session.figures().samples).sum()
    }

    fn seconds(&self) -> f64 {
        self.sessions().map(|session| session.figures().elapsed_seconds()).sum()
    }

    /// The film by cached light, once it is all over the picture.
    fn cached_film(&self) -> Option<&Film> {
        let session = &self.cached.as_ref()?.session;
        session.is_begun().then(|| session.film())
    }
}

impl<'a> MixTask<'a> {
    pub(super) fn new(sessions: Sessions<'a>) -> Self {
        let (inspection, publish_gap) = (Inspection::default(), Duration::ZERO);
        let noise = (0, f64::INFINITY, None);
        Self { sessions, inspection, published: None, publish_gap, noise }
    }

    /// Works until something else is asked for; the request that was worked on last.
    pub(super) fn work(mut self, groups: &'a [LightGroup]) -> Arc<Request> {
        let (world, view) = (self.sessions.world, self.sessions.watch.request.view.clone());
        let may_cache = suits(world, &view);
        let left = self.sessions.kept.come_back(&self.sessions.watch.request);
        let mut left = left.into_iter().flat_map(|left| left.sessions);
        let begin = |(number, group): (u32, &'a LightGroup)| {
            let lit = (world, &group.environment);
            let begun = || (Session::new(lit.0, lit.1, group.view(&view, number)), None);
            let (main, cached) = left.next().map_or_else(begun, |left| left.resume(lit));
            GroupPicture { group, main, cached, turns: 0 }
        };
        let mut pictures: Vec<_> = (0..).zip(groups).map(begin).collect();
        while self.sessions.watch.takes_up_latest() {
            let activity = self.activity(&pictures);
            let shows_cached = self.sessions.watch.request.wants_cached;
            if matches!(activity, Activity::Learning(_) | Activity::Rendering) {
                // Other factors before anything else.
                self.publish_if_due(activity, &pictures);
                let next = pictures.iter_mut().min_by_key(|picture| picture.samples(shows_cached));
                next.into_iter().for_each(|picture| self.advance(picture, may_cache));
                continue;
            }
            // All of them, whether or not a GPU has failed with one.
            let settle = |picture: &mut GroupPicture<'_>| self.sessions.settle(&mut picture.main);
            if pictures.iter_mut().map(settle).filter(|is_settled| !is_settled).count() == 0 {
                self.publish(activity, &pictures);
                self.sessions.device.note_compiled();
                self.sessions.rest();
            }
        }
        let Sessions { watch, kept, .. } = self.sessions;
        if watch.request.previews {
            let suspend = |it: GroupPicture<'_>| SuspendedSession::of(it.main, it.cached);
            kept.leave(SuspendedPicture {
                request: Arc::clone(&watch.request),
                sessions: pictures.into_iter().map(suspend).collect(),
                counters: None,
                curve: Vec::new(),
                cached_seconds: 0.0,
            });
        }
        watch.request
    }

    /// What is to be done next.
    fn activity(&mut self, pictures: &[GroupPicture<'_>]) -> Activity {
        let (request, rule) = (&self.sessions.watch.request, self.sessions.watch.request.rule);
        let (is_paused, shows_cached) = (request.paused, request.wants_cached);
        let least = pictures.iter().map(|it| it.samples(shows_cached)).min().unwrap_or(0);
        let most = rule.samples.map(|most| u64::from(most) * request.view.pixels());
        let seconds: f64 = pictures.iter().map(GroupPicture::seconds).sum();
        let exact = pictures.iter().map(|it| it.main.samples()).min().unwrap_or(0);
        let is_done = most.is_some_and(|most| least >= most)
            || rule.seconds.is_some_and(|most| seconds >= most)
            || rule.noise.is_some_and(|limit| self.has_noise_below(limit, exact, pictures));
        let learns = |picture: &&GroupPicture<'_>| !picture.group.environment.is_black();
        if is_paused {
            Activity::Paused
        } else if exact > 0 && is_done {
            Activity::Done
        } else if pictures.iter().any(|picture| picture.main.phase() == Phase::Learning) {
            let shares = pictures.iter().filter(learns).map(|picture| {
                let (done, all) = (picture.main.figures(), picture.main.view().learning_paths);
                done.learning_paths as f32 / all.max(1) as f32
            });
            Activity::Learning(shares.sum::<f32>() / pictures.iter().filter(learns).count() as f32)
        } else {
            Activity::Rendering
        }
    }

    /// Whether the noise of the sum is at most `limit`. It is measured again when `exact`, the samples that all groups
    /// have, has grown by a sixteenth.
    fn has_noise_below(&mut self, limit: f64, exact: u32, pictures: &[GroupPicture<'_>]) -> bool {
        let (of, _, factors) = &self.noise;
        let mix = &self.sessions.watch.request.mix;
        if exact >= 16 && (exact - (*of).min(exact) > exact / 16 || factors != mix) {
            let films = films(pictures, mix.as_ref(), |picture| Some(picture.main.film()));
            self.noise = (exact, mixed(&films).noise(), mix.clone());
        }
        exact >= 16 && self.noise.1 <= limit
    }

    /// Does a piece of work for one group.
    fn advance(&mut self, picture: &mut GroupPicture<'a>, may_cache: bool) {
        let GroupPicture { group, main, cached, turns } = picture;
        self.sessions.environment = &group.environment;
        // Kernels are compiled for one after the other.
        if !self.sessions.device.is_compiling() && !self.sessions.place(main) {
            return;
        }
        let begins = !main.is_begun() && self.sessions.beginning(main).is_some();
        if main.phase() == Phase::Learning && !begins {
            return self.sessions.learn_in_place(main);
        }
        let request = Arc::clone(&self.sessions.watch.request);
        let wants_cached = may_cache && request.wants_cached && !main.is_on_gpu();
        if wants_cached && cached.is_none() && main.samples() > 0 {
            *cached = CachedPicture::beside(main, (self.sessions.world, &group.environment)).ok();
        }
        let next = cached.as_mut().filter(|_| wants_cached);
        let next = next.and_then(|it| it.next(main, *turns, request.rule.noise.is_some()));
        *turns = if next.is_some() { *turns + 1 } else { 0 };
        let (session, rule) = match next {
            Some(session) => (session, None),
            None => (main, Some(request.rule)),
        };
        self.sessions.advance_in_place(session, rule, request.previews);
    }

    fn publish_if_due(&mut self, activity: Activity, pictures: &[GroupPicture<'_>]) {
        let request = &self.sessions.watch.request;
        let samples: u64 = pictures.iter().map(|picture| picture.samples(true)).sum();
        let is_throttled = self.sessions.watch.shared.throttle.lasts(MAX_GAP);
        let is_due = self.published.as_ref().is_none_or(|(at, of, was, count)| {
            let is_news = *was != activity || *count != samples;
            of.mix != request.mix || is_news && at.elapsed() >= self.publish_gap && !is_throttled
        });
        if is_due && request.previews && !self.sessions.watch.is_superseded() {
            self.publish(activity, pictures);
        }
    }

    fn publish(&mut self, activity: Activity, pictures: &[GroupPicture<'_>]) {
        let start = Instant::now();
        let (shared, request) =
            (self.sessions.watch.shared, Arc::clone(&self.sessions.watch.request));
        let (mix, Some(first)) = (request.mix.as_ref(), pictures.first()) else { return };
        let exact = films(pictures, mix, |picture| Some(picture.main.film()));
        let film = Arc::new(mixed(&exact));
        let cached = films(pictures, mix, GroupPicture::cached_film);
        let cached =
            (cached.len() == pictures.len() && request.wants_cached).then(|| mixed(&cached));
        let errors = block_errors(&film, cached.as_ref());
        let backdrop = cached.map(|cached| Backdrop {
            samples: cached.total_samples(),
            worth: worth(&film, &cached, errors.as_ref()),
            film: Arc::new(cached),
        });
        let mut figures = Figures::default();
        pictures.iter().for_each(|picture| figures.add(&picture.main.figures()));
        let main = SessionSnapshot {
            sampling: request.view.sampling,
            samples: film.min_samples(),
            figures: Figures { samples: film.total_samples(), ..figures },
            comparable_seconds: None,
            noise: film.noise(),
            invalid_samples: film.invalid_samples(),
            film,
            grid: self.inspection.distributions_of(&first.main),
            gpu: first.main.gpu_figures().map(Arc::new),
            on_device: None,
        };
        let seconds: f64 = pictures.iter().map(GroupPicture::seconds).sum();
        let image = |(picture, (film, factor)): (&GroupPicture<'_>, (&Film, f32))| GroupImage {
            name: picture.group.name.clone(),
            factor,
            image: film.image(),
        };
        let groups = pictures.iter().zip(exact).map(image).collect();
        let cut_off = self.sessions.cut_off(main.samples);
        let kept = &mut *self.sessions.kept;
        kept.snapshots += 1;
        shared.publish(Snapshot {
            number: kept.snapshots,
            learning_step: None,
            activity,
            now: main.figures,
            cached_seconds: seconds - main.figures.elapsed_seconds(),
            main,
            plain: None,
            counters: None,
            backdrop,
            errors,
            cut_off,
            cache: Err(NoCache::Mixed),
            curves: Default::default(),
            groups,
            rest: Arc::clone(&shared.throttle),
            request: Arc::clone(&request),
        });
        let samples = pictures.iter().map(|picture| picture.samples(true)).sum();
        self.published = Some((Instant::now(), request, activity, samples));
        self.publish_gap = gap_after(start.elapsed());
    }
}

/// Films of the groups that have one, with their factors.
fn films<'p, 'g>(
    pictures: &'p [GroupPicture<'g>],
    factors: Option<&LightFactors>,
    film: impl Fn(&'p GroupPicture<'g>) -> Option<&'p Film>,
) -> Vec<(&'p Film, f32)> {
    let with_factor = |picture: &'p GroupPicture<'g>| {
        Some((film(picture)?, factors.map_or(1.0, |factors| picture.group.factor(factors))))
    };
    pictures.iter().filter_map(with_factor).collect()
}
