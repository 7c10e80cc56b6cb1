//! The shaders' source: files, lines and bindings that a scene does not need are left out.
//!
//! A line `//#if NAME` keeps what follows, up to `//#else` or `//#end`, only if the feature is on.

use std::collections::BTreeSet;
use std::fmt::Write as _;

use serde::Serialize;

use super::super::filter::PixelFilter;
use super::super::{Gi, Sampling, View};
use crate::environment::{Environment, Lookup, TableKind};
use crate::light_grid::Recording;
use crate::path::sharing::SharedTile;
use crate::path::{Background, TEACHERS, World};
use crate::radiance_cache;
use crate::sampler::Points;

/// Entry points.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Kernel {
    /// Adds samples to pixels.
    Render,
    /// Traces learning paths.
    Learn,
    /// Traces paths that teach the radiance cache.
    Teach,
    /// Finds the nearest hits of rays, for measurements.
    ClosestHits,
    /// Finds how much light comes along rays, for measurements.
    ShadowRays,
    /// Adds samples to pixels, with the two that follow: finds what rays of paths hit.
    Trace,
    /// Finds what becomes of paths there.
    Shade,
    /// Follows their rays towards lights.
    FollowShadows,
    /// Adds samples to pixels that share, with the two that follow: finds second vertices.
    FindSeconds,
    /// Estimates what arrives there.
    LightSeconds,
    /// Gathers light at the first vertices.
    ConnectSeconds,
}

impl Kernel {
    /// Name of the entry point.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Render => "render",
            Self::Learn => "learn",
            Self::Teach => "teach",
            Self::ClosestHits => "closest_hits",
            Self::ShadowRays => "shadow_rays",
            Self::Trace => "trace",
            Self::Shade => "shade",
            Self::FollowShadows => "follow_shadows",
            Self::FindSeconds => "find_seconds",
            Self::LightSeconds => "light_seconds",
            Self::ConnectSeconds => "connect_seconds",
        }
    }

    /// Number of kernels.
    pub(crate) const COUNT: usize = 11;

    /// Those that bring all paths one ray further, in order.
    pub(crate) const OF_QUEUE: [Self; 3] = [Self::Trace, Self::Shade, Self::FollowShadows];

    /// Those that add one sample to every pixel, in order.
    pub(crate) const OF_SHARING: [Self; 3] =
        [Self::FindSeconds, Self::LightSeconds, Self::ConnectSeconds];

    /// Whether it traces rays that the host made, not paths.
    fn casts(self) -> bool {
        matches!(self, Self::ClosestHits | Self::ShadowRays)
    }

    /// Whether it adds finished paths to the film.
    fn adds_samples(self) -> bool {
        matches!(self, Self::Render | Self::Trace | Self::ConnectSeconds)
    }

    /// Whether it begins samples.
    fn begins_samples(self) -> bool {
        self.adds_samples() || self == Self::FindSeconds
    }

    /// Whether its paths are not those of pixels.
    fn begins_anywhere(self) -> bool {
        matches!(self, Self::Learn | Self::Teach)
    }

    /// Whether its pixels share second vertices.
    fn shares(self) -> bool {
        Self::OF_SHARING.contains(&self)
    }

    /// Whether its paths lie in slots.
    fn is_of_queue(self) -> bool {
        Self::OF_QUEUE.contains(&self)
    }
}

/// What a shader is built with, by name.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub(crate) struct Features(BTreeSet<&'static str>);

impl Features {
    /// All names a shader asks for.
    pub(crate) const ALL: [&'static str; 58] = [
        "albedo",
        "alpha_mask",
        "anisotropy",
        "background_blur",
        "background_color",
        "cached",
        "clearcoat",
        "counting",
        "deep_tree",
        "diffuse_transmission",
        "dispersion",
        "emitters",
        "faces",
        "filtered_hits",
        "filtered_or_passed",
        "finding",
        "hardware_rays",
        "independent_points",
        "iridescence",
        "learning",
        "layers",
        "lens",
        "light_grid",
        "local_lights",
        "map",
        "map_sampling",
        "medium",
        "metals",
        "nearest_lookup",
        "normal_maps",
        "partial",
        "pass_through",
        "punctual_lights",
        "radiance_cache",
        "record_cosine",
        "record_ratio",
        "record_squared_cosine",
        "scene_lights",
        "second_uv_set",
        "shadow_media",
        "shadow_rays",
        "sharing",
        "sheen",
        "single_sided",
        "software_walk",
        "solid_transmission",
        "summed_area",
        "table_f32",
        "table_f64",
        "table_u32",
        "tangents",
        "teaching",
        "textures",
        "transmission",
        "uncommon_textures",
        "unlit",
        "vertex_colors",
        "wide_filter",
    ];

