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
    samplers: BTreeMap<(u32, u8), Sampler>,
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
                    let bare = || Sampler { extras: None, extensions: None, ..sampler.clone() };
                    samplers.entry(target).or_insert_with(bare);
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
        let target = |property: Property| (number.value() as u32, property as u8);
        let [translation, rotation, scale] =
            [Property::Translation, Property::Rotation, Property::Scale].map(target);
        if ![translation, rotation, scale].iter().any(|it| self.samplers.contains_key(it)) {
            return Ok(None);
        }
        let link = Link::Moving {
            translation: self.track(translation, node.translation.unwrap_or([0.0; 3]))?,
            rotation: self.track(rotation, node.rotation.unwrap_or_default().0)?,
            scale: self.track(scale, node.scale.unwrap_or([1.0; 3]))?,
        };
        Ok(Some(link).filter(|_| node.matrix.is_none()))
    }

    /// The keys of one property of a node, which is `at_rest` if it is not animated.
    fn track<const N: usize>(&self, target: (u32, u8), at_rest: [f32; N]) -> Fallible<Track<N>> {
        let Some(keys) = self.samplers.get(&target) else {
            return Ok(Track::constant(at_rest.map(f64::from)));
        };
        let interpolation = match keys.interpolation {
            Checked::Valid(Written::Linear) => Interpolation::Linear,
            Checked::Valid(Written::Step) => Interpolation::Step,
            Checked::Valid(Written::CubicSpline) => Interpolation::Cubic,
            Checked::Invalid => return Err("its interpolation is unknown to glTF 2.0".into()),
        };
        let times = Elements::open(self.file, keys.input, &[Type::Scalar])?;
        let values = Elements::open(self.file, keys.output, &[Type::Vec3, Type::Vec4])?;
        let times = (0..times.count).map(|key| times.floats::<1>(key)[0].into()).collect();
        let values = (0..values.count).map(|key| values.floats::<N>(key).map(f64::from)).collect();
        let track = Track::new(times, values, interpolation);
        track.ok_or_else(|| "its keys do not rise or have no values".into())
    }
}
