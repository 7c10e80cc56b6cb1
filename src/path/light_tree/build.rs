//! Builds the tree: lights that are near each other come together.

use glam::Vec3;

use super::node::{LEAF, Moments, Node};

/// Places along each axis between which a split is looked for.
const BINS: usize = 16;

/// Depth from which lights are halved by count, wherever they are: no input makes a deep tree.
const HALVED_FROM_DEPTH: u32 = 64;

/// A light to be put into the tree.
#[derive(Debug, Clone, Copy)]
pub(in super::super) struct Light {
    /// What the tree's leaf says.
    pub(in super::super) index: u32,
    pub(in super::super) moments: Moments,
}

/// Nodes in depth-first order, root first; none without lights.
pub(super) fn build(lights: &mut [Light]) -> Vec<Node> {
    let mut nodes = vec![Node::default(); (2 * lights.len()).saturating_sub(1)];
    if !lights.is_empty() {
        branch(lights, &mut nodes, 0, 0);
    }
    nodes
}

/// Fills the nodes of a subtree, which begin at node `first` of the tree.
fn branch(lights: &mut [Light], nodes: &mut [Node], first: u32, depth: u32) -> Moments {
    let (node, below) = nodes.split_first_mut().expect("a subtree has a node");
    let (moments, link) = if let [light] = lights {
        (light.moments, LEAF | light.index)
    } else {
        let count = split(lights, depth);
        let (left, right) = lights.split_at_mut(count);
        let (left_nodes, right_nodes) = below.split_at_mut(2 * count - 1);
        let right_first = first + 2 * count as u32;
        let (left, right) = rayon::join(
            || branch(left, left_nodes, first + 1, depth + 1),
            || branch(right, right_nodes, right_first, depth + 1),
        );
        (left.with(&right), right_first)
    };
    *node = Node::new(&moments, link);
    moments
}

/// Sorts the lights into two parts; returns the size of the first.
fn split(lights: &mut [Light], depth: u32) -> usize {
    let cut = if depth < HALVED_FROM_DEPTH { cheapest_cut(lights) } else { None };
    let Some((place, bin)) = cut else { return lights.len() / 2 };
    lights.sort_by_key(|light| place.bin(light) > bin);
    lights.partition_point(|light| place.bin(light) <= bin)
}

/// Bins along an axis.
#[derive(Clone, Copy)]
struct Bins {
    axis: usize,
    low: f32,
    bins_per_metre: f32,
}

impl Bins {
    fn bin(&self, light: &Light) -> usize {
        let along = light.moments.center[self.axis] - self.low;
        ((along * self.bins_per_metre) as usize).min(BINS - 1)
    }
}

/// The bins and the last bin of the first part for the split of least cost; `None` where all lights
/// are in one place.
fn cheapest_cut(lights: &[Light]) -> Option<(Bins, usize)> {
    let nowhere = (Vec3::INFINITY, Vec3::NEG_INFINITY);
    let centers = lights.iter().map(|light| light.moments.center);
    let (low, high) = centers.fold(nowhere, |(l, h), c| (l.min(c), h.max(c)));
    let axes = [0, 1, 2].map(|axis| Bins {
        axis,
        low: low[axis],
        bins_per_metre: BINS as f32 / (high[axis] - low[axis]),
    });
    let mut best: Option<(f32, Bins, usize)> = None;
    for along in axes.into_iter().filter(|along| along.bins_per_metre.is_finite()) {
        let mut bins = [None; BINS];
        for light in lights {
            let bin = &mut bins[along.bin(light)];
            *bin = joined(*bin, Some(light.moments));
        }
        let mut after = [None; BINS];
        for bin in (1..BINS).rev() {
            after[bin - 1] = joined(after[bin], bins[bin]);
        }
        let mut before = None;
        for (bin, after) in after.iter().enumerate() {
            before = joined(before, bins[bin]);
            if let (Some(before), Some(after)) = (before, after) {
                let cost = before.cost() + after.cost();
                if best.is_none_or(|(least, ..)| cost < least) {
                    best = Some((cost, along, bin));
                }
            }
        }
    }
    best.map(|(_, along, bin)| (along, bin))
}

/// Moments of both, of one where the other has no light.
fn joined(a: Option<Moments>, b: Option<Moments>) -> Option<Moments> {
    match (a, b) {
        (Some(a), Some(b)) => Some(a.with(&b)),
        _ => a.or(b),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::noise::Stream;

    fn direction(stream: &mut Stream) -> Vec3 {
        let mut one = || stream.between(-1.0, 1.0);
        Vec3::new(one(), one(), one()).normalize_or(Vec3::Y)
    }

    fn depth(nodes: &[Node], node: u32) -> u32 {
        let link = nodes[node as usize].link;
        if link & LEAF != 0 { 0 } else { 1 + depth(nodes, node + 1).max(depth(nodes, link)) }
    }

    #[test]
    fn every_light_has_one_leaf_and_no_input_makes_a_deep_tree() {
        let at = |place: &dyn Fn(u32) -> Vec3| -> Vec<Light> {
            let moments = |i| Moments {
                intensity: 1.0,
                center: place(i),
                variance: 0.0,
                axis: Vec3::ZERO,
                aimed: 0.0,
                around: 1.0,
            };
            (0..5000).map(|index| Light { index, moments: moments(index) }).collect()
        };
        let cloud = |i: u32| {
            let mut stream = Stream::new(i);
            direction(&mut stream) * stream.between(0.0, 50.0)
        };
        for (what, mut lights, deepest) in [
            ("one place", at(&|_| Vec3::ONE), 13),
            ("a cloud", at(&cloud), 40),
            // Each split can only take the outermost light off.
            ("ever nearer", at(&|i| Vec3::X * (-0.1 * i as f32).exp2()), 80),
        ] {
            let nodes = build(&mut lights);
            let depth = depth(&nodes, 0);
            eprintln!("{what}: depth {depth}");
            assert!(depth <= deepest, "{what}: {depth}");
            let links = nodes.iter().map(|node| node.link).filter(|link| link & LEAF != 0);
            let mut leaves: Vec<u32> = links.map(|link| link & !LEAF).collect();
            leaves.sort_unstable();
            assert!(leaves.into_iter().eq(0..5000), "{what}");
        }
        assert!(build(&mut []).is_empty());
    }
}