    /// What a scene needs: its materials and lights.
    pub(crate) fn of_world(world: &World) -> Self {
        let needs = &world.needs;
        Self::from_names([
            ("alpha_mask", needs.alpha_mask),
            ("anisotropy", needs.anisotropy),
            ("clearcoat", needs.clearcoat),
            ("diffuse_transmission", needs.diffuse_transmission),
            ("dispersion", needs.dispersion),
            ("emitters", needs.emitters),
            ("iridescence", needs.iridescence),
            ("local_lights", !world.lights.is_empty()),
            ("metals", needs.metals),
            ("normal_maps", needs.normal_maps && !world.scene.tangents.is_empty()),
            ("partial", needs.alpha_blend || needs.thin_transmission),
            ("punctual_lights", needs.punctual_lights),
            ("second_uv_set", needs.second_uv_set),
            ("sheen", needs.sheen),
            ("single_sided", needs.single_sided),
            ("solid_transmission", needs.solid_transmission),
            ("textures", needs.textures),
            ("transmission", needs.thin_transmission || needs.solid_transmission),
            ("unlit", needs.unlit),
            ("vertex_colors", needs.vertex_colors),
        ])
    }

    /// What a picture needs: the scene's materials and lights, the map, how it is sampled.
    pub(crate) fn of(world: &World, environment: &Environment, view: &View) -> Self {
        let samples_map = view.sampling != Sampling::Bsdf && !environment.is_black();
        let recording = view.law_options().map(|laws| laws.recording);
        let cosine_power = recording.map_or(0, Recording::cosine_power);
        let options = environment.kind();
        let of_view = [
            ("background_blur", matches!(view.background, Background::Blurred(_))),
            ("background_color", matches!(view.background, Background::Color(_))),
            ("counting", samples_map && view.law_options().is_some_and(|laws| laws.goes_on())),
            ("faces", view.law_options().is_some_and(|laws| laws.faces)),
            ("independent_points", view.points == Points::Independent),
            ("layers", view.layers),
            ("lens", view.camera.lens_radius > 0.0),
            ("light_grid", samples_map && recording.is_some()),
            ("map", !environment.is_black()),
            ("map_sampling", samples_map),
            ("medium", world.needs.scattering_solids || view.fog(world).is_some()),
            ("nearest_lookup", options.1 == Lookup::Nearest),
            ("radiance_cache", view.gi == Gi::Cached),
            ("record_cosine", cosine_power == 1),
            ("record_ratio", recording.is_some_and(Recording::is_ratio)),
            ("record_squared_cosine", cosine_power == 2),
            ("table_f32", options.0 == TableKind::F32),
            ("table_f64", options.0 == TableKind::F64),
            ("table_u32", options.0 == TableKind::U32),
            ("wide_filter", view.filter != PixelFilter::Box),
        ];
        Self::from_names(Self::of_world(world).0.into_iter().map(|n| (n, true)).chain(of_view))
    }

    /// Every feature at once, with the table that is used by default. How deep the tree is, its
    /// stack's size says.
    pub(crate) fn most() -> Self {
        let names = Self::ALL.into_iter().filter(|n| !n.starts_with("table_"));
        let others = [
            "cached",
            "deep_tree",
            "finding",
            "hardware_rays",
            "learning",
            "radiance_cache",
            "sharing",
            "summed_area",
            "teaching",
        ];
        Self::from_names(names.filter(|n| !others.contains(n)).map(|n| (n, true)))
    }

