//! What the window inspects of the sessions beside their films: distributions, radiance cache and errors.

use std::sync::Arc;

use super::request::Request;
use super::session_cache::SessionCache;
use super::snapshot::{NoCache, Point};
use crate::light_grid::LightGrid;
use crate::metrics;
use crate::radiance_cache::CacheFacts;
use crate::render::Session;

/// A point of a curve is drawn if it has so many times the samples of the one before.
const APART: f64 = 1.01;

/// Copies for the window, each made once.
#[derive(Default)]
pub(super) struct Inspection {
    /// The distributions copied last, with what tells whether they are still those in use.
    distributions: Option<((usize, u64), Arc<LightGrid>)>,
    /// The facts of a radiance cache, with what tells of which.
    cache: Option<((u64, f32), Arc<CacheFacts>)>,
    /// How the error of the main and of the plain picture fell.
    pub(super) curves: [Vec<Point>; 2],
}

impl Inspection {
    /// The distributions in use. They are megabytes and seldom change: they are copied once.
    pub(super) fn distributions_of(&mut self, session: &Session<'_>) -> Option<Arc<LightGrid>> {
        let grid = session.grid()?;
        let key = (std::ptr::from_ref(grid).addr(), session.figures().distribution_paths);
        self.distributions.take_if(|(old, _)| *old != key);
        let copy = || (key, Arc::new(grid.clone()));
        Some(Arc::clone(&self.distributions.get_or_insert_with(copy).1))
    }

    /// What is in the radiance cache that `session` trains or, if it trains none, that was trained before. None is used
    /// where a device `is_quick`.
    pub(super) fn cache_facts(
        &mut self,
        session: &Session<'_>,
        request: &Request,
        kept: &SessionCache,
        is_quick: bool,
    ) -> Result<Arc<CacheFacts>, NoCache> {
        if !request.inspects_cache {
            return Err(NoCache::Unasked);
        }
        let before = kept.training.as_ref().filter(|_| kept.has_training_for(request));
        let causes = [
            (request.view.limits.bounces < 2, NoCache::OneBounce),
            (!request.wants_cached, NoCache::NotDenoised),
            (request.split, NoCache::Split),
            (is_quick, NoCache::QuickDevice),
        ];
        let cause = causes.into_iter().find(|(is_it, _)| *is_it);
        let missing = cause.map_or(NoCache::Untrained, |(_, missing)| missing);
        let training = session.training().or(before.map(|(training, _)| training));
        let training = training.ok_or(missing)?;
        let state = training.state();
        if let Some((_, facts)) = self.cache.as_ref().filter(|(of, _)| *of == state) {
            return Ok(Arc::clone(facts));
        }
        let facts = Arc::new(training.sums.facts().ok_or(missing)?);
        self.cache = Some((state, Arc::clone(&facts)));
        Ok(facts)
    }

    /// Brings a curve up to date: its last point is of now, those before are apart.
    pub(super) fn note(&mut self, role: usize, session: &Session<'_>, request: &Request) {
        let film = session.film();
        let error_to = |image| metrics::relative_rms_error(&film.image(), image);
        let reference = request.reference.as_ref();
        let point = Point {
            seconds: session.figures().elapsed_seconds(),
            samples: film.total_samples() as f64 / film.pixels().len().max(1) as f64,
            noise: session.noise(),
            error: reference.and_then(|reference| error_to(&reference.image)),
        };
        if !(point.noise.is_finite() && point.noise > 0.0) {
            return;
        }
        let curve = &mut self.curves[role];
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
}
