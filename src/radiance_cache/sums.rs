//! Training of the cache: sums over paths, cell by cell.

use std::sync::atomic::{AtomicU32, AtomicUsize, Ordering};

use glam::{DVec3, Vec3};

use super::cells::{CacheCells, Key, SLOTS};
use super::facts::{CacheFacts, Training};
use super::look_up::RadianceCache;
use crate::sampler::{hash, unit_from_bits};

/// Words of a slot: check word, slot of the parent plus one, number of paths, albedo (three), radiance
/// (three times low and high word).
pub(crate) const WORDS: usize = 12;
const PARENT_AT: usize = 1;
const COUNT_AT: usize = 2;
const ALBEDO_AT: usize = 3;
const RADIANCE_AT: usize = 6;
/// Units of an albedo of 1: 2^24 paths do not overflow a word.
pub(crate) const ALBEDO_ONE: f32 = 255.0;
/// Units of the brightest radiance in the scene, and the maximum of one estimate: 2^24 of them do not overflow two
/// words.
const BRIGHTEST: f32 = (1_u64 << 36) as f32;
const MAX_SUM: f32 = (1_u64 << 40) as f32;
/// Weight of the parent's mean in a cell, in paths.
const PARENTS_PATHS: f64 = 8.0;
/// Weight of the mean of all cells in a parent, in paths: few paths are often much brighter or darker.
const PATHS_OF_ALL: f64 = 1.0;
/// Minimum albedo that radiance is divided by.
const MIN_ALBEDO: f64 = 1.0 / 256.0;
/// Share of used slots above which a cell may find no slot.
const FULL: f64 = 0.75;
/// Maximum number of paths that train the cache.
pub(crate) const MAX_PATHS: u64 = 1 << 22;

/// Sums of the paths' estimates of reflected radiance, cell by cell.
pub struct RadianceSums {
    /// Its cells.
    pub cells: CacheCells,
    /// Units of a radiance of 1.
    scale: f32,
    words: Box<[AtomicU32]>,
    /// Number of used slots, which is read after every few paths.
    used: AtomicUsize,
}

/// Content of a slot.
#[derive(Clone, Copy, Default)]
struct Tally {
    check: u32,
    parent: Option<usize>,
    count: u64,
    albedo: [u64; 3],
    radiance: [u64; 3],
}

impl RadianceSums {
    /// Empty sums. `brightest` is the approximate maximum of emitted radiance.
    pub fn new(cells: CacheCells, brightest: f32) -> Self {
        let scale = BRIGHTEST / brightest.clamp(f32::MIN_POSITIVE * BRIGHTEST, f32::MAX);
        let words = (0..SLOTS * WORDS).map(|_| AtomicU32::new(0)).collect();
        Self { cells, scale, words, used: AtomicUsize::new(0) }
    }

    /// Bytes of the sums and of the cache that is made of them.
    pub fn memory_bytes() -> usize {
        SLOTS * (WORDS * size_of::<u32>() + size_of::<[u32; 4]>())
    }

    /// All words and the units of a radiance of 1: the state from which a GPU continues.
    pub(crate) fn words_and_scale(&self) -> (Vec<u32>, f32) {
        (self.words.iter().map(|word| word.load(Ordering::Relaxed)).collect(), self.scale)
    }

    /// Replaces the state by continued counts of the words.
    pub(crate) fn set_words(&self, words: &[u32]) {
        self.words
            .iter()
            .zip(words)
            .for_each(|(word, value)| word.store(*value, Ordering::Relaxed));
        let used = words.iter().step_by(WORDS).filter(|check| **check != 0).count();
        self.used.store(used, Ordering::Relaxed);
    }

