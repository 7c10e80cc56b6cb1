//! What the kernels of a picture are built with.

use super::super::filter::PixelFilter;
use super::super::{Gi, Sampling, View};
use super::kernel::Kernel;
use super::shader::Constants;
use crate::environment::{Environment, TableKind};
use crate::features::Features;
use crate::light_grid::Recording;
use crate::path::{Background, World};
use crate::sampler::Points;

/// What follows from any of some others.
const FOLLOWS: [(Features, Features); 9] = [
    (Features::FILTERED_HITS, Features::ALPHA_MASK.union(Features::SINGLE_SIDED)),
    (
        Features::FILTERED_OR_PASSED,
        Features::ALPHA_MASK.union(Features::PARTIAL).union(Features::SINGLE_SIDED),
    ),
    (Features::PASS_THROUGH, Features::ALPHA_MASK.union(Features::PARTIAL)),
    (Features::SCENE_LIGHTS, Features::EMITTERS.union(Features::PUNCTUAL_LIGHTS)),
    (Features::SHADOW_MEDIA, Features::MEDIUM.union(Features::SOLID_TRANSMISSION)),
    (Features::SHADOW_RAYS, Features::MAP_SAMPLING.union(Features::LOCAL_LIGHTS)),
    (Features::SUMMED_AREA, Features::TABLES),
    (Features::TANGENTS, Features::ANISOTROPY.union(Features::NORMAL_MAPS)),
    (
        Features::UNCOMMON_TEXTURES,
        Features::ANISOTROPY
            .union(Features::DIFFUSE_TRANSMISSION)
            .union(Features::IRIDESCENCE)
            .union(Features::SHEEN),
    ),
];

impl Features {
    /// Tables that are not the default.
    pub(super) const TABLES: Self = Self::TABLE_F32.union(Self::TABLE_F64).union(Self::TABLE_U32);

    /// What scenes need that kernels do not ask for by that name.
    pub(super) const NOT_ASKED_FOR: Self = Self::ABSORPTION
        .union(Self::ALPHA_BLEND)
        .union(Self::FOG)
        .union(Self::SCATTERING_SOLIDS)
        .union(Self::THIN_TRANSMISSION);

    /// What the device and the kernel decide, not the picture.
    pub(super) const OF_KERNEL: Self = Self::CACHED
        .union(Self::DEEP_TREE)
        .union(Self::FINDING)
        .union(Self::HARDWARE_RAYS)
        .union(Self::LEARNING)
        .union(Self::SHARING)
        .union(Self::TRAINING);

    /// What follows from others.
    #[cfg(test)]
    pub(super) fn following() -> Self {
        FOLLOWS.iter().fold(Self::SOFTWARE_WALK, |all, (feature, _)| all | *feature)
    }

    /// What a scene needs: its materials and lights.
    pub(crate) fn of_world(world: &World) -> Self {
        let needs = &world.needs;
        let mut features = needs.features.difference(Self::NOT_ASKED_FOR);
        let partial = Self::ALPHA_BLEND | Self::THIN_TRANSMISSION;
        let transmits = Self::THIN_TRANSMISSION | Self::SOLID_TRANSMISSION;
        features.set(Self::LOCAL_LIGHTS, !world.lights.is_empty());
        features.set(Self::PARTIAL, needs.features.intersects(partial));
        features.set(Self::TRANSMISSION, needs.features.intersects(transmits));
        if world.scene.tangents.is_empty() {
            features.remove(Self::NORMAL_MAPS);
        }
        features.completed()
    }

