//! How light that has met several surfaces is found, and when the radiance cache is trained.

use std::ops::Range;

use glam::Vec3;

use super::view::{Gi, View};
use super::view_probe::middle_distance;
use crate::path::Lit;
use crate::radiance_cache::{CacheCells, MAX_PATHS, RadianceCache, RadianceSums};

/// One training path for this many paths rendered; it takes about twice as long as one of them. With half as many,
/// means of 8x8 pixels have a quarter more error after as long, with twice as many pixels are worse.
const TRAINING_SHARE: u64 = 4;
/// Paths that find out how bright it is about where, before others train it.
const PILOT_PATHS: u64 = 1 << 12;
/// Fewest paths that train it.
const MIN_PATHS: u64 = 1 << 14;
/// Paths that the CPU traces between two looks at whether to stop.
pub(super) const PATHS_AT_A_TIME: u64 = 1 << 12;
/// Edge of the smallest cells over the middle distance of what the camera sees, which is twice that
/// within which they are all alike.
const EDGE: f32 = 0.025;

/// A radiance cache in the making. It outlives the picture, for it lies in the world.
pub(crate) struct CacheTraining {
    /// What paths are added to.
    pub(crate) sums: RadianceSums,
    /// The first path of those that have trained it: what bounds them was found by others.
    first: u64,
    /// How many have, and how many are to have before the next pass.
    paths: u64,
    wanted: u64,
    /// Until others have trained it, what a few have found.
    cache: Option<RadianceCache>,
    brightest: f32,
}

impl CacheTraining {
    /// `None` if paths are followed to their end.
    pub(super) fn new((world, environment): Lit<'_>, view: &View) -> Option<Self> {
        if view.gi == Gi::Exact || view.limits.bounces < 2 {
            return None;
        }
        let distance = middle_distance(world, view)?;
        let edge = EDGE * distance;
        let brightest = world.brightest_lit(environment, edge);
        if brightest <= 0.0 {
            return None;
        }
        let center = view.rays().position;
        let cells = CacheCells { center, edge, least_distance: 0.5 * distance };
        let sums = RadianceSums::new(cells, brightest);
        Some(Self { sums, first: 0, paths: 0, wanted: 0, cache: None, brightest })
    }

    /// Decides how many paths are to have trained it before the next pass, which is about every `every`-th
    /// pixel of every `every`-th row, where each has so many samples: all there are double each time.
    /// What was begun is brought to its end first.
    pub(super) fn begin(&mut self, view: &View, samples: u32, every: u32) {
        let pixels = [view.width, view.height].map(|length| u64::from(length.div_ceil(every)));
        let pixels: u64 = pixels.iter().product();
        let wanted = pixels * (u64::from(samples) + 1) / TRAINING_SHARE;
        let wanted = wanted.clamp(MIN_PATHS, MAX_PATHS);
        // Where passes end between powers of two is a matter of time. A picture that goes on may have none yet.
        let is_time = samples == 0 || samples.is_power_of_two() || self.wanted == 0;
        if is_time && self.paths >= self.wanted && wanted >= 2 * self.wanted {
            self.wanted = wanted;
        }
    }

    /// Paths that are to train next; `None` if enough have.
    pub(super) fn next(&self) -> Option<Range<u64>> {
        let paths = self.first + self.paths..self.first + self.end();
        (!paths.is_empty()).then_some(paths)
    }

    fn end(&self) -> u64 {
        if self.cache.is_none() { PILOT_PATHS } else { self.wanted }
    }

    /// Takes note that paths up to this one of [`Self::next`] have trained. After the last of them there is a new cache; if
    /// the table has no room for so many cells, they begin anew with larger ones. Returns how many have trained it.
    pub(super) fn advance(&mut self, path: u64) -> u64 {
        self.paths = path - self.first;
        let paths = self.paths;
        if paths < self.end() && !self.sums.is_full() {
            return paths;
        }
        let cells = self.sums.cells;
        let cache = self.sums.cache();
        let cells = match &cache {
            Some(_) if self.cache.is_some() => None,
            // What follows the pilot begins with empty sums.
            Some(_) => Some(cells),
            None => Some(CacheCells { edge: 2.0 * cells.edge, ..cells }),
        };
        if let Some(cells) = cells {
            self.sums = RadianceSums::new(cells, self.brightest);
            self.first += self.paths;
            self.paths = 0;
        }
        self.cache = cache;
        paths
    }

    /// Whether its cells are as large as those for a camera at `position` would be, or nearly so.
    pub(crate) fn suits(&self, position: Vec3) -> bool {
        let cells = &self.sums.cells;
        position.distance(cells.center) < cells.least_distance
    }