    /// Counts an estimate of the radiance that a surface with this unit normal and albedo reflects.
    /// Safe to call from any thread.
    pub fn add(&self, position: Vec3, normal: Vec3, radiance: Vec3, albedo: Vec3) {
        if !radiance.is_finite() {
            return;
        }
        let cell = self.cells.cell_at(position, normal);
        let (Some(parent), Some(slot)) =
            (self.slot_of(cell.parent().key()), self.slot_of(cell.key()))
        else {
            return;
        };
        let words = &self.words[slot * WORDS..][..WORDS];
        words[PARENT_AT].store(parent as u32 + 1, Ordering::Relaxed);
        words[COUNT_AT].fetch_add(1, Ordering::Relaxed);
        let dice = dice(position);
        for channel in 0..3 {
            let units = (albedo[channel] * ALBEDO_ONE).clamp(0.0, ALBEDO_ONE);
            let albedo = units + unit_from_bits(hash(dice ^ channel as u32));
            words[ALBEDO_AT + channel].fetch_add(albedo as u32, Ordering::Relaxed);
            let units = dithered(radiance[channel] * self.scale);
            let (low, high) = (units as u32, (units >> 32) as u32);
            let at = RADIANCE_AT + 2 * channel;
            let carry = words[at].fetch_add(low, Ordering::Relaxed).checked_add(low).is_none();
            words[at + 1].fetch_add(high + u32::from(carry), Ordering::Relaxed);
        }
    }

    /// Number of added estimates, and their mean radiance.
    #[cfg(test)]
    pub(crate) fn totals(&self) -> (u64, DVec3) {
        let mut all = Tally::default();
        self.words.chunks_exact(WORDS).for_each(|words| all.add(&Tally::new(words)));
        let radiance = all.radiance.map(|units| units as f64 / f64::from(self.scale));
        (all.count, DVec3::from_array(radiance) / all.count as f64)
    }

    /// The slot of a cell, a new one if it has none; `None` if all slots of its place are used.
    fn slot_of(&self, key: Key) -> Option<usize> {
        key.probes().find(|slot| {
            let check = &self.words[slot * WORDS];
            match check.compare_exchange(0, key.check, Ordering::Relaxed, Ordering::Relaxed) {
                Ok(_) => {
                    self.used.fetch_add(1, Ordering::Relaxed);
                    true
                }
                Err(found) => found == key.check,
            }
        })
    }

    /// The cache trained so far; `None` if there are more cells than the table holds, for then the order of
    /// insertion decides which cells are in it.
    pub fn cache(&self) -> Option<RadianceCache> {
        self.tallies().map(|(tallies, all)| self.cache_of(&tallies, &all))
    }

    /// The same with the training of its cells; `None` before the first path, too.
    pub fn facts(&self) -> Option<CacheFacts> {
        let (tallies, all) = self.tallies().filter(|(_, all)| all.count > 0)?;
        let training = tallies.iter().map(|tally| {
            let times = (tally.count as f32 * ALBEDO_ONE).max(1.0);
            let albedo = Vec3::from_array(tally.albedo.map(|sum| sum as f32 / times));
            Training { paths: tally.count, albedo }
        });
        Some(CacheFacts {
            cache: self.cache_of(&tallies, &all),
            training: training.collect(),
            cell_count: tallies.iter().filter(|tally| tally.parent.is_some()).count(),
            samples: all.count,
        })
    }

    /// Whether a cell may find no slot.
    pub(crate) fn is_full(&self) -> bool {
        self.used.load(Ordering::Relaxed) as f64 > FULL * SLOTS as f64
    }

    /// The content of each slot, with the sums of all their cells in parents, and the total.
    fn tallies(&self) -> Option<(Vec<Tally>, Tally)> {
        let mut tallies: Vec<Tally> = self.words.chunks_exact(WORDS).map(Tally::new).collect();
        if self.is_full() {
            return None;
        }
        let mut all = Tally::default();
        for slot in 0..SLOTS {
            let tally = tallies[slot];
            if let Some(parent) = tally.parent {
                tallies[parent].add(&tally);
                all.add(&tally);
            }
        }
        Some((tallies, all))
    }

