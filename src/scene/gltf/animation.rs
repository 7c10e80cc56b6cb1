//! How cameras move by a file's animations; everything else stays at rest.

use std::collections::BTreeMap;

use gltf::json;
use json::Index;
use json::accessor::Type;
use json::animation::{Channel, Interpolation as Written, Property, Sampler};
use json::validation::Checked;
use serde::Deserialize;
use serde_json::Value;

use super::accessor::Elements;
use super::buffers::File;
use super::limits::Fallible;
use super::pose::{Nodes, local_transform, own_mirror};
use crate::scene::Frame;
use crate::scene::camera_path::{CameraPath, Interpolation, Link, Track};

/// Members of an animation. Channels are read one by one, for some are of no node: those of
/// `KHR_animation_pointer`.
#[derive(Deserialize)]
struct Animation {
    channels: Vec<Value>,
    samplers: Vec<Sampler>,
}

/// What is animated of the nodes of a file.
pub(super) struct Channels<'a> {
    file: &'a File<'a>,
    /// Of each node and property, by the first animation that has it.
    samplers: BTreeMap<(u32, u8), Keys>,
}

/// Where the keys of a property are, and what happens between them.
#[derive(Clone, Copy)]
struct Keys {
    times: Index<json::Accessor>,
    values: Index<json::Accessor>,
    interpolation: Checked<Written>,
}

impl<'a> Channels<'a> {
    /// Of all animations together. What refers to nothing, or is newer than the types, is passed over.
    pub(super) fn new(file: &'a File<'a>) -> Self {
        let mut samplers = BTreeMap::new();
        let animations = &file.document.animations;
        let read = |index| animations.get_as::<Animation>(index).ok();
        for animation in animations.indices().filter_map(read) {
            for channel in animation.channels.iter().filter_map(|it| Channel::deserialize(it).ok())
            {
                let Checked::Valid(property) = channel.target.path else { continue };
                if let Some(sampler) = animation.samplers.get(channel.sampler.value()) {
                    let target = (channel.target.node.value() as u32, property as u8);
                    let &Sampler { input: times, output: values, interpolation, .. } = sampler;
                    samplers.entry(target).or_insert(Keys { times, values, interpolation });
                }
            }
        }
        Self { file, samplers }
    }

    /// The movement of a camera at a node; `None` if it stands still.
    pub(super) fn camera_path(
        &self,
        nodes: &Nodes,
        frame: Frame,
        node: Index<json::Node>,
    ) -> Fallible<Option<CameraPath>> {
        let mut links = Vec::new();
        // Nodes at rest below the last one that moves.
        let mut fixed = own_mirror(&self.file.document.nodes.get(node)?);
        let mut next = Some(node);
        while let Some(node) = next {
            let at_rest = self.file.document.nodes.get(node)?;
            match self.moving(node, &at_rest)? {
                None => fixed = local_transform(&at_rest) * fixed,
                Some(link) => links.extend([Link::Fixed(std::mem::take(&mut fixed)), link]),
            }
            next = nodes.parent(node);
        }
        links.push(Link::Fixed(frame.transform() * fixed));
        links.reverse();
        Ok(CameraPath::new(links))
    }

    /// A node of which something is animated.
    fn moving(&self, number: Index<json::Node>, node: &json::Node) -> Fallible<Option<Link>> {
        let translation = self.track::<3>(number, Property::Translation)?;
        let rotation = self.track::<4>(number, Property::Rotation)?;
        let scale = self.track::<3>(number, Property::Scale)?;
        let is_still = translation.is_none() && rotation.is_none() && scale.is_none();
        if is_still || node.matrix.is_some() {
            return Ok(None);
        }
        let at_rest = |value: Option<[f32; 3]>, default| {
            Track::constant(value.map_or(default, |value| value.map(f64::from)))
        };
        let turned = node.rotation.unwrap_or_default().0.map(f64::from);
        Ok(Some(Link::Moving {
            translation: translation.unwrap_or_else(|| at_rest(node.translation, [0.0; 3])),
            rotation: rotation.unwrap_or_else(|| Track::constant(turned)),
            scale: scale.unwrap_or_else(|| at_rest(node.scale, [1.0; 3])),
        }))
    }

    /// The keys of one property of a node, if it is animated.
    fn track<const N: usize>(
        &self,
        node: Index<json::Node>,
        property: Property,
    ) -> Fallible<Option<Track<N>>> {
        let target = (node.value() as u32, property as u8);
        let Some(keys) = self.samplers.get(&target) else { return Ok(None) };
        let interpolation = match keys.interpolation {
            Checked::Valid(Written::Linear) => Interpolation::Linear,
            Checked::Valid(Written::Step) => Interpolation::Step,
            Checked::Valid(Written::CubicSpline) => Interpolation::Cubic,
            Checked::Invalid => return Err("its interpolation is unknown to glTF 2.0".into()),
        };
        let times = Elements::open(self.file, keys.times, &[Type::Scalar])?;
        let values = Elements::open(self.file, keys.values, &[Type::Vec3, Type::Vec4])?;
        let times = (0..times.count).map(|key| times.floats::<1>(key)[0].into()).collect();
        let values = (0..values.count).map(|key| values.floats::<N>(key).map(f64::from)).collect();
        let track = Track::new(times, values, interpolation);
        track.map(Some).ok_or_else(|| "its keys do not rise or have no values".into())
    }
}
