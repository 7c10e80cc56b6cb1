//! When paths end that could go on: maximum of vertices, and Russian roulette.

with_defaults! {
    /// What bounds a path.
    #[derive(Debug, Clone, Copy, PartialEq, Eq)]
    pub struct PathLimits {
        /// Most vertices, on surfaces or in a medium, that scatter light; 1 is direct light only, 0 sees emitters
        /// and the environment alone. Perfect mirrors and smooth glass scatter none. In the built-in rooms 8 leave
        /// out 1 to 2 % of the light, and 32 take 4 % more CPU time.
        pub bounces: u32 = 32,
        /// Whether dim paths are ended at random.
        pub russian_roulette: bool = true,
    }
}

impl PathLimits {
    /// Most [`Self::bounces`] that may be asked for.
    pub const MAX_BOUNCES: u32 = 100_000;
}

/// Vertices after which Russian roulette may end a path.
pub(crate) const ROULETTE_AFTER: u32 = 3;
/// A path that carries less than one over this is ended in proportion: ending it as soon as it carries
/// less than 1 saves a third of the rays of an office and doubles its error.
pub(crate) const ROULETTE_MILDNESS: f32 = 3.0;

/// Least probability of surviving it: a path that carries little is not made to count for too much.
pub(crate) const MIN_SURVIVAL: f32 = 0.05;

/// Most perfect reflections and refractions in a row; only light that is caught in a solid has more.
pub(crate) const MAX_INTERFACES: u32 = 64;

/// Panes and leaves one ray may pass; only a scene that is broken has more.
pub(crate) const MAX_PASSES: u32 = 1000;

/// What a path still carries where a limit ends it: its throughput's largest component, 0 for a limit that has not
/// ended it. The mean over paths is the share of light that a picture lacks, where all places are as bright.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct CutOff {
    /// After [`PathLimits::bounces`].
    pub(crate) by_bounces: f32,
    /// After [`MAX_INTERFACES`].
    pub(crate) by_interfaces: f32,
}
