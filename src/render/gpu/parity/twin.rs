//! What a probe's answer must be, and how near.

use glam::{Vec2, Vec3, Vec4};

use super::UNTOUCHED;

/// How far an answer may be from its twin: so many units in the last place of the number, or of
/// `scale` if that is larger.
///
/// A scale states what a number is the difference of: where terms cancel, as in the components of
/// a direction (scale 1), its own last place says nothing of how well it was computed.
#[derive(Debug, Clone, Copy)]
pub(super) struct Bound {
    ulps: f32,
    scale: f32,
}

/// The very same number, apart from the sign of zero.
pub(super) const EXACT: Bound = ulps(0.0);

/// Units in the last place of the number itself.
pub(super) const fn ulps(ulps: f32) -> Bound {
    Bound { ulps, scale: 0.0 }
}

impl Bound {
    /// Units in the last place of `scale`.
    pub(super) fn of(self, scale: f32) -> Self {
        Self { scale: scale.abs(), ..self }
    }

    /// So many times as wide.
    pub(super) fn widened(self, factor: f32) -> Self {
        Self { ulps: self.ulps * factor, ..self }
    }

    /// The error as a share of what is allowed. Devices may take subnormal numbers for zero.
    fn share(self, right: f32, device: f32) -> f32 {
        let is_tiny = |x: f32| x.abs() < f32::MIN_POSITIVE;
        if right == device || (is_tiny(right) && is_tiny(device)) {
            return 0.0;
        }
        if !(right.is_finite() && device.is_finite()) {
            return f32::INFINITY;
        }
        let scale = right.abs().max(self.scale).clamp(f32::MIN_POSITIVE, f32::MAX);
        let unit = f64::from(f32::from_bits(scale.to_bits() + 1)) - f64::from(scale);
        ((f64::from(right) - f64::from(device)).abs() / (unit * f64::from(self.ulps))) as f32
    }
}

/// Numbers that are compared one by one.
pub(super) trait Numbers {
    /// All of them.
    fn numbers(self) -> Vec<f32>;
}

impl Numbers for f32 {
    fn numbers(self) -> Vec<f32> {
        vec![self]
    }
}

macro_rules! numbers_of_vectors {
    ($($vector:ty),*) => {$(
        impl Numbers for $vector {
            fn numbers(self) -> Vec<f32> {
                self.to_array().into()
            }
        }
    )*};
}

numbers_of_vectors!(Vec2, Vec3, Vec4);

/// One case: its words, and the device's answer, which is compared as the twin says what is right.
pub(super) struct Twin<'a> {
    case: &'a [u32],
    answer: &'a [u32],
    /// So many times each bound is allowed.
    slack: f32,
    read: usize,
    compared: usize,
    worst: f32,
    wrong: Option<String>,
}

impl<'a> Twin<'a> {
    pub(super) fn new(case: &'a [u32], answer: &'a [u32], slack: f32) -> Self {
        Self { case, answer, slack, read: 0, compared: 0, worst: 0.0, wrong: None }
    }

    pub(super) fn take_word(&mut self) -> u32 {
        self.read += 1;
        self.case[self.read - 1]
    }

    pub(super) fn take(&mut self) -> f32 {
        f32::from_bits(self.take_word())
    }

    pub(super) fn take2(&mut self) -> Vec2 {
        Vec2::new(self.take(), self.take())
    }

    pub(super) fn take3(&mut self) -> Vec3 {
        Vec3::new(self.take(), self.take(), self.take())
    }

    pub(super) fn take4(&mut self) -> Vec4 {
        Vec4::new(self.take(), self.take(), self.take(), self.take())
    }

    /// The device's next word, taken as it is.
    pub(super) fn device_word(&mut self) -> u32 {
        self.compared += 1;
        self.answer[self.compared - 1]
    }

    /// The device's next number, taken as it is.
    pub(super) fn device(&mut self) -> f32 {
        f32::from_bits(self.device_word())
    }

    /// Takes what is left of the answer as it is.
    pub(super) fn accept_rest(&mut self) {
        while self.answer.get(self.compared).is_some_and(|word| *word != UNTOUCHED) {
            self.compared += 1;
        }
    }

    /// The device's next word must be this.
    pub(super) fn same(&mut self, right: impl Into<u32>) {
        let (right, device) = (right.into(), self.device_word());
        self.check(device == right, || format!("{device:#x} instead of {right:#x}"));
    }

    /// The device's next numbers must be these, within the bound.
    pub(super) fn near(&mut self, right: impl Numbers, bound: Bound) {
        for right in right.numbers() {
            let device = self.device();
            let share = bound.share(right, device);
            self.worst = self.worst.max(share);
            self.check(share <= self.slack, || {
                format!("{device:e} instead of {right:e}, {share:.2} of {bound:?}")
            });
        }
    }

    /// Notes what is wrong, if nothing was so far.
    pub(super) fn check(&mut self, is_right: bool, complaint: impl FnOnce() -> String) {
        if !is_right && self.wrong.is_none() {
            let floats: Vec<f32> = self.case.iter().map(|word| f32::from_bits(*word)).collect();
            let Self { case, compared, .. } = self;
            self.wrong =
                Some(format!("word {}: {}; case {floats:?} {case:?}", *compared - 1, complaint()));
        }
    }

    /// The largest error as a share of its bound, or the first complaint.
    pub(super) fn finish(mut self) -> Result<f32, String> {
        assert_eq!(self.read, self.case.len(), "the twin reads what the probe reads");
        let rest = self.answer.get(self.compared).copied();
        self.compared += 1;
        self.check(rest.is_none_or(|word| word == UNTOUCHED), || "more than expected".to_owned());
        self.wrong.map_or(Ok(self.worst), Err)
    }
}

#[test]
fn a_bound_counts_units_in_the_last_place() {
    let next = |x: f32, n: u32| f32::from_bits(x.to_bits() + n);
    assert_eq!(ulps(2.0).share(1.5, next(1.5, 2)), 1.0);
    assert_eq!(ulps(2.0).share(1e30, next(1e30, 3)), 1.5);
    assert_eq!(ulps(1.0).of(1.0).share(1e-9, 1e-9 + f32::EPSILON), 1.0);
    assert_eq!(EXACT.share(0.0, -0.0), 0.0);
    assert!(EXACT.share(1.0, next(1.0, 1)) > 1.0);
    assert!(ulps(9.0).share(1.0, f32::NAN) > 1.0);
    assert_eq!(ulps(1.0).share(1e-39, 0.0), 0.0, "a subnormal number may become zero");
}