    /// Features by name, and those that follow from them.
    pub(crate) fn from_names(names: impl IntoIterator<Item = (&'static str, bool)>) -> Self {
        let mut set: BTreeSet<_> =
            names.into_iter().filter(|(_, on)| *on).map(|(n, _)| n).collect();
        let follows: [(&str, &[&str]); 10] = [
            ("albedo", &["layers", "radiance_cache"]),
            ("filtered_hits", &["alpha_mask", "single_sided"]),
            ("filtered_or_passed", &["alpha_mask", "partial", "single_sided"]),
            ("pass_through", &["alpha_mask", "partial"]),
            ("scene_lights", &["emitters", "punctual_lights"]),
            ("shadow_media", &["medium", "solid_transmission"]),
            ("shadow_rays", &["map_sampling", "local_lights"]),
            ("summed_area", &["table_f32", "table_f64", "table_u32"]),
            ("tangents", &["anisotropy", "normal_maps"]),
            ("uncommon_textures", &["anisotropy", "diffuse_transmission", "iridescence", "sheen"]),
        ];
        for (name, causes) in follows {
            if causes.iter().any(|cause| set.contains(cause)) {
                set.insert(name);
            }
        }
        if !set.contains("hardware_rays") {
            set.insert("software_walk");
        }
        Self(set)
    }

    /// The same for a device whose own ray queries find what rays hit.
    pub(crate) fn with_hardware_rays(mut self) -> Self {
        self.0.remove("software_walk");
        self.0.insert("hardware_rays");
        self
    }

    /// The same for a kernel with these constants.
    fn in_kernel(&self, kernel: Kernel, constants: &Constants) -> Self {
        let mut set = self.0.clone();
        if constants.stack_size > constants.shared_stack_size {
            set.insert("deep_tree");
        }
        if kernel.begins_anywhere() {
            set.remove("layers");
            set.remove("independent_points");
        } else if kernel.casts() {
            set.remove("counting");
            set.remove("layers");
        } else if kernel.shares() {
            set.insert("sharing");
        }
        match kernel {
            Kernel::Learn => set.extend(["counting", "learning"]),
            Kernel::Teach => {
                set.remove("counting");
                set.insert("teaching");
            }
            Kernel::FindSeconds => set.extend(["finding"]),
            // Only first vertices are shown.
            Kernel::LightSeconds => {
                set.remove("layers");
            }
            Kernel::Render if set.contains("radiance_cache") => set.extend(["cached"]),
            _ => {}
        }
        if !(set.contains("cached") || set.contains("teaching")) {
            set.remove("radiance_cache");
        }
        if set.contains("layers") || set.contains("radiance_cache") {
            set.insert("albedo");
        } else {
            set.remove("albedo");
        }
        Self(set)
    }

    /// Whether a feature is on.
    pub(crate) fn has(&self, name: &str) -> bool {
        debug_assert!(Self::ALL.contains(&name), "{name} is no feature");
        self.0.contains(name)
    }

    /// Whether shading takes so many registers that walks in the same kernel run in half of the waves
    /// that would otherwise fit, or in less.
    pub(crate) fn shading_is_large(&self) -> bool {
        // What features add to the registers, roughly, in steps of 8 to 12. Compiled by RADV for RDNA2,
        // kernels of 6 steps or more took over 168 and ran in 4 waves, others in 6 or 8.
        let weights = [
            ("diffuse_transmission", 1),
            ("dispersion", 1),
            ("iridescence", 2),
            ("layers", 1),
            ("partial", 1),
            ("sheen", 1),
        ];
        let pairs = [("local_lights", "map_sampling", 1), ("medium", "solid_transmission", 2)];
        let alone = weights.iter().filter(|(name, _)| self.has(name)).map(|(_, weight)| weight);
        let both = pairs.iter().filter(|(a, b, _)| self.has(a) && self.has(b));
        alone.sum::<u32>() + both.map(|(.., weight)| weight).sum::<u32>() >= 6
    }

    /// Names of the features that are on.
    pub(crate) fn names(&self) -> impl Iterator<Item = &'static str> {
        self.0.iter().copied()
    }
}

/// What the render kernel of a picture holds and what was left out of it.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct KernelFacts {
    /// Features it was built with.
    pub features: Vec<&'static str>,
    /// Features it does without.
    pub left_out: Vec<&'static str>,
    /// Bytes of its source.
    pub source_bytes: usize,
    /// Bytes of the source with every feature.
    pub full_source_bytes: usize,
    /// Bytes of a vertex on the device.
    pub vertex_bytes: u32,
    /// Bytes of a vertex with everything a scene can have.
    pub full_vertex_bytes: u32,
}

impl KernelFacts {
    /// Of the kernel for these features.
    pub(crate) fn of(features: &Features) -> Self {
        let bytes_of = |features: &Features| {
            let vertex = VertexTexels::of(features);
            let constants = Constants { vertex, ..Constants::default() };
            let places = ArrayPlaces::default();
            let program = Program::new(Kernel::Render, features, &constants, &places);
            (program.source.len(), 16 * vertex.count)
        };
        let (source_bytes, vertex_bytes) = bytes_of(features);
        let (full_source_bytes, full_vertex_bytes) = bytes_of(&Features::most());
        let most = Features::most();
        Self {
            features: features.names().collect(),
            left_out: most.names().filter(|name| !features.0.contains(name)).collect(),
            source_bytes,
            full_source_bytes,
            vertex_bytes,
            full_vertex_bytes,
        }
    }

    /// Of the kernel for a scene with a map that is not black, with the defaults of `render`.
    pub fn of_scene(world: &World) -> Self {
        let defaults = [
            "counting",
            "faces",
            "light_grid",
            "map",
            "map_sampling",
            "record_cosine",
            "record_ratio",
            "wide_filter",
        ];
        let names = Features::of_world(world).0.into_iter().chain(defaults);
        Self::of(&Features::from_names(names.map(|name| (name, true))))
    }
}

/// Numbers of a shader that are known when it is built.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(crate) struct Constants {
    /// Groups of nodes the traversal may have to remember, and how many of them in workgroup memory.
    pub(crate) stack_size: u32,
    pub(crate) shared_stack_size: u32,
    /// Texels of a vertex, and which of them hold what only some scenes need.
    pub(crate) vertex: VertexTexels,
    /// Bit `i`: some material has the `i`-th of the textures a material can have.
    pub(crate) textures_in_scene: u32,
    /// Texels of `tables` at which each begins.
    pub(crate) albedo_at: u32,
    pub(crate) sheen_at: u32,
    pub(crate) filter_at: u32,
    pub(crate) rows_at: u32,
    /// How pixels share, if they do.
    pub(crate) shared_tile: Option<SharedTile>,
}

/// Texels of a vertex: two, and one for each of these that the scene needs.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(crate) struct VertexTexels {
    pub(crate) count: u32,
    pub(crate) second_uv: u32,
    pub(crate) tangent: u32,
    pub(crate) color: u32,
}