    fn cache_of(&self, tallies: &[Tally], all: &Tally) -> RadianceCache {
        let scale = f64::from(self.scale);
        let mean = all.radiance_over_albedo(scale).unwrap_or_default();
        let of_all = |tally: &Tally| tally.leaning(mean, PATHS_OF_ALL, scale);
        let slot_of = |tally: &Tally| {
            let radiance = tally.parent.map_or_else(
                || of_all(tally),
                |parent| tally.leaning(of_all(&tallies[parent]), PARENTS_PATHS, scale),
            );
            let [r, g, b] = radiance.as_vec3().to_array().map(f32::to_bits);
            if tally.check == 0 { [0; 4] } else { [tally.check, r, g, b] }
        };
        RadianceCache {
            cells: self.cells,
            slots: tallies.iter().map(slot_of).collect(),
            mean: mean.as_vec3(),
        }
    }
}

impl Tally {
    fn new(words: &[AtomicU32]) -> Self {
        let word = |at: usize| words[at].load(Ordering::Relaxed);
        let wide = |at: usize| u64::from(word(at)) | u64::from(word(at + 1)) << 32;
        Self {
            check: word(0),
            parent: word(PARENT_AT).checked_sub(1).map(|parent| parent as usize),
            count: u64::from(word(COUNT_AT)),
            albedo: [0, 1, 2].map(|channel| u64::from(word(ALBEDO_AT + channel))),
            radiance: [0, 2, 4].map(|channel| wide(RADIANCE_AT + channel)),
        }
    }

    fn add(&mut self, other: &Self) {
        self.count += other.count;
        for channel in 0..3 {
            self.albedo[channel] += other.albedo[channel];
            self.radiance[channel] = self.radiance[channel].saturating_add(other.radiance[channel]);
        }
    }

    /// `None` without paths.
    fn radiance_over_albedo(&self, scale: f64) -> Option<DVec3> {
        let paths = (self.count > 0).then_some(self.count as f64)?;
        Some(DVec3::from_array([0, 1, 2].map(|channel| {
            let albedo = self.albedo[channel] as f64 / f64::from(ALBEDO_ONE);
            self.radiance[channel] as f64 / scale / albedo.max(MIN_ALBEDO * paths)
        })))
    }

    /// The same blended with an expected value that counts as `weight` paths.
    fn leaning(&self, expected: DVec3, weight: f64, scale: f64) -> DVec3 {
        let paths = self.count as f64;
        self.radiance_over_albedo(scale)
            .map_or(expected, |own| (own * paths + expected * weight) / (paths + weight))
    }
}

/// Random bits from a position, to round values that may be equal everywhere.
fn dice(position: Vec3) -> u32 {
    let [x, y, z] = position.to_array().map(f32::to_bits);
    hash(x ^ hash(y ^ hash(z)))
}

/// Rounds `value` up or down by a hash of its bits, so that the expected result is `value`.
fn dithered(value: f32) -> u64 {
    let value = value.clamp(0.0, MAX_SUM);
    (value + unit_from_bits(hash(value.to_bits()))) as u64
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Of surfaces without texture all estimates have the same albedo.
    #[test]
    fn an_albedo_between_two_units_is_right_in_the_mean() {
        let cells = CacheCells { center: Vec3::ZERO, edge: 100.0, least_distance: 100.0 };
        for albedo in [0.005, 0.01, 0.03, 0.05] {
            let sums = RadianceSums::new(cells, 1.0);
            for place in 0..4000 {
                let position = Vec3::new(place as f32 * 1e-3, 1.0, 1.0);
                sums.add(position, Vec3::Y, Vec3::splat(0.5 * albedo), Vec3::splat(albedo));
            }
            let cache = sums.cache().expect("there is room");
            let known = cache.radiance_over_albedo(Vec3::ONE, Vec3::Y);
            assert!((known - 0.5).abs().max_element() < 0.01, "{albedo}: {known}");
        }
    }
}
