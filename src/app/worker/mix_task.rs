//! A light mix: a picture of each group of light, shown as their sum.

use std::sync::Arc;
use std::time::{Duration, Instant};

use super::inspection::Inspection;
use super::preview::gap_after;
use super::request::Request;
use super::sessions::Sessions;
use super::snapshot::{Activity, Backdrop, NoCache, SessionSnapshot, Snapshot};
use crate::render::block_errors::block_errors;
use crate::render::cached_picture::{CachedPicture, suits, worth};
use crate::render::film::Film;
use crate::render::light_groups::{GroupImage, LightFactors, LightGroup, mixed};
use crate::render::{Figures, Phase, Session, StopRule};

/// Works on the groups of one request until something else is asked for.
pub(super) struct MixTask<'a> {
    sessions: Sessions<'a>,
    inspection: Inspection,
    /// When it was published last, for which request, and what had been done.
    published: Option<(Instant, Arc<Request>, Activity, u64)>,
    publish_gap: Duration,
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

    /// Samples of all pixels, of both pictures.
    fn samples(&self) -> u64 {
        self.sessions().map(|session| session.figures().samples).sum()
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
        let inspection = Inspection::default();
        Self { sessions, inspection, published: None, publish_gap: Duration::ZERO }
    }

    /// Works until something else is asked for; the request that was worked on last.
    pub(super) fn work(mut self, groups: &'a [LightGroup]) -> Arc<Request> {
        let (world, view) = (self.sessions.world, self.sessions.watch.request.view.clone());
        let may_cache = suits(world, &view);
        let mut pictures = Vec::with_capacity(groups.len());
        for group in groups {
            let view = group.view(&view, pictures.is_empty());
            let main = Session::new(world, &group.environment, view);
            pictures.push(GroupPicture { group, main, cached: None, turns: 0 });
        }
        while self.sessions.watch.takes_up_latest() {
            let activity = self.activity(&pictures);
            let next = pictures.iter_mut().min_by_key(|picture| picture.samples());
            match (activity, next) {
                (Activity::Learning(_) | Activity::Rendering, Some(picture)) => {
                    self.advance(picture, may_cache);
                    self.publish_if_due(activity, &pictures);
                }
                _ => {
                    for picture in &mut pictures {
                        let settled = picture.main.settle();
                        self.sessions.go_on(&mut picture.main, settled);
                    }
                    self.publish(activity, &pictures);
                    self.sessions.rest();
                }
            }
        }
        self.sessions.watch.request
    }

    /// What is to be done next.
    fn activity(&self, pictures: &[GroupPicture<'_>]) -> Activity {
        let (request, rule) = (&self.sessions.watch.request, self.sessions.watch.request.rule);
        let samples = rule.samples.map(|most| u64::from(most) * request.view.pixels());
        let of_each = StopRule { seconds: None, samples: None, ..rule };
        let is_met = |picture: &GroupPicture<'_>| {
            of_each.is_met(&picture.main) || samples.is_some_and(|most| picture.samples() >= most)
        };
        let seconds: f64 = pictures.iter().map(GroupPicture::seconds).sum();
        let is_over = rule.seconds.is_some_and(|most| seconds >= most);
        let are_there = pictures.iter().all(|picture| picture.main.samples() > 0);
        if request.paused {
            Activity::Paused
        } else if are_there && (is_over || pictures.iter().all(is_met)) {
            Activity::Done
        } else if pictures.iter().any(|picture| picture.main.phase() == Phase::Learning) {
            let paths = |picture: &GroupPicture<'_>| {
                [picture.main.figures().learning_paths, picture.main.view().learning_paths]
            };
            let [done, all] = [0, 1].map(|at| pictures.iter().map(|it| paths(it)[at]).sum::<u64>());
            Activity::Learning(done as f32 / all.max(1) as f32)
        } else {
            Activity::Rendering
        }
    }

    /// Does a piece of work for one group.
    fn advance(&mut self, picture: &mut GroupPicture<'a>, may_cache: bool) {
        let GroupPicture { group, main, cached, turns } = picture;
        self.sessions.environment = &group.environment;
        if !self.sessions.place(main) {
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
        let samples: u64 = pictures.iter().map(GroupPicture::samples).sum();
        let is_due = self.published.as_ref().is_none_or(|(at, of, was, count)| {
            // Other factors are shown at once.
            let is_news = *was != activity || *count != samples;
            of.mix != request.mix || is_news && at.elapsed() >= self.publish_gap
        });
        if is_due && request.previews && !self.sessions.watch.is_superseded() {
            self.publish(activity, pictures);
        }
    }

    fn publish(&mut self, activity: Activity, pictures: &[GroupPicture<'_>]) {
        let start = Instant::now();
        let (shared, request) =
            (self.sessions.watch.shared, Arc::clone(&self.sessions.watch.request));
        let (Some(factors), Some(first)) = (&request.mix, pictures.first()) else { return };
        let film = Arc::new(mixed(&films(pictures, factors, |picture| Some(picture.main.film()))));
        let cached = films(pictures, factors, GroupPicture::cached_film);
        let cached =
            (cached.len() == pictures.len() && request.wants_cached).then(|| mixed(&cached));
        let errors = block_errors(&film, cached.as_ref());
        let backdrop = cached.map(|cached| Backdrop {
            samples: cached.total_samples(),
            worth: worth(&film, &cached, errors.as_ref()),
            film: Arc::new(cached),
        });
        let figures = |figures: &dyn Fn(&GroupPicture<'_>) -> Figures| {
            let mut all = Figures::default();
            pictures.iter().for_each(|picture| all.add(&figures(picture)));
            all
        };
        let of_main = figures(&|picture| picture.main.figures());
        let main = SessionSnapshot {
            sampling: request.view.sampling,
            samples: film.min_samples(),
            figures: Figures { samples: film.total_samples(), ..of_main },
            comparable_seconds: None,
            noise: film.noise(),
            invalid_samples: film.invalid_samples(),
            film,
            grid: self.inspection.distributions_of(&first.main),
            gpu: first.main.gpu_figures().map(Arc::new),
            on_device: None,
        };
        let seconds: f64 = pictures.iter().map(GroupPicture::seconds).sum();
        let image = |picture: &GroupPicture<'_>| GroupImage {
            name: picture.group.name.clone(),
            factor: picture.group.factor(factors),
            image: picture.main.film().image(),
        };
        let groups = pictures.iter().map(image).collect();
        let kept = &mut *self.sessions.kept;
        kept.snapshots += 1;
        shared.publish(Snapshot {
            number: kept.snapshots,
            activity,
            now: main.figures,
            cached_seconds: seconds - main.figures.elapsed_seconds(),
            main,
            plain: None,
            counters: None,
            backdrop,
            errors,
            cut_off: None,
            cache: Err(NoCache::Mixed),
            curves: Default::default(),
            groups,
            rest: Arc::clone(&shared.throttle),
            request: Arc::clone(&request),
        });
        let samples = pictures.iter().map(GroupPicture::samples).sum();
        self.published = Some((Instant::now(), request, activity, samples));
        self.publish_gap = gap_after(start.elapsed());
    }
}

/// Films of groups with their factors; none of those that have none.
fn films<'p, 'g>(
    pictures: &'p [GroupPicture<'g>],
    factors: &LightFactors,
    film: impl Fn(&'p GroupPicture<'g>) -> Option<&'p Film>,
) -> Vec<(&'p Film, f32)> {
    let with_factor = |picture| Some((film(picture)?, picture.group.factor(factors)));
    pictures.iter().filter_map(with_factor).collect()
}