impl VertexTexels {
    pub(crate) fn of(features: &Features) -> Self {
        let mut count = 2;
        let mut next = |name: &str| {
            let at = count;
            count += u32::from(features.has(name));
            at
        };
        let (second_uv, tangent, color) =
            (next("second_uv_set"), next("tangents"), next("vertex_colors"));
        Self { count, second_uv, tangent, color }
    }
}

/// Texels of a slot: what every path has, and what only some pictures need.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct SlotTexels {
    pub(crate) count: u32,
    receiver: u32,
    body: u32,
    first_hit: u32,
    map_shadow: u32,
    lamp_shadow: u32,
}

impl SlotTexels {
    pub(crate) fn of(features: &Features) -> Self {
        let mut count = 7;
        let mut next = |name: &str, texels| {
            let at = count;
            count += if features.has(name) { texels } else { 0 };
            at
        };
        let receiver = next("emitters", 2);
        let body = next("solid_transmission", if features.has("medium") { 2 } else { 1 });
        let first_hit = next("layers", 2);
        let (map_shadow, lamp_shadow) = (next("map_sampling", 4), next("local_lights", 4));
        Self { count, receiver, body, first_hit, map_shadow, lamp_shadow }
    }
}

/// Most entries of a walk's stack in workgroup memory: 6 KiB a workgroup. Hardly any walk needs more,
/// and no more workgroups would run side by side if it were smaller.
pub(crate) const SHARED_STACK_SIZE: u32 = 12;

/// Where read-only arrays lie: in storage buffers those that are named, all others in textures.
///
/// GPUs read buffers faster; textures may hold more bytes than a storage binding, and software Vulkan
/// reads texels several times faster than buffers.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct ArrayPlaces {
    /// Texels of a row of every texture, as a power of two.
    pub(crate) width_log2: u32,
    pub(crate) in_buffers: BTreeSet<&'static str>,
}

impl Default for ArrayPlaces {
    fn default() -> Self {
        Self { width_log2: 14, in_buffers: BTreeSet::new() }
    }
}

/// A read-only array.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct ArrayKind {
    /// Name of the function that reads an element.
    pub(crate) name: &'static str,
    pub(crate) format: TexelFormat,
    /// Feature without which there is no such array.
    feature: Option<&'static str>,
}

/// What a texel holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum TexelFormat {
    Words1,
    Words2,
    Words4,
    Floats4,
    Bytes4,
}

impl TexelFormat {
    /// Bytes of a texel.
    pub(crate) fn bytes(self) -> u64 {
        match self {
            Self::Words1 | Self::Bytes4 => 4,
            Self::Words2 => 8,
            Self::Words4 | Self::Floats4 => 16,
        }
    }

    /// Type of an element in a storage buffer, and what makes a vector of an element `e`.
    fn in_buffer(self) -> (&'static str, &'static str) {
        match self {
            Self::Words1 => ("array<u32>", "vec4u(e, 0u, 0u, 0u)"),
            Self::Words2 => ("array<vec2u>", "vec4u(e, 0u, 0u)"),
            Self::Words4 => ("array<vec4u>", "e"),
            Self::Floats4 => ("array<vec4f>", "e"),
            Self::Bytes4 => ("array<u32>", "unpack4x8unorm(e)"),
        }
    }

    /// Whether shaders see floats.
    pub(crate) fn is_float(self) -> bool {
        matches!(self, Self::Floats4 | Self::Bytes4)
    }
}

/// All arrays.
pub(crate) const ARRAYS: [ArrayKind; 15] = {
    use TexelFormat::{Bytes4, Floats4, Words1, Words2, Words4};
    const fn array(
        name: &'static str,
        format: TexelFormat,
        feature: Option<&'static str>,
    ) -> ArrayKind {
        ArrayKind { name, format, feature }
    }
    [
        array("bvh_nodes", Words4, Some("software_walk")),
        array("bvh_triangles", Words4, Some("software_walk")),
        array("query_triangles", Words1, Some("hardware_rays")),
        array("triangles", Words4, None),
        array("vertices", Words4, None),
        array("materials", Words4, None),
        array("tables", Floats4, None),
        array("texture_refs", Words4, Some("textures")),
        array("texels", Bytes4, Some("textures")),
        array("map_texels", Words2, Some("map")),
        array("sums", Words1, Some("map_sampling")),
        array("laws", Words1, Some("map_sampling")),
        array("lights", Words1, Some("scene_lights")),
        array("light_nodes", Words4, Some("scene_lights")),
        array("cache_slots", Words4, Some("radiance_cache")),
    ]
};

impl ArrayKind {
    /// Whether a picture with these features reads it.
    pub(crate) fn is_needed(&self, features: &Features) -> bool {
        self.feature.is_none_or(|feature| features.has(feature))
    }

