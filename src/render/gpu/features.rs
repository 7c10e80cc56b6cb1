//! What the kernels of a picture are built with, by who decides it: scene, view or kernel. What follows
//! from these is a function. A shader's `//#if NAME` asks for any of them.

use super::super::filter::PixelFilter;
use super::super::{Gi, Sampling, View};
use super::kernel::Kernel;
use crate::environment::Environment;
use crate::error::{Error, Result};
use crate::light_grid::Recording;
use crate::path::{Background, World};
use crate::sampler::Points;
use crate::scene::needs::{SceneFeatures, flags_by_name};

bitflags::bitflags! {
    /// What a view, its map and its lights ask for.
    #[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
    pub(crate) struct ViewFeatures: u32 {
        /// The camera sees the map blurred.
        const BACKGROUND_BLUR = 1 << 0;
        /// The camera sees a colour in place of the map.
        const BACKGROUND_COLOR = 1 << 1;
        /// Albedo, normal and depth are kept.
        const LAYERS = 1 << 2;
        /// A lens that is no pinhole.
        const LENS = 1 << 3;
        /// Something scatters between surfaces or in solids.
        const MEDIUM = 1 << 4;
        /// Paths end in the radiance cache, or train it.
        const RADIANCE_CACHE = 1 << 5;
        /// A pixel filter wider than a box.
        const WIDE_FILTER = 1 << 6;
        /// Lights to be sampled that are not the map.
        const LOCAL_LIGHTS = 1 << 7;
        /// A map that is not black.
        const MAP = 1 << 8;
        /// The map is sampled.
        const MAP_SAMPLING = 1 << 9;
        /// Tiles are chosen by the cell.
        const LIGHT_GRID = 1 << 10;
        /// Cells tell which way a surface faces.
        const FACES = 1 << 11;
        /// It is counted what samples of the map see.
        const COUNTING = 1 << 12;
        /// Counters hold a share of what was tried.
        const RECORD_RATIO = 1 << 13;
        /// The share is weighted by the cosine.
        const RECORD_COSINE = 1 << 14;
        /// Paths aim at surfaces.
        const AIMING = 1 << 15;
    }
}

bitflags::bitflags! {
    /// What the device and the kernel decide.
    #[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
    pub(crate) struct KernelFeatures: u32 {
        /// Paths end in the radiance cache.
        const CACHED = 1 << 0;
        /// A walk's stack does not fit into workgroup memory.
        const DEEP_TREE = 1 << 1;
        /// Second vertices are found for a tile.
        const FINDING = 1 << 2;
        /// The device finds what rays hit.
        const HARDWARE_RAYS = 1 << 3;
        /// Paths are traced to learn from.
        const LEARNING = 1 << 4;
        /// Second vertices are shared.
        const SHARING = 1 << 5;
        /// Paths train the radiance cache.
        const TRAINING = 1 << 6;
        /// The device may fuse products with sums.
        const FUSING = 1 << 7;
    }
}

/// All that a kernel is built with: what it does without is not compiled.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(crate) struct Features {
    pub(crate) scene: SceneFeatures,
    pub(crate) view: ViewFeatures,
    pub(crate) kernel: KernelFeatures,
}

/// Features of scenes that kernels ask for by what follows from them alone.
const NOT_ASKED_FOR: [&str; 7] = [
    "ABSORPTION",
    "ALPHA_BLEND",
    "FOG",
    "POLISH",
    "ROUGH_GLASS",
    "SCATTERING_SOLIDS",
    "THIN_TRANSMISSION",
];

/// Refuses what is only measured, and has no kernels.
///
/// # Errors
/// If the view asks for it.
pub(super) fn check(view: &View) -> Result<()> {
    let recording = view.distribution_options().map(|options| options.recording);
    let what = match (view.points, recording) {
        (Points::Independent, _) => "independent points are",
        (_, Some(Recording::VisibleCosineSquared)) => "learning by the squared cosine is",
        _ => return Ok(()),
    };
    Err(Error::new(format!("{what} for the CPU alone")))
}

/// What can be asked of features.
pub(super) type Condition = fn(&Features) -> bool;

