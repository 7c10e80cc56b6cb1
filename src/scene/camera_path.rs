//! How a camera moves in time: keyframes along the chain of nodes it hangs from.

use glam::{DAffine3, DQuat, DVec3};

/// Frames per second of a movement, where nobody asks for others.
pub const FRAMES_PER_SECOND: f64 = 24.0;

/// The movement of one camera.
#[derive(Debug, Clone, PartialEq)]
pub struct CameraPath {
    links: Vec<Link>,
}

/// A node between the world and the camera.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Link {
    /// Parent from node, at all times.
    Fixed(DAffine3),
    /// Parent from node by what is animated of it, or at rest.
    Moving {
        translation: Track<3>,
        /// Quaternions x, y, z, w of any length.
        rotation: Track<4>,
        scale: Track<3>,
    },
}

/// How to get from one key to the next.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Interpolation {
    Step,
    Linear,
    /// Cubic Hermite splines: each key has an in-tangent, a value and an out-tangent.
    Cubic,
}

/// A value of `N` numbers over time.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Track<const N: usize> {
    /// Seconds of the keys, rising; at least one.
    times: Vec<f64>,
    /// One a key, three if [`Interpolation::Cubic`].
    values: Vec<[f64; N]>,
    interpolation: Interpolation,
}

impl CameraPath {
    /// Along these nodes, the root first; `None` if nothing moves.
    pub(crate) fn new(links: Vec<Link>) -> Option<Self> {
        let moves = links.iter().any(|link| link.end() > 0.0);
        moves.then_some(Self { links })
    }

    /// Time of the last key in seconds, above 0.
    pub fn seconds(&self) -> f64 {
        self.links.iter().map(Link::end).fold(0.0, f64::max)
    }

    /// World from camera at a time in seconds; before the first key and after the last as there.
    pub fn at(&self, seconds: f64) -> DAffine3 {
        let links = self.links.iter().map(|link| link.at(seconds));
        unmirrored(links.fold(DAffine3::IDENTITY, |world, link| world * link))
    }
}

/// World from camera for a picture that is not mirrored, whatever is mirrored above: scale is ignored for cameras
/// (glTF 2.0, section 3.10.2). The camera looks the same way, its top stays at the top.
pub(crate) fn unmirrored(mut world_from_camera: DAffine3) -> DAffine3 {
    let axes = &mut world_from_camera.matrix3;
    if axes.determinant() < 0.0 {
        axes.x_axis = -axes.x_axis;
    }
    world_from_camera
}

impl Link {
    fn end(&self) -> f64 {
        match self {
            Self::Fixed(_) => 0.0,
            Self::Moving { translation, rotation, scale } => {
                translation.end().max(rotation.end()).max(scale.end())
            }
        }
    }

    fn at(&self, seconds: f64) -> DAffine3 {
        match self {
            Self::Fixed(transform) => *transform,
            Self::Moving { translation, rotation, scale } => {
                DAffine3::from_scale_rotation_translation(
                    scale.at(seconds, lerp).into(),
                    unit(rotation.at(seconds, slerp)),
                    translation.at(seconds, lerp).into(),
                )
            }
        }
    }
}

impl<const N: usize> Track<N> {
    /// The same value at all times.
    pub(crate) fn constant(value: [f64; N]) -> Self {
        Self { times: vec![0.0], values: vec![value], interpolation: Interpolation::Step }
    }

    /// Of keys; `None` unless there is one, their times rise, and there are as many values as it takes.
    pub(crate) fn new(
        times: Vec<f64>,
        values: Vec<[f64; N]>,
        interpolation: Interpolation,
    ) -> Option<Self> {
        let values_per_key = if interpolation == Interpolation::Cubic { 3 } else { 1 };
        let fits = !times.is_empty()
            && values.len() == times.len().checked_mul(values_per_key)?
            && times.iter().all(|time| time.is_finite())
            && times.is_sorted()
            && values.as_flattened().iter().all(|value| value.is_finite());
        fits.then_some(Self { times, values, interpolation })
    }

    fn end(&self) -> f64 {
        self.times.last().copied().unwrap_or(0.0)
    }

    /// The value at a time, where `between` goes from one key to the next, 0 to 1.
    fn at(&self, seconds: f64, between: fn([f64; N], [f64; N], f64) -> [f64; N]) -> [f64; N] {
        let next = self.times.partition_point(|time| *time <= seconds);
        let (key, next) = (next.saturating_sub(1), next.min(self.times.len() - 1));
        let duration = self.times[next] - self.times[key];
        let t = if duration > 0.0 { (seconds - self.times[key]) / duration } else { 0.0 };
        match self.interpolation {
            Interpolation::Step => self.values[key],
            Interpolation::Linear => between(self.values[key], self.values[next], t),
            Interpolation::Cubic => {
                let [from, out] = [1, 2].map(|i| self.values[3 * key + i]);
                let [into, to] = [0, 1].map(|i| self.values[3 * next + i]);
                let (t2, t3) = (t * t, t * t * t);
                std::array::from_fn(|i| {
                    (2.0 * t3 - 3.0 * t2 + 1.0) * from[i]
                        + duration * (t3 - 2.0 * t2 + t) * out[i]
                        + (3.0 * t2 - 2.0 * t3) * to[i]
                        + duration * (t3 - t2) * into[i]
                })
            }
        }
    }
}