    /// The declaration and the function that reads an element.
    fn accessor(&self, binding: usize, places: &ArrayPlaces) -> String {
        let Self { name, format, .. } = self;
        let scalar = if format.is_float() { "f32" } else { "u32" };
        let (declaration, reading) = if places.in_buffers.contains(name) {
            let (store, element) = format.in_buffer();
            let reading = format!("let e = {name}_buffer[index];\n    return {element};");
            (format!("var<storage, read> {name}_buffer: {store}"), reading)
        } else {
            let width_log2 = places.width_log2;
            let last = (1_u32 << width_log2) - 1;
            let texel = format!("vec2u(index & {last}u, index >> {width_log2}u)");
            let reading = format!("return textureLoad({name}_texture, {texel}, 0);");
            (format!("var {name}_texture: texture_2d<{scalar}>"), reading)
        };
        format!(
            "@group(0) @binding({binding}) {declaration};\n\
             fn {name}(index: u32) -> vec4<{scalar}> {{\n    {reading}\n}}\n"
        )
    }
}

/// One binding of a kernel, in order.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Binding {
    /// A buffer of this name.
    Buffer {
        name: &'static str,
        /// Type of the variable.
        store: &'static str,
        is_written: bool,
    },
    /// One of [`ARRAYS`] that lies in a texture.
    Array(ArrayKind),
    /// The driver's tree.
    Tree,
}

/// A kernel's source and what it binds.
#[derive(Debug, Clone)]
pub(crate) struct Program {
    pub(crate) source: String,
    pub(crate) bindings: Vec<Binding>,
}

impl Program {
    /// Puts a kernel together.
    pub(crate) fn new(
        kernel: Kernel,
        features: &Features,
        constants: &Constants,
        places: &ArrayPlaces,
    ) -> Self {
        let features = features.in_kernel(kernel, constants);
        let bindings = bindings(kernel, &features, places);
        let mut source = String::new();
        if features.has("hardware_rays") {
            source.push_str("enable wgpu_ray_query;\n");
        }
        let Constants {
            stack_size,
            shared_stack_size,
            vertex,
            textures_in_scene,
            albedo_at,
            sheen_at,
            filter_at,
            rows_at,
            shared_tile,
        } = *constants;
        for (name, value) in [
            ("STACK_SIZE", stack_size),
            ("SHARED_STACK_SIZE", shared_stack_size),
            ("VERTEX_TEXELS", vertex.count),
            ("SECOND_UV_TEXEL", vertex.second_uv),
            ("TANGENT_TEXEL", vertex.tangent),
            ("COLOR_TEXEL", vertex.color),
            ("TEXTURES_IN_SCENE", textures_in_scene),
            ("ALBEDO_AT", albedo_at),
            ("SHEEN_AT", sheen_at),
            ("FILTER_AT", filter_at),
            ("ROWS_AT", rows_at),
        ] {
            let _ = writeln!(source, "const {name} = {value}u;");
        }
        if kernel.is_of_queue() {
            let SlotTexels { count, receiver, body, first_hit, map_shadow, lamp_shadow } =
                SlotTexels::of(&features);
            for (name, value) in [
                ("SLOT_TEXELS", count),
                ("RECEIVER_TEXEL", receiver),
                ("BODY_TEXEL", body),
                ("FIRST_HIT_TEXEL", first_hit),
                ("MAP_SHADOW_TEXEL", map_shadow),
                ("LAMP_SHADOW_TEXEL", lamp_shadow),
            ] {
                let _ = writeln!(source, "const {name} = {value}u;");
            }
        }
        if kernel.shares() {
            let SharedTile { side, owner_side, continuations, map_samples } =
                shared_tile.unwrap_or(SharedTile::LARGE);
            for (name, value) in [
                ("TILE_SIDE", side),
                ("OWNER_SIDE", owner_side),
                ("CONTINUATIONS", continuations),
                ("MAP_SAMPLES", map_samples),
            ] {
                let _ = writeln!(source, "const {name} = {value}u;");
            }
        }
        if features.has("radiance_cache") {
            for (name, value) in [
                ("CACHE_SLOTS", radiance_cache::SLOTS as u32),
                ("CACHE_PROBES", radiance_cache::MOST_PROBES as u32),
                ("CACHE_WORDS", radiance_cache::WORDS as u32),
                ("TEACHERS", TEACHERS),
            ] {
                let _ = writeln!(source, "const {name} = {value}u;");
            }
        }
        for (index, binding) in bindings.iter().enumerate() {
            let array = match binding {
                Binding::Buffer { name, .. } => ARRAYS.into_iter().find(|kind| kind.name == *name),
                Binding::Array(array) => Some(*array),
                Binding::Tree => None,
            };
            match (array, binding) {
                (Some(array), _) => source.push_str(&array.accessor(index, places)),
                (None, Binding::Buffer { name, store, is_written }) => {
                    let access = if *is_written { "read_write" } else { "read" };
                    let _ = writeln!(
                        source,
                        "@group(0) @binding({index}) var<storage, {access}> {name}: {store};"
                    );
                }
                (None, Binding::Array(_)) => {}
                (None, Binding::Tree) => {
                    let _ = writeln!(
                        source,
                        "@group(0) @binding({index}) var tree: acceleration_structure;"
                    );
                }
            }
        }
        for (text, is_needed) in files(kernel, &features) {
            if is_needed {
                keep_lines(text, &features, &mut source);
            }
        }
        Self { source, bindings }
    }
}

