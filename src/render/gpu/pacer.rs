//! How much work one dispatch may hold.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

/// Longest time one dispatch should take: a desktop stays smooth, no driver resets, and a cancelled
/// render ends at once.
pub(super) const TARGET_SECONDS: f64 = 0.012;
/// The same where frames of a window wait in the same queue, behind all dispatches under way.
pub(super) const WINDOW_TARGET_SECONDS: f64 = 0.004;

/// Units that dispatches of a kernel last held, as bits; 0 before the first one. All pictures share it.
pub(super) type LastUnits = Arc<AtomicU64>;

/// Adapts the size of dispatches (in workgroup samples) to what the device manages.
#[derive(Debug, Clone)]
pub(super) struct Pacer {
    units: f64,
    target_seconds: f64,
    last: LastUnits,
}

impl Pacer {
    /// Small dispatches at first, in the end of about so many seconds.
    pub(super) fn new(target_seconds: f64) -> Self {
        Self { units: 4.0, target_seconds, last: LastUnits::default() }
    }

    /// Goes on at half of what another picture's dispatches held last, if there were any.
    pub(super) fn resume(&mut self, last: &LastUnits) {
        let units = f64::from_bits(last.load(Ordering::Relaxed));
        self.units = self.units.max(0.5 * units);
        self.last = Arc::clone(last);
    }

    /// Units the next dispatch may hold, at least one.
    pub(super) fn units(&self) -> u64 {
        self.units as u64
    }

    /// Notes that `units` took `seconds`: shrinks at once, grows at most twofold.
    pub(super) fn record(&mut self, units: u64, seconds: f64) {
        let affordable = units as f64 * self.target_seconds / seconds.max(1e-6);
        // A dispatch much smaller than allowed says little about larger ones.
        let says_more = units as f64 >= 0.5 * self.units;
        let most = if says_more { 2.0 * self.units.max(units as f64) } else { self.units };
        self.units = affordable.min(most).clamp(1.0, 1e9);
        self.last.store(self.units.to_bits(), Ordering::Relaxed);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A device that does `rate` units a second after a fixed cost.
    fn settled(rate: f64) -> f64 {
        let mut pacer = Pacer::new(TARGET_SECONDS);
        for _ in 0..200 {
            let units = pacer.units();
            pacer.record(units, 5e-5 + units as f64 / rate);
        }
        5e-5 + pacer.units() as f64 / rate
    }

    #[test]
    fn dispatches_settle_near_the_target_on_slow_and_fast_devices() {
        for rate in [1e3, 1e4, 1e6, 1e9] {
            let seconds = settled(rate);
            assert!((0.5..=1.1).contains(&(seconds / TARGET_SECONDS)), "{rate}: {seconds}");
        }
        // A device too slow for even one unit gets one.
        assert!(settled(10.0) < 0.11);
    }

    #[test]
    fn another_picture_begins_where_the_last_one_ended() {
        let last = LastUnits::default();
        let mut first = Pacer::new(TARGET_SECONDS);
        first.resume(&last);
        assert_eq!(first.units(), 4, "nothing is known");
        for _ in 0..20 {
            first.record(first.units(), first.units() as f64 / 1e6);
        }
        let mut second = Pacer::new(TARGET_SECONDS);
        second.resume(&last);
        assert_eq!(second.units(), first.units() / 2);
    }

    #[test]
    fn a_sudden_slow_part_is_answered_at_once() {
        let mut pacer = Pacer { units: 1000.0, ..Pacer::new(TARGET_SECONDS) };
        pacer.record(1000, 0.12);
        assert!(pacer.units() < 400);
    }
}
