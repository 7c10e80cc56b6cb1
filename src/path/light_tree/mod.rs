//! Chooses a light by how much of its light may reach a place.
//!
//! A binary tree over the lights, descended from its root: at each node one of two children is
//! chosen in proportion to what may arrive from it (Conty Estevez and Kulla, *Importance Sampling of
//! Many Lights with Adaptive Tree Splitting*, 2018). Theirs is an upper bound from boxes and cones;
//! here it is an estimate from means and variances, with which errors in a hall of lamps were about
//! half as large. Lights without a place, which shine everywhere alike, have a share of their own
//! beforehand.

mod build;
mod node;

pub(super) use build::Light;
pub(super) use node::Moments;
pub use node::Receiver;
pub(crate) use node::{LEAF, MIN_COSINE, NEAREST_SQUARED, Node};

use super::draw::{ALL, Draw, Interval, share_of};

/// Both the lights with a place and those without get at least an eighth of the samples, if there
/// are any: power does not know which of them are seen.
const MIN_SHARE: f64 = 1.0 / 8.0;

/// A light without a place.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct DistantLight {
    /// Its share, in units of `2^-32`, of what those before it left.
    pub(crate) share: u32,
    pub(crate) light: u32,
}

/// A chosen light.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct LightChoice {
    pub(super) light: u32,
    /// Probability of having chosen it, the very ratio of integers that was sampled.
    pub(super) probability: f32,
    /// A fresh uniform number in `[0,1)`.
    pub(super) remainder: f32,
}

/// Chooses among lights by number.
#[derive(Debug, Clone, Default)]
pub(crate) struct LightTree {
    pub(crate) nodes: Vec<Node>,
    /// Node of each of the first lights.
    pub(crate) leaves: Vec<u32>,
    pub(crate) distant: Vec<DistantLight>,
}

impl LightTree {
    /// A tree of `lights`, which together emit `power`, beside `distant` lights, each with its power
    /// in the same unit. The first `leaves` lights may be asked for their [`Self::probability`].
    pub(super) fn new(
        mut lights: Vec<Light>,
        power: f64,
        distant: &[(u32, f64)],
        leaves: usize,
    ) -> Self {
        let nodes = build::build(&mut lights);
        let mut leaf_of = vec![0; leaves];
        for (index, node) in (0..).zip(&nodes) {
            if node.link & LEAF != 0
                && let Some(leaf) = leaf_of.get_mut((node.link & !LEAF) as usize)
            {
                *leaf = index;
            }
        }
        let distant = distant_shares(distant, (!nodes.is_empty()).then_some(power));
        Self { nodes, leaves: leaf_of, distant }
    }

    /// Whether there is no light.
    pub(super) fn is_empty(&self) -> bool {
        self.nodes.is_empty() && self.distant.is_empty()
    }

    /// Chooses a light with a uniform 32-bit number. There must be one.
    pub(super) fn sample(&self, receiver: &Receiver, bits: u32) -> LightChoice {
        let mut draw = Draw::new(bits);
        let distant = self.distant.iter().find(|distant| draw.chooses_first(distant.share));
        let light = distant.map_or_else(|| self.descend(receiver, &mut draw), |d| d.light);
        LightChoice { light, probability: draw.probability(), remainder: draw.remainder() }
    }

    fn descend(&self, receiver: &Receiver, draw: &mut Draw) -> u32 {
        let mut node = 0;
        loop {
            let link = self.nodes[node as usize].link;
            if link & LEAF != 0 {
                return link & !LEAF;
            }
            let share = self.share_of_first(node, link, receiver);
            node = if draw.chooses_first(share) { node + 1 } else { link };
        }
    }