    /// Tells what the sums are of: paths that have trained it, and edge of the smallest cells.
    pub(crate) fn state(&self) -> (u64, f32) {
        (self.paths, self.sums.cells.edge)
    }

    /// What is known so far.
    pub(super) fn cache(&self) -> Option<&RadianceCache> {
        self.cache.as_ref()
    }
}

#[cfg(test)]
pub(super) mod tests {
    use glam::Vec2;

    use super::*;
    use crate::environment::{Environment, EnvironmentOptions, sky};
    use crate::light_grid::{DistributionOptions, LightGrid};
    use crate::path::{PathLimits, World};
    use crate::render::filter::PixelFilter;
    use crate::render::{Sampling, Sharing, cpu};
    use crate::scene::builtin;

    pub(in crate::render) fn view(world: &World, recording: DistributionOptions) -> View {
        let talk = recording == DistributionOptions::TALK;
        View {
            filter: PixelFilter::Box,
            sampling: if talk { Sampling::Talk } else { Sampling::Adaptive },
            limits: PathLimits { bounces: 4, russian_roulette: true },
            seed: 5,
            sharing: Sharing::Off,
            learning_paths: 1 << 13,
            distributions: recording,
            ..View::new(world.scene.cameras[0].clone(), [64, 36])
        }
    }

    fn office() -> (World, Environment, View) {
        let world = World::new(builtin::build("office").expect("built in"));
        let map = sky::build("overcast", 128, 64).expect("a sky");
        let environment =
            Environment::new(map, &EnvironmentOptions::default()).expect("a sound map");
        let view = View { gi: Gi::Cached, ..view(&world, DistributionOptions::ADAPTIVE) };
        (world, environment, view)
    }

    #[test]
    fn error_falls_as_paths_train() {
        let (world, environment, view) = office();
        let rays = view.rays();
        let distributions = LightGrid::whole_map(environment.tile_energies());
        let tracer = view.tracer((&world, &environment), distributions.as_ref());
        let training = CacheTraining::new((&world, &environment), &view).expect("there is light");
        let places = (0..900).filter_map(|i| {
            let at = Vec2::new((i % 30) as f32 * 2.1, (i / 30) as f32 * 1.2);
            let ray = rays.ray(at, Vec2::ZERO);
            let hit = world.closest_hit(&ray, true)?;
            let point = world.point(&hit, ray.direction);
            Some((point.position, point.geometric_normal))
        });
        let places: Vec<_> = places.collect();
        let mut known: Vec<Vec<f32>> = Vec::new();
        let mut start = 0;
        for end in [1 << 12, 1 << 17, 1 << 20] {
            cpu::train(&tracer, &view, start..end, &training.sums);
            start = end;
            let cache = training.sums.cache().expect("there is room");
            let radiance = |(position, normal): &(Vec3, Vec3)| {
                crate::color::luminance(cache.radiance_over_albedo(*position, *normal))
            };
            known.push(places.iter().map(radiance).collect());
        }
        let error = |some: &[f32]| {
            let mut off: Vec<f32> =
                some.iter().zip(&known[2]).map(|(a, b)| (a - b).abs() / (a + b + 1e-6)).collect();
            off.sort_unstable_by(f32::total_cmp);
            off[off.len() / 2]
        };
        let (little, much) = (error(&known[0]), error(&known[1]));
        eprintln!("{little} after 2^12 paths, {much} after 2^17");
        assert!(much < 0.7 * little, "{little} {much}");
    }

    #[test]
    fn cells_grow_where_there_are_too_many() {
        let (world, environment, view) = office();
        let mut training =
            CacheTraining::new((&world, &environment), &view).expect("there is light");
        let edge = training.sums.cells.edge;
        let cells = CacheCells { edge: edge / 64.0, ..training.sums.cells };
        training.sums = RadianceSums::new(cells, 1.0);
        training.begin(&view, 0, 1);
        let mut places = 0;
        while let Some(range) = training.next() {
            // In a square so large that the smallest cells do not suffice for it.
            for place in 4 * range.start..4 * range.end {
                let [x, z] = [place % 256, place / 256].map(|at| at as f32 * 0.02 * edge);
                let sums = &training.sums;
                sums.add(sums.cells.center + Vec3::new(x, 0.0, z), Vec3::Y, Vec3::ONE, Vec3::ONE);
                places += 1;
            }
            training.advance(range.end);
            assert!(places < 1_000_000, "it comes to an end");
        }
        let cells = training.cache().expect("it was trained").cells;
        assert!(cells.edge > edge / 64.0, "{} for {edge}", cells.edge);
    }
}