/// What follows from the others, by name.
const DERIVED: [(&str, Condition); 14] = {
    use {SceneFeatures as S, ViewFeatures as V};
    [
        // Triangles are chosen as lamps are.
        ("AREA_SOURCES", Features::area_sources),
        // Some hits of closest-hit rays do not count.
        ("FILTERED_HITS", |f| f.scene.intersects(S::ALPHA_MASK | S::SINGLE_SIDED)),
        ("FILTERED_OR_PASSED", Features::filtered_or_passed),
        // Surfaces that take a part of the light of a ray.
        ("PARTIAL", |f| f.scene.intersects(S::ALPHA_BLEND | S::THIN_TRANSMISSION)),
        ("PASS_THROUGH", Features::pass_through),
        ("SCENE_LIGHTS", Features::scene_lights),
        // Shadow rays lose light on their way.
        ("SHADOW_MEDIA", |f| f.view.contains(V::MEDIUM) || f.scene.contains(S::SOLID_TRANSMISSION)),
        ("SHADOW_RAYS", Features::shadow_rays),
        ("SOFTWARE_WALK", Features::software_walk),
        // Narrow lobes are followed apart from broad ones, which are shared or cached.
        ("SPLIT_LOBES", |f| {
            let uses = KernelFeatures::SHARING | KernelFeatures::CACHED | KernelFeatures::TRAINING;
            f.scene.contains(S::POLISH) && f.kernel.intersects(uses)
        }),
        // Glass that spreads what it lets through.
        ("SPREADING_GLASS", |f| f.scene.contains(S::ROUGH_GLASS) && f.transmission()),
        ("TANGENTS", Features::tangents),
        ("TRANSMISSION", Features::transmission),
        // Textures that few materials have.
        ("UNCOMMON_TEXTURES", |f| {
            f.scene.intersects(S::ANISOTROPY | S::DIFFUSE_TRANSMISSION | S::IRIDESCENCE | S::SHEEN)
        }),
    ]
};

impl Features {
    /// What a scene needs: its materials and lights.
    pub(crate) fn of_world(world: &World) -> Self {
        let mut scene = world.needs.features;
        if world.scene.tangents.is_empty() {
            scene.remove(SceneFeatures::NORMAL_MAPS);
        }
        let mut view = ViewFeatures::empty();
        view.set(ViewFeatures::LOCAL_LIGHTS, !world.lights.is_empty());
        Self { scene, view, kernel: KernelFeatures::empty() }
    }

    /// What a picture needs: the scene's materials and lights, the map, how it is sampled.
    pub(crate) fn of(world: &World, environment: &Environment, view: &View) -> Self {
        let samples_map = view.sampling != Sampling::Bsdf && !environment.is_black();
        let options = view.distribution_options();
        let recording = options.map(|options| options.recording);
        let has_scattering_solids = world.needs.has(SceneFeatures::SCATTERING_SOLIDS);
        let mut features = Self::of_world(world);
        for (feature, is_needed) in [
            (ViewFeatures::BACKGROUND_BLUR, matches!(view.background, Background::Blurred(_))),
            (
                ViewFeatures::BACKGROUND_COLOR,
                matches!(view.background, Background::Color(_) | Background::None),
            ),
            (ViewFeatures::COUNTING, samples_map && options.is_some_and(|o| o.goes_on())),
            (ViewFeatures::FACES, options.is_some_and(|options| options.faces)),
            (ViewFeatures::LAYERS, view.layers),
            (ViewFeatures::LENS, view.camera.lens_radius > 0.0),
            (ViewFeatures::LIGHT_GRID, samples_map && recording.is_some()),
            (ViewFeatures::MAP, !environment.is_black()),
            (ViewFeatures::MAP_SAMPLING, samples_map),
            (ViewFeatures::MEDIUM, has_scattering_solids || view.fog(world).is_some()),
            (ViewFeatures::RADIANCE_CACHE, view.gi == Gi::Cached),
            (
                ViewFeatures::RECORD_COSINE,
                recording.is_some_and(|recording| recording.cosine_power() == 1),
            ),
            (ViewFeatures::RECORD_RATIO, recording.is_some_and(Recording::is_ratio)),
            (ViewFeatures::WIDE_FILTER, view.filter != PixelFilter::Box),
        ] {
            features.view.set(feature, is_needed);
        }
        features
    }

    /// What the picture of a scene needs with a map that is not black and the defaults of `render`.
    pub(crate) fn by_default(world: &World) -> Self {
        let mut features = Self::of_world(world);
        features.view |= ViewFeatures::COUNTING
            | ViewFeatures::FACES
            | ViewFeatures::LIGHT_GRID
            | ViewFeatures::MAP
            | ViewFeatures::MAP_SAMPLING
            | ViewFeatures::RECORD_COSINE
            | ViewFeatures::RECORD_RATIO
            | ViewFeatures::WIDE_FILTER;
        let scattering = SceneFeatures::SCATTERING_SOLIDS | SceneFeatures::FOG;
        features.view.set(ViewFeatures::MEDIUM, features.scene.intersects(scattering));
        features
    }

