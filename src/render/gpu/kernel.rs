//! The kernels.

/// Declares the kernels, each with the name of its entry point, which is that of its file too.
macro_rules! kernels {
    ($($(#[$doc:meta])+ $kernel:ident = $name:literal)+) => {
        /// Entry points.
        #[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
        pub(crate) enum Kernel {
            $($(#[$doc])+ $kernel),+
        }

        impl Kernel {
            /// Number of kernels.
            pub(crate) const COUNT: usize = [$($name),+].len();

            /// Name of the entry point.
            pub(crate) fn name(self) -> &'static str {
                match self {
                    $(Self::$kernel => $name),+
                }
            }

            /// The file with the entry point.
            pub(super) fn source(self) -> &'static str {
                match self {
                    $(Self::$kernel => include_str!(concat!("../../../shaders/", $name, ".wgsl"))),+
                }
            }
        }
    };
}

kernels! {
    /// Adds samples to pixels.
    Render = "render"
    /// Traces learning paths.
    Learn = "learn"
    /// Traces paths that train the radiance cache.
    Train = "train"
    /// Finds the nearest hits of rays, for measurements.
    ClosestHits = "closest_hits"
    /// Finds how much light comes along rays, for measurements.
    ShadowRays = "shadow_rays"
    /// Adds samples to pixels, with the two that follow: finds what rays of paths hit.
    Trace = "trace"
    /// Finds what becomes of paths there.
    Shade = "shade"
    /// Follows their rays towards lights.
    FollowShadows = "follow_shadows"
    /// Adds samples to pixels that share, with the two that follow: finds second vertices.
    FindSeconds = "find_seconds"
    /// Estimates what arrives there.
    LightSeconds = "light_seconds"
    /// Gathers light at the first vertices.
    ConnectSeconds = "connect_seconds"
}

impl Kernel {
    /// Those that bring all paths one ray further, in order.
    pub(crate) const OF_QUEUE: [Self; 3] = [Self::Trace, Self::Shade, Self::FollowShadows];

    /// Those that add one sample to every pixel, in order.
    pub(crate) const OF_SHARING: [Self; 3] =
        [Self::FindSeconds, Self::LightSeconds, Self::ConnectSeconds];

    /// Whether it traces rays that the host made, not paths.
    pub(super) fn casts(self) -> bool {
        matches!(self, Self::ClosestHits | Self::ShadowRays)
    }

    /// Whether it adds finished paths to the film.
    pub(super) fn adds_samples(self) -> bool {
        matches!(self, Self::Render | Self::Trace | Self::ConnectSeconds)
    }

    /// Whether its paths are not those of pixels.
    pub(super) fn begins_anywhere(self) -> bool {
        matches!(self, Self::Learn | Self::Train)
    }

    /// Whether its pixels share second vertices.
    pub(super) fn shares(self) -> bool {
        Self::OF_SHARING.contains(&self)
    }

    /// Whether paths wait in slots.
    pub(super) fn keeps_paths(self) -> bool {
        self.is_of_queue() || self == Self::LightSeconds
    }

    /// Whether its paths lie in slots.
    pub(super) fn is_of_queue(self) -> bool {
        Self::OF_QUEUE.contains(&self)
    }
}