    /// What a picture needs: the scene's materials and lights, the map, how it is sampled.
    pub(crate) fn of(world: &World, environment: &Environment, view: &View) -> Self {
        let samples_map = view.sampling != Sampling::Bsdf && !environment.is_black();
        let options = view.distribution_options();
        let recording = options.map(|options| options.recording);
        let cosine_power = recording.map_or(0, Recording::cosine_power);
        let table = environment.table_kind();
        let scatters = world.needs.has(Self::SCATTERING_SOLIDS) || view.fog(world).is_some();
        let mut features = Self::of_world(world);
        for (feature, is_needed) in [
            (Self::BACKGROUND_BLUR, matches!(view.background, Background::Blurred(_))),
            (Self::BACKGROUND_COLOR, matches!(view.background, Background::Color(_))),
            (Self::COUNTING, samples_map && options.is_some_and(|options| options.goes_on())),
            (Self::FACES, options.is_some_and(|options| options.faces)),
            (Self::INDEPENDENT_POINTS, view.points == Points::Independent),
            (Self::LAYERS, view.layers),
            (Self::LENS, view.camera.lens_radius > 0.0),
            (Self::LIGHT_GRID, samples_map && recording.is_some()),
            (Self::MAP, !environment.is_black()),
            (Self::MAP_SAMPLING, samples_map),
            (Self::MEDIUM, scatters),
            (Self::RADIANCE_CACHE, view.gi == Gi::Cached),
            (Self::RECORD_COSINE, cosine_power == 1),
            (Self::RECORD_RATIO, recording.is_some_and(Recording::is_ratio)),
            (Self::RECORD_SQUARED_COSINE, cosine_power == 2),
            (Self::TABLE_F32, table == TableKind::F32),
            (Self::TABLE_F64, table == TableKind::F64),
            (Self::TABLE_U32, table == TableKind::U32),
            (Self::WIDE_FILTER, view.filter != PixelFilter::Box),
        ] {
            features |= feature.only_if(is_needed);
        }
        features.completed()
    }

    /// What the picture of a scene needs with a map that is not black and the defaults of `render`.
    pub(crate) fn by_default(world: &World) -> Self {
        let of_view = Self::COUNTING
            | Self::FACES
            | Self::LIGHT_GRID
            | Self::MAP
            | Self::MAP_SAMPLING
            | Self::RECORD_COSINE
            | Self::RECORD_RATIO
            | Self::WIDE_FILTER;
        let scatters = world.needs.features.intersects(Self::SCATTERING_SOLIDS | Self::FOG);
        (Self::of_world(world) | of_view | Self::MEDIUM.only_if(scatters)).completed()
    }

    /// Everything that a kernel asks for at once, with the table that is used by default. How deep the
    /// tree is, its stack's size says.
    pub(crate) fn most() -> Self {
        let others = Self::NOT_ASKED_FOR | Self::OF_KERNEL | Self::TABLES;
        let features = Self::all() - others - Self::RADIANCE_CACHE - Self::SUMMED_AREA;
        features.completed()
    }

    /// Together with what follows from these.
    pub(crate) fn completed(mut self) -> Self {
        for (feature, causes) in FOLLOWS {
            self |= feature.only_if(self.intersects(causes));
        }
        self | Self::SOFTWARE_WALK.only_if(!self.contains(Self::HARDWARE_RAYS))
    }

    /// The same for a device whose own ray queries find what rays hit.
    pub(crate) fn with_hardware_rays(self) -> Self {
        (self - Self::SOFTWARE_WALK) | Self::HARDWARE_RAYS
    }

    /// The same for a kernel with these constants.
    pub(super) fn in_kernel(self, kernel: Kernel, constants: &Constants) -> Self {
        let mut features = self;
        let is_deep = constants.stack_size > constants.shared_stack_size;
        features |= Self::DEEP_TREE.only_if(is_deep);
        if kernel.begins_anywhere() {
            features -= Self::LAYERS | Self::INDEPENDENT_POINTS;
        } else if kernel.casts() {
            features -= Self::COUNTING | Self::LAYERS;
        } else if kernel.shares() {
            features |= Self::SHARING;
        }
        match kernel {
            Kernel::Learn => features |= Self::COUNTING | Self::LEARNING,
            Kernel::Train => features = (features - Self::COUNTING) | Self::TRAINING,
            Kernel::FindSeconds => features |= Self::FINDING,
            // Only first vertices are shown.
            Kernel::LightSeconds => features -= Self::LAYERS,
            Kernel::Render => {
                features |= Self::CACHED.only_if(features.contains(Self::RADIANCE_CACHE));
            }
            _ => {}
        }
        if !features.intersects(Self::CACHED | Self::TRAINING) {
            features -= Self::RADIANCE_CACHE;
        }
        features
    }
}