    /// Everything that a kernel asks for at once. How deep the tree is, its stack's size says.
    pub(crate) fn most() -> Self {
        let view = ViewFeatures::all() - ViewFeatures::RADIANCE_CACHE;
        Self { scene: SceneFeatures::all(), view, kernel: KernelFeatures::empty() }
    }

    /// The same for a kernel, whose walks' stacks may not fit into workgroup memory.
    pub(super) fn in_kernel(mut self, kernel: Kernel, is_deep: bool) -> Self {
        let is_cached = self.view.contains(ViewFeatures::RADIANCE_CACHE);
        for (feature, is_needed) in [
            (KernelFeatures::CACHED, kernel == Kernel::Render && is_cached),
            (KernelFeatures::DEEP_TREE, is_deep),
            (KernelFeatures::FINDING, kernel == Kernel::FindSeconds),
            (KernelFeatures::LEARNING, kernel == Kernel::Learn),
            (KernelFeatures::SHARING, kernel.shares()),
            (KernelFeatures::TRAINING, kernel == Kernel::Train),
        ] {
            self.kernel.set(feature, is_needed);
        }
        if kernel.begins_anywhere() {
            self.view -= ViewFeatures::LAYERS;
            self.view.set(ViewFeatures::COUNTING, kernel == Kernel::Learn);
        } else if kernel.casts() {
            self.view -= ViewFeatures::COUNTING | ViewFeatures::LAYERS;
        } else if kernel == Kernel::LightSeconds {
            // Only first vertices are shown.
            self.view -= ViewFeatures::LAYERS;
        }
        if !self.kernel.intersects(KernelFeatures::CACHED | KernelFeatures::TRAINING) {
            self.view -= ViewFeatures::RADIANCE_CACHE;
        }
        self
    }

    /// Each feature by the name that shaders ask for, and whether it is on.
    pub(super) fn by_name(self) -> impl Iterator<Item = (&'static str, bool)> {
        flags_by_name(self.scene)
            .chain(flags_by_name(self.view))
            .chain(flags_by_name(self.kernel))
            .chain(DERIVED.iter().map(move |(name, is_on)| (*name, is_on(&self))))
    }

    /// Names of those that are on and that kernels ask for.
    pub(super) fn names(self) -> impl Iterator<Item = &'static str> {
        let is_asked_for = |name: &&str| !NOT_ASKED_FOR.contains(name);
        self.by_name().filter(|(_, is_on)| *is_on).map(|(name, _)| name).filter(is_asked_for)
    }

    /// Some hits of closest-hit rays do not count, or rays pass them.
    pub(super) fn filtered_or_passed(&self) -> bool {
        self.scene.contains(SceneFeatures::SINGLE_SIDED) || self.pass_through()
    }

    /// A ray may pass a surface without being scattered, or glass whose refraction is followed later.
    fn pass_through(&self) -> bool {
        self.scene.contains(SceneFeatures::CLEAR_SOLIDS) || self.scene.pass_through()
    }

    /// Lights that are not the map, or what is chosen like them.
    pub(super) fn scene_lights(&self) -> bool {
        self.area_sources() || self.scene.contains(SceneFeatures::PUNCTUAL_LIGHTS)
    }

    /// Triangles are chosen as lamps are: emissive ones or what paths aim at.
    pub(super) fn area_sources(&self) -> bool {
        self.scene.contains(SceneFeatures::EMITTERS) || self.view.contains(ViewFeatures::AIMING)
    }

    /// There are shadow rays.
    pub(super) fn shadow_rays(&self) -> bool {
        self.view.intersects(ViewFeatures::MAP_SAMPLING | ViewFeatures::LOCAL_LIGHTS)
    }

    /// A kernel walks the tree.
    pub(super) fn software_walk(&self) -> bool {
        !self.kernel.contains(KernelFeatures::HARDWARE_RAYS)
    }

    /// Microfacets of some surface scatter light more than once.
    pub(super) fn rescatters(&self) -> bool {
        self.scene.intersects(SceneFeatures::ROUGH_METALS | SceneFeatures::ROUGH_GLASS)
    }

    /// Tangents of vertices.
    pub(super) fn tangents(&self) -> bool {
        self.scene.intersects(SceneFeatures::ANISOTROPY | SceneFeatures::NORMAL_MAPS)
    }

    /// Light that comes through undiffused.
    pub(super) fn transmission(&self) -> bool {
        self.scene.intersects(SceneFeatures::THIN_TRANSMISSION | SceneFeatures::SOLID_TRANSMISSION)
    }
}