    /// Probability with which [`Self::sample`] chooses `light`.
    pub(super) fn probability(&self, receiver: &Receiver, light: u32) -> f32 {
        let leaf = self.leaves[light as usize];
        let mut chosen = Interval::WHOLE;
        for distant in &self.distant {
            chosen.choose(distant.share, false);
        }
        let mut node = 0;
        while node != leaf {
            let second = self.nodes[node as usize].link;
            let first = leaf < second;
            chosen.choose(self.share_of_first(node, second, receiver), first);
            node = if first { node + 1 } else { second };
        }
        chosen.probability()
    }

    /// Share of a node's first child.
    fn share_of_first(&self, node: u32, second: u32, receiver: &Receiver) -> u32 {
        let first = self.nodes[node as usize + 1].importance(receiver);
        let sum = first + self.nodes[second as usize].importance(receiver);
        share_of(if sum > 0.0 { first / sum } else { 0.5 })
    }
}

/// By power, but for [`MIN_SHARE`]. `power` is that of the lights with a place, if there are any.
fn distant_shares(distant: &[(u32, f64)], power: Option<f64>) -> Vec<DistantLight> {
    let mut left: f64 = distant.iter().map(|(_, power)| power).sum();
    let ratio = (1.0 - MIN_SHARE) / MIN_SHARE;
    let placed = power.map(|power| power.clamp(left / ratio, left * ratio));
    let mut shares = Vec::with_capacity(distant.len());
    for (index, &(light, power)) in distant.iter().enumerate() {
        let is_last = placed.is_none() && index + 1 == distant.len();
        let share = (power / (left + placed.unwrap_or(0.0))) as f32;
        shares.push(DistantLight { share: if is_last { ALL } else { share_of(share) }, light });
        left = (left - power).max(0.0);
    }
    shares
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;
    use crate::metrics::hypothesis::chi_square_test;
    use crate::noise::Stream;
    use crate::sampler::hash;

    fn direction(stream: &mut Stream) -> Vec3 {
        let mut one = || stream.between(-1.0, 1.0);
        Vec3::new(one(), one(), one()).normalize_or(Vec3::Y)
    }

    /// Small lights in a box of 20 metres, most of them facing one way, of intensity 1e-3 to 1,
    /// and a last one of intensity `strong`.
    fn tree(count: u32, strong: f32, distant: &[(u32, f64)]) -> LightTree {
        let mut stream = Stream::new(count);
        let mut lights: Vec<Light> = (0..count)
            .map(|index| {
                let center = 10.0 * Vec3::new(1.0, 0.2, 1.0) * direction(&mut stream);
                let axis = (direction(&mut stream) - 1.5 * Vec3::Y).normalize();
                let intensity = 10.0_f32.powf(stream.between(-3.0, 0.0));
                let (axis, aimed, around) =
                    if index % 4 == 0 { (Vec3::ZERO, 0.0, 1.0) } else { (axis, 1.0, 0.0) };
                let moments = Moments { intensity, center, variance: 1e-5, axis, aimed, around };
                Light { index, moments }
            })
            .collect();
        lights[count as usize - 1].moments.intensity = strong;
        LightTree::new(lights, f64::from(count), distant, count as usize)
    }

    fn receivers(count: usize) -> Vec<Receiver> {
        let mut stream = Stream::new(7);
        let mut one = |i: usize| Receiver {
            position: 10.0 * direction(&mut stream) * if i % 5 == 4 { 30.0 } else { 1.0 },
            normal: if i.is_multiple_of(3) { Vec3::ZERO } else { direction(&mut stream) },
        };
        (0..count).map(&mut one).collect()
    }

    /// Many lights and one strong one beside many, chosen from several places.
    #[test]
    fn choices_follow_their_probabilities() {
        const DRAWS: u32 = 500_000;
        for (count, strong) in [(200_000, 1.0), (200_000, 1e6), (3, 1.0), (1000, 1e-6)] {
            let tree = tree(count, strong, &[]);
            for receiver in receivers(3) {
                let mut observed = vec![0.0; count as usize];
                for i in 0..DRAWS {
                    // Not evenly spaced, or the statistic would be too small to tell anything.
                    let choice = tree.sample(&receiver, hash(hash(i) ^ count));
                    observed[choice.light as usize] += 1.0;
                    if i % 1000 == 0 {
                        let probability = tree.probability(&receiver, choice.light);
                        assert_eq!(choice.probability, probability);
                    }
                }
                let probabilities: Vec<f64> =
                    (0..count).map(|light| tree.probability(&receiver, light).into()).collect();
                let total: f64 = probabilities.iter().sum();
                assert!((total - 1.0).abs() < 1e-5, "{total}");
                assert!(probabilities.iter().all(|p| *p > 0.0), "every light is reachable");
                let scale = f64::from(DRAWS) / total;
                let expected: Vec<f64> = probabilities.iter().map(|p| p * scale).collect();
                let test = chi_square_test(&observed, &expected, 1e-4).expect("two cells or more");
                assert!(test.passed, "{count} lights, strong {strong}: {test:?}");
            }
        }
    }

    #[test]
    fn larger_numbers_choose_later_lights() {
        let tree = tree(500, 10.0, &[(500, 100.0), (501, 1.0)]);
        for receiver in receivers(4) {
            let mut previous = (0, -1.0);
            for step in 0..1 << 18 {
                let choice = tree.sample(&receiver, step << 14);
                let place = match choice.light {
                    500.. => choice.light - 500,
                    light => 2 + tree.leaves[light as usize],
                };
                assert!((0.0..1.0).contains(&choice.remainder));
                assert!((place, choice.remainder) > previous, "{previous:?}, {choice:?}");
                previous = (place, choice.remainder);
            }
        }
    }

    #[test]
    fn distant_lights_get_their_share() {
        let share_of_light = |tree: &LightTree, light| {
            let receiver = receivers(1)[0];
            (0..1 << 16).filter(|i| tree.sample(&receiver, i << 16).light == light).count() as f64
                / 65_536.0
        };
        // By power, but with at least an eighth for either kind.
        for (power, expected) in [(300.0, 0.75), (1e9, 0.875), (1e-9, 0.125)] {
            let tree = tree(100, 1.0, &[(100, power)]);
            let share = share_of_light(&tree, 100);
            assert!((share - expected).abs() < 1e-3, "{power}: {share}");
            let receiver = receivers(1)[0];
            let placed: f32 = (0..100).map(|light| tree.probability(&receiver, light)).sum();
            assert!((f64::from(placed) - (1.0 - expected)).abs() < 1e-5, "{placed}");
        }
        let alone = LightTree::new(Vec::new(), 0.0, &[(0, 1.0), (1, 3.0)], 0);
        assert!((share_of_light(&alone, 0) - 0.25).abs() < 1e-3);
        assert!((share_of_light(&alone, 1) - 0.75).abs() < 1e-3);
    }

    /// What the tree is for: the variance of one sample of the irradiance is much less than by power.
    #[test]
    fn near_lights_are_preferred() {
        let tree = tree(5000, 1.0, &[]);
        let leaf = |light| &tree.nodes[tree.leaves[light as usize] as usize];
        let total: f64 = (0..5000).map(|light| f64::from(leaf(light).intensity)).sum();
        for receiver in receivers(8).iter().step_by(3) {
            let mut second_moments = [0.0; 2];
            let mut sum = 0.0;
            for light in 0..5000 {
                let irradiance = f64::from(leaf(light).importance(receiver));
                let by_tree = f64::from(tree.probability(receiver, light));
                let by_power = f64::from(leaf(light).intensity) / total;
                second_moments[0] += irradiance * irradiance / by_tree;
                second_moments[1] += irradiance * irradiance / by_power;
                sum += irradiance;
            }
            let [by_tree, by_power] = second_moments.map(|m| m / (sum * sum) - 1.0);
            eprintln!("{}: {by_tree:.2} instead of {by_power:.2}", receiver.position);
            assert!(by_tree < 0.5 * by_power, "{by_tree} {by_power}");
        }
    }
}
