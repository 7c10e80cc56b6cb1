//! Nodes: moments of lights, and about how much of their light reaches a place.

use bytemuck::{Pod, Zeroable};
use glam::Vec3;

/// Bit of [`Node::link`] that marks a leaf.
pub(crate) const LEAF: u32 = 1 << 31;

/// Least cosine that lights are counted with: some of them shine where the mean does not.
pub(crate) const MIN_COSINE: f32 = 1.0 / 64.0;

/// Squared distance in square metres below which lights are not nearer: keeps importance finite.
pub(crate) const NEAREST_SQUARED: f32 = 1e-20;

/// A place at which light is gathered.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Receiver {
    /// World position in metres.
    pub position: Vec3,
    /// Unit normal on the side from which light is scattered; zero if that is all around.
    pub normal: Vec3,
}

/// Moments of the lights below, of a single light at a leaf.
#[derive(Debug, Clone, Copy, PartialEq, Default, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Node {
    center: Vec3,
    variance: f32,
    axis: Vec3,
    /// Relative to that of all lights.
    pub(super) intensity: f32,
    /// Squared share of the aimed lights.
    aimed_squared: f32,
    /// Squared length of `axis`.
    axis_squared: f32,
    around: f32,
    /// The second child (the first one is the next node), or [`LEAF`] and a light.
    pub(super) link: u32,
}

/// Where lights are and where they shine: means over some of them, weighted by intensity.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in super::super) struct Moments {
    /// Largest radiant intensity of each light, summed; any unit, positive.
    pub(in super::super) intensity: f32,
    /// Mean position in metres.
    pub(in super::super) center: Vec3,
    /// Mean squared distance from there in square metres.
    pub(in super::super) variance: f32,
    /// Mean unit axis of the lights that shine as a Lambertian surface does, around their normals;
    /// the others count as zero.
    pub(in super::super) axis: Vec3,
    /// Share of those lights, in `[0,1]`.
    pub(in super::super) aimed: f32,
    /// Mean intensity of the others in every direction, over [`Self::intensity`].
    pub(in super::super) around: f32,
}

impl Moments {
    /// Those of both.
    pub(in super::super) fn with(&self, other: &Self) -> Self {
        let intensity = self.intensity + other.intensity;
        let share = other.intensity / intensity;
        let between = other.center - self.center;
        let mix = |a: f32, b: f32| a + (b - a) * share;
        Self {
            intensity,
            center: self.center + between * share,
            variance: mix(self.variance, other.variance)
                + share * (1.0 - share) * between.length_squared(),
            axis: self.axis.lerp(other.axis, share),
            aimed: mix(self.aimed, other.aimed),
            around: mix(self.around, other.around),
        }
    }

    /// How badly one node stands for these lights: their scatter in space. Least sums of it make
    /// clusters (Ward, *Hierarchical Grouping to Optimize an Objective Function*, 1963); counting
    /// the scatter of axes as well gained nothing.
    pub(super) fn cost(&self) -> f32 {
        self.intensity * self.variance
    }
}

impl Node {
    /// This node in an array where its tree's nodes begin at number `by`.
    #[cfg(feature = "gpu")]
    pub(crate) fn moved(&self, by: u32) -> Self {
        let link = if self.link & LEAF == 0 { self.link + by } else { self.link };
        Self { link, ..*self }
    }

    pub(super) fn new(moments: &Moments, link: u32) -> Self {
        let Moments { intensity, center, variance, axis, aimed, around } = *moments;
        let (aimed_squared, axis_squared) = (aimed * aimed, axis.length_squared());
        Self { center, variance, axis, intensity, aimed_squared, axis_squared, around, link }
    }

    /// About the irradiance that the lights cause at a place, in any unit; positive.
    ///
    /// Squared distances have a mean of that of the centre and the variance. So the vector to the
    /// centre, divided by the root of it, is the shorter the less the lights have one direction, as
    /// is the mean axis; cosines from them are uncertain by what they lack of length one.
    pub(super) fn importance(&self, receiver: &Receiver) -> f32 {
        let to_lights = self.center - receiver.position;
        let squared = (to_lights.length_squared() + self.variance).max(NEAREST_SQUARED);
        let inverse = 1.0 / squared.sqrt();
        let direction = to_lights * inverse;
        let inverse_squared = inverse * inverse;
        let scatter = self.variance * inverse_squared;
        let known = self.axis_squared * (1.0 - scatter);
        let aimed = clamped_mean(-self.axis.dot(direction), self.aimed_squared - known);
        let emitted = (self.around + aimed).max(MIN_COSINE);
        let received = if receiver.normal == Vec3::ZERO {
            1.0
        } else {
            clamped_mean(receiver.normal.dot(direction), scatter).max(MIN_COSINE)
        };
        self.intensity * emitted * received * inverse_squared
    }
}

/// About the mean of cosines that are negative counted as zero: the cosine itself or zero where all
/// are alike (`scatter` 0), and a quarter, as over the sphere, where they are any (`scatter` 1).
fn clamped_mean(cosine: f32, scatter: f32) -> f32 {
    0.5 * (cosine + (cosine * cosine + 0.25 * scatter.max(0.0)).sqrt())
}