/// The files of a kernel, callees before callers.
fn files(kernel: Kernel, features: &Features) -> [(&'static str, bool); 46] {
    macro_rules! wgsl {
        ($name:literal) => {
            include_str!(concat!("../../../shaders/", $name, ".wgsl"))
        };
    }
    let samples_map = features.has("map_sampling");
    [
        (wgsl!("globals"), true),
        (wgsl!("math"), true),
        (wgsl!("sampler"), true),
        (wgsl!("texture"), features.has("textures")),
        (wgsl!("surface"), true),
        (wgsl!("fresnel"), true),
        (wgsl!("microfacet"), true),
        (wgsl!("iridescence"), features.has("iridescence")),
        (wgsl!("sheen"), features.has("sheen")),
        (wgsl!("albedo"), true),
        (wgsl!("interface"), true),
        (wgsl!("coat"), features.has("clearcoat")),
        (wgsl!("bsdf"), true),
        (wgsl!("light_grid"), true),
        (wgsl!("environment"), true),
        (wgsl!("tile_local"), samples_map && !features.has("summed_area")),
        (wgsl!("summed_area"), samples_map && features.has("summed_area")),
        (wgsl!("draw"), features.has("scene_lights")),
        (wgsl!("light_tree"), features.has("scene_lights")),
        (wgsl!("lights"), features.has("scene_lights")),
        (wgsl!("medium"), features.has("medium")),
        (wgsl!("bvh"), true),
        (wgsl!("ray_query"), features.has("hardware_rays")),
        (wgsl!("camera"), true),
        (wgsl!("path"), true),
        (wgsl!("broad"), kernel.shares() || features.has("radiance_cache")),
        (wgsl!("radiance_cache"), features.has("radiance_cache")),
        (wgsl!("count"), features.has("counting")),
        (wgsl!("film"), kernel.adds_samples()),
        (wgsl!("sample"), kernel.begins_samples()),
        (wgsl!("render"), kernel == Kernel::Render),
        (wgsl!("anywhere"), kernel.begins_anywhere()),
        (wgsl!("learn"), kernel == Kernel::Learn),
        (wgsl!("teach"), kernel == Kernel::Teach),
        (wgsl!("cast"), kernel.casts()),
        (wgsl!("closest_hits"), kernel == Kernel::ClosestHits),
        (wgsl!("shadow_rays"), kernel == Kernel::ShadowRays),
        (wgsl!("words"), kernel.is_of_queue() || kernel.shares()),
        (wgsl!("slots"), kernel.is_of_queue()),
        (wgsl!("trace"), kernel == Kernel::Trace),
        (wgsl!("shade"), kernel == Kernel::Shade),
        (wgsl!("follow_shadows"), kernel == Kernel::FollowShadows),
        (wgsl!("sharing"), kernel.shares()),
        (wgsl!("find_seconds"), kernel == Kernel::FindSeconds),
        (wgsl!("light_seconds"), kernel == Kernel::LightSeconds),
        (wgsl!("connect_seconds"), kernel == Kernel::ConnectSeconds),
    ]
}

fn bindings(kernel: Kernel, features: &Features, places: &ArrayPlaces) -> Vec<Binding> {
    let (teaches, counts) = (kernel == Kernel::Teach, features.has("counting"));
    let (renders, is_of_queue) = (kernel.adds_samples(), kernel.is_of_queue());
    let has_layers = renders && features.has("layers");
    let buffers = [
        // Not a uniform: software Vulkan optimises a shader anew, for 40 ms, before each dispatch if
        // it branches on uniforms.
        ("globals", "Globals", false, true),
        ("film_sum", "array<vec4f>", true, renders),
        ("film_rest", "array<vec4f>", true, renders),
        ("film_counts", "array<vec4u>", true, renders),
        ("surfaces", "array<vec4f>", true, has_layers),
        ("surfaces_rest", "array<vec4f>", true, has_layers),
        ("visits", "array<atomic<u32>>", true, counts),
        ("counters", "array<atomic<u32>>", true, counts),
        ("slot_of_cell", "array<u32>", false, counts),
        ("learning_rays", "atomic<u32>", true, kernel.begins_anywhere()),
        ("cache_sums", "array<atomic<u32>>", true, teaches),
        ("slots", "array<vec4u>", true, is_of_queue),
        ("queue", "Queue", true, is_of_queue),
        ("firsts", "array<vec4u>", true, kernel.shares() && kernel != Kernel::LightSeconds),
        ("seconds", "array<vec4u>", true, kernel.shares()),
        ("cast_rays", "array<CastRay>", false, kernel.casts()),
        ("cast_results", "array<vec2u>", true, kernel.casts()),
    ];
    let buffers = buffers
        .into_iter()
        .filter(|(.., is_needed)| *is_needed)
        .map(|(name, store, is_written, _)| Binding::Buffer { name, store, is_written });
    let arrays = ARRAYS.into_iter().filter(|array| array.is_needed(features)).map(|array| {
        if places.in_buffers.contains(array.name) {
            let (store, _) = array.format.in_buffer();
            Binding::Buffer { name: array.name, store, is_written: false }
        } else {
            Binding::Array(array)
        }
    });
    let tree = features.has("hardware_rays").then_some(Binding::Tree);
    buffers.chain(arrays).chain(tree).collect()
}

/// Appends the lines of `text` whose conditions hold.
fn keep_lines(text: &str, features: &Features, source: &mut String) {
    let mut conditions = Vec::new();
    for line in text.lines() {
        if let Some(name) = line.strip_prefix("//#if ") {
            conditions.push(features.has(name.trim()));
        } else if line == "//#else" {
            if let Some(condition) = conditions.last_mut() {
                *condition = !*condition;
            }
        } else if line == "//#end" {
            conditions.pop();
        } else if conditions.iter().all(|condition| *condition) {
            source.push_str(line);
            source.push('\n');
        }
    }
    debug_assert!(conditions.is_empty(), "an //#if without its //#end");
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn conditions_nest_and_have_an_else() {
        let features = Features::from_names([("map", true)]);
        let text = "a\n//#if map\nb\n//#if lens\nc\n//#else\nd\n//#end\n//#else\ne\n//#end\nf";
        let mut kept = String::new();
        keep_lines(text, &features, &mut kept);
        assert_eq!(kept, "a\nb\nd\nf\n");
    }

    fn validate(kernel: Kernel, features: &Features, places: &ArrayPlaces) {
        let constants = Constants {
            stack_size: if places.in_buffers.is_empty() { 20 } else { 10 },
            shared_stack_size: 10,
            vertex: VertexTexels::of(features),
            ..Constants::default()
        };
        let program = Program::new(kernel, features, &constants, places);
        let names: Vec<_> = features.names().collect();
        let module = naga::front::wgsl::parse_str(&program.source)
            .unwrap_or_else(|e| panic!("{names:?}: {}", e.emit_to_string(&program.source)));
        let mut validator = naga::valid::Validator::new(
            naga::valid::ValidationFlags::all(),
            naga::valid::Capabilities::RAY_QUERY,
        );
        let info = validator
            .validate(&module)
            .unwrap_or_else(|e| panic!("{names:?}: {}", e.emit_to_string(&program.source)));
        // The step after validation, in which naga has been seen to fail.
        let options = naga::back::spv::Options::default();
        naga::back::spv::write_vec(&module, &info, &options, None)
            .unwrap_or_else(|e| panic!("{names:?}: {e}"));
        let entries: Vec<_> = module.entry_points.iter().map(|e| e.name.as_str()).collect();
        assert_eq!(entries, [kernel.name()]);
    }

    /// Divisions and remainders of integers by what is no constant. naga does not guard them (see
    /// `RUNTIME_CHECKS`), so here is why each divisor is at least 1.
    const DIVISIONS: [&str; 16] = [
        // The share of the whole map's law is 1 to 256, and with 256 no number lies beyond it.
        "choose_tile: (((rest % width) << 8u) | (finer & 0xffu)) / width",
        "choose_tile: rest % width",
        "choose_tile: rest / width",
        // The map has tiles, and as many patches or more.
        "first_row_sum: tile % globals.tile_columns",
        // A constant, in a vector.
        "member_of: local % OWNER_SIDE",
        "member_of: local / OWNER_SIDE",
        "member_of: tile % max(across, 1u)",
        "member_of: tile / max(across, 1u)",
        // Tiles across a picture of at least one pixel.
        "pixel_in_tile: tile % tiles_across",
        "pixel_in_tile: tile / tiles_across",
        "start_sample: (y * globals.width + x + index) % max(stride, 1u)",
        "tile_of_patch: ((at + 1u) * tiles - 1u) / patch_grid()",
        "tile_patches: (at + 1u) * size / tiles",
        "tile_patches: at * size / tiles",
        "tile_patches: tile % tiles.x",
        "tile_patches: tile / tiles.x",
    ];

    #[test]
    fn no_integer_is_divided_by_zero() {
        let mut found = BTreeSet::new();
        let all = [Kernel::Render, Kernel::Learn, Kernel::Teach, Kernel::Trace].into_iter();
        for kernel in all.chain(Kernel::OF_SHARING) {
            for table in [None, Some("table_u32")] {
                let features = reachable(|_| true, table);
                let constants =
                    Constants { stack_size: 20, shared_stack_size: 10, ..Constants::default() };
                let source =
                    Program::new(kernel, &features, &constants, &ArrayPlaces::default()).source;
                let module = naga::front::wgsl::parse_str(&source).expect("it is valid");
                let entries = module.entry_points.iter().map(|entry| &entry.function);
                for function in module.functions.iter().map(|(_, f)| f).chain(entries) {
                    found.extend(integer_divisions(&module, function, &source));
                }
            }
        }
        assert_eq!(found.iter().map(String::as_str).collect::<Vec<_>>(), DIVISIONS);
    }

    /// Those of a function whose divisor is no constant.
    fn integer_divisions(
        module: &naga::Module,
        function: &naga::Function,
        source: &str,
    ) -> Vec<String> {
        use naga::{BinaryOperator, Expression, ScalarKind};
        let mut typifier = naga::front::Typifier::new();
        let context = naga::proc::ResolveContext::with_locals(
            module,
            &function.local_variables,
            &function.arguments,
        );
        let mut found = Vec::new();
        for (handle, expression) in function.expressions.iter() {
            typifier.grow(handle, &function.expressions, &context).expect("it has a type");
            let Expression::Binary { op, right, .. } = *expression else { continue };
            let kind = typifier.get(right, &module.types).scalar_kind();
            let is_integer = kind != Some(ScalarKind::Float);
            let divides = matches!(op, BinaryOperator::Divide | BinaryOperator::Modulo);
            let by_constant = match function.expressions[right] {
                Expression::Literal(_) => true,
                Expression::Constant(constant) => {
                    let value = &module.global_expressions[module.constants[constant].init];
                    matches!(value, Expression::Literal(naga::Literal::U32(1..)))
                }
                _ => false,
            };
            if divides && is_integer && !by_constant {
                let text =
                    &source[function.expressions.get_span(handle).to_range().unwrap_or(0..0)];
                let name = function.name.as_deref().unwrap_or("an entry point");
                found.push(format!("{name}: {text}"));
            }
        }
        found
    }

    /// Features that a picture can have or not have on their own; the others follow from them.
    fn independent() -> Vec<&'static str> {
        let follow = [
            "albedo",
            "cached",
            "filtered_hits",
            "filtered_or_passed",
            "finding",
            "hardware_rays",
            "learning",
            "pass_through",
            "deep_tree",
            "scene_lights",
            "shadow_media",
            "shadow_rays",
            "sharing",
            "software_walk",
            "tangents",
            "teaching",
            "uncommon_textures",
        ];
        let names = Features::ALL.into_iter();
        names
            .filter(|n| !follow.contains(n) && !n.starts_with("table_") && *n != "summed_area")
            .collect()
    }

    /// What reachable pictures have: no map to sample without a map, no grid without sampling it.
    fn reachable(on: impl Fn(usize) -> bool, table: Option<&'static str>) -> Features {
        let names = independent();
        let mut chosen: BTreeSet<_> =
            names.iter().enumerate().filter(|(i, _)| on(*i)).map(|(_, name)| *name).collect();
        if !chosen.contains("map") {
            chosen.remove("map_sampling");
        }
        if !chosen.contains("map_sampling") {
            chosen.remove("light_grid");
        }
        if !(chosen.contains("light_grid") && chosen.contains("record_ratio")) {
            chosen.remove("counting");
        }
        if !(chosen.contains("emitters") || chosen.contains("punctual_lights")) {
            chosen.remove("local_lights");
        }
        if !(chosen.contains("solid_transmission") && chosen.contains("transmission")) {
            chosen.remove("dispersion");
        }
        if !chosen.contains("textures") {
            chosen.remove("normal_maps");
        }
        Features::from_names(chosen.into_iter().chain(table).map(|name| (name, true)))
    }

    /// Each feature alone and all but it, and 60 random sets, in which every combination of two
    /// features occurs (a pair is missed with a probability of 3e-8).
    #[test]
    fn every_variant_validates() {
        let count = independent().len();
        let tables = [None, Some("table_u32"), Some("table_f32"), Some("table_f64")];
        let mut sets = vec![reachable(|_| false, None), reachable(|_| true, None)];
        for one in 0..count {
            sets.push(reachable(|i| i == one, None));
            sets.push(reachable(|i| i != one, None));
        }
        for seed in 0..60_u32 {
            let half = |at| u64::from(crate::sampler::hash(2 * seed + at));
            let bits = half(1) << 32 | half(2);
            sets.push(reachable(|i| bits >> i & 1 == 1, tables[seed as usize % 4]));
        }
        let in_textures = ArrayPlaces { width_log2: 12, ..ArrayPlaces::default() };
        let in_buffers = ARRAYS.map(|array| array.name).into();
        let in_buffers = ArrayPlaces { in_buffers, ..in_textures.clone() };
        for (features, number) in sets.iter().zip(0..) {
            let places = if number % 2 == 0 { &in_textures } else { &in_buffers };
            validate(Kernel::Render, features, places);
            if features.has("light_grid") {
                validate(Kernel::Learn, features, places);
            }
            if features.has("radiance_cache") {
                validate(Kernel::Teach, features, places);
            }
            for kernel in Kernel::OF_SHARING {
                validate(kernel, features, places);
            }
            for kernel in Kernel::OF_QUEUE {
                if kernel != Kernel::FollowShadows || features.has("shadow_rays") {
                    validate(kernel, features, places);
                }
            }
            validate(Kernel::ClosestHits, features, places);
            validate(Kernel::ShadowRays, features, places);
            validate(Kernel::Render, &features.clone().with_hardware_rays(), places);
        }
    }
}