fn lerp(a: [f64; 3], b: [f64; 3], t: f64) -> [f64; 3] {
    DVec3::from(a).lerp(b.into(), t).into()
}

fn slerp(a: [f64; 4], b: [f64; 4], t: f64) -> [f64; 4] {
    unit(a).slerp(unit(b), t).to_array()
}

/// The rotation that a quaternion of any length stands for.
fn unit(quaternion: [f64; 4]) -> DQuat {
    let quaternion = DQuat::from_array(quaternion);
    if quaternion.length() > 0.0 { quaternion.normalize() } else { DQuat::IDENTITY }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn track(interpolation: Interpolation, values: &[[f64; 3]]) -> Track<3> {
        Track::new(vec![1.0, 3.0], values.to_vec(), interpolation).expect("sound keys")
    }

    #[test]
    fn keys_are_met_and_what_lies_between_is_interpolated() {
        let (a, b) = ([1.0, 0.0, 0.0], [5.0, 2.0, 0.0]);
        for (interpolation, middle) in
            [(Interpolation::Step, a), (Interpolation::Linear, [3.0, 1.0, 0.0])]
        {
            let track = track(interpolation, &[a, b]);
            for (seconds, value) in [(0.0, a), (1.0, a), (2.0, middle), (3.0, b), (9.0, b)] {
                assert_eq!(track.at(seconds, lerp), value, "{interpolation:?} at {seconds}");
            }
        }
    }

    /// A cubic polynomial is its own spline.
    #[test]
    fn splines_follow_their_tangents() {
        let p = |t: f64| [t * t * t - t, 2.0 - t * t, t];
        let slope = |t: f64| [3.0 * t * t - 1.0, -2.0 * t, 1.0];
        let keys = [[9.0; 3], p(1.0), slope(1.0), slope(3.0), p(3.0), [9.0; 3]];
        let track = track(Interpolation::Cubic, &keys);
        for seconds in [1.0, 1.3, 2.0, 2.9, 3.0] {
            let found = DVec3::from(track.at(seconds, lerp));
            assert!(found.abs_diff_eq(p(seconds).into(), 1e-12), "{seconds}: {found}");
        }
    }

    #[test]
    fn a_camera_hangs_from_what_turns() {
        let quarter = DQuat::from_rotation_y(std::f64::consts::FRAC_PI_2).to_array();
        let rotation =
            Track::new(vec![0.0, 1.0], vec![[0.0, 0.0, 0.0, 2.0], quarter], Interpolation::Linear);
        let arm = Link::Moving {
            translation: Track::constant([0.0; 3]),
            rotation: rotation.expect("sound keys"),
            scale: Track::constant([1.0; 3]),
        };
        let camera = Link::Fixed(DAffine3::from_translation(DVec3::new(0.0, 1.0, 4.0)));
        let path = CameraPath::new(vec![arm, camera]).expect("it moves");
        assert_eq!(path.links.iter().map(Link::end).fold(0.0, f64::max), 1.0);
        for (seconds, angle) in [(0.0, 0.0), (0.5, 45.0_f64), (1.0, 90.0), (2.0, 90.0)] {
            let angle = angle.to_radians();
            let expected = DVec3::new(4.0 * angle.sin(), 1.0, 4.0 * angle.cos());
            let found = path.at(seconds).translation;
            assert!(found.abs_diff_eq(expected, 1e-12), "{seconds}: {found}");
        }
        assert!(CameraPath::new(vec![Link::Fixed(DAffine3::IDENTITY)]).is_none());
    }

    #[test]
    fn keys_that_make_no_sense_are_refused() {
        let new = |times: &[f64], count| {
            Track::new(times.to_vec(), vec![[0.0; 3]; count], Interpolation::Linear)
        };
        assert!(new(&[0.0, 1.0], 2).is_some());
        for (times, count) in [(&[][..], 0), (&[0.0], 2), (&[1.0, 0.0], 2), (&[0.0, f64::NAN], 2)] {
            assert!(new(times, count).is_none(), "{times:?}");
        }
        assert!(Track::new(vec![0.0], vec![[0.0; 3]], Interpolation::Cubic).is_none());
    }
}
