//! What a picture may need of the renderer: what it does without is neither evaluated nor, on a GPU,
//! compiled.

bitflags::bitflags! {
    /// A set of such needs. In shaders, `//#if NAME` asks for one.
    #[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
    pub struct Features: u64 {
        // Of the scene.
        /// Any texture at all.
        const TEXTURES = 1 << 0;
        /// A second set of texture coordinates.
        const SECOND_UV_SET = 1 << 1;
        /// Normal maps, hence tangents.
        const NORMAL_MAPS = 1 << 2;
        /// Vertex colours.
        const VERTEX_COLORS = 1 << 3;
        /// Surfaces cut out by an alpha threshold.
        const ALPHA_MASK = 1 << 4;
        /// Surfaces with partial opacity.
        const ALPHA_BLEND = 1 << 5;
        /// Single-sided surfaces, which camera rays pass from behind.
        const SINGLE_SIDED = 1 << 6;
        /// Metals.
        const METALS = 1 << 7;
        /// Thin-walled transmission.
        const THIN_TRANSMISSION = 1 << 8;
        /// Light that enters solid bodies.
        const SOLID_TRANSMISSION = 1 << 9;
        /// Light that comes through diffusely.
        const DIFFUSE_TRANSMISSION = 1 << 10;
        /// Absorption inside solid bodies.
        const ABSORPTION = 1 << 11;
        /// A medium of the scene's own between surfaces.
        const FOG = 1 << 12;
        /// Scattering inside solid bodies.
        const SCATTERING_SOLIDS = 1 << 13;
        /// Reflections that are wider in one direction.
        const ANISOTROPY = 1 << 14;
        /// Sheen.
        const SHEEN = 1 << 15;
        /// Thin films on surfaces.
        const IRIDESCENCE = 1 << 16;
        /// Solids that bend colours differently.
        const DISPERSION = 1 << 17;
        /// Clearcoat.
        const CLEARCOAT = 1 << 18;
        /// Unlit surfaces.
        const UNLIT = 1 << 19;
        /// Emissive triangles.
        const EMITTERS = 1 << 20;
        /// Point, spot or directional lights.
        const PUNCTUAL_LIGHTS = 1 << 21;
        // Of the picture.
        /// The camera sees the map blurred.
        const BACKGROUND_BLUR = 1 << 22;
        /// The camera sees a colour in place of the map.
        const BACKGROUND_COLOR = 1 << 23;
        /// Random points in place of Sobol's.
        const INDEPENDENT_POINTS = 1 << 24;
        /// Albedo, normal and depth are kept.
        const LAYERS = 1 << 25;
        /// A lens that is no pinhole.
        const LENS = 1 << 26;
        /// Something scatters between surfaces or in solids.
        const MEDIUM = 1 << 27;
        /// Paths end in the radiance cache, or train it.
        const RADIANCE_CACHE = 1 << 28;
        /// A pixel filter wider than a box.
        const WIDE_FILTER = 1 << 29;
        /// Lights to be sampled that are not the map.
        const LOCAL_LIGHTS = 1 << 30;
        // Of the map and what is learned of it.
        /// A map that is not black.
        const MAP = 1 << 31;
        /// The map is sampled.
        const MAP_SAMPLING = 1 << 32;
        /// A summed-area table of `f32`.
        const TABLE_F32 = 1 << 33;
        /// One of `f64`.
        const TABLE_F64 = 1 << 34;
        /// One of rounded `u32`.
        const TABLE_U32 = 1 << 35;
        /// Tiles are chosen by the cell.
        const LIGHT_GRID = 1 << 36;
        /// Cells tell which way a surface faces.
        const FACES = 1 << 37;
        /// It is counted what samples of the map see.
        const COUNTING = 1 << 38;
        /// Counters hold a share of what was tried.
        const RECORD_RATIO = 1 << 39;
        /// The share is weighted by the cosine.
        const RECORD_COSINE = 1 << 40;
        /// By its square.
        const RECORD_SQUARED_COSINE = 1 << 41;
        // Of a kernel.
        /// Paths end in the radiance cache.
        const CACHED = 1 << 42;
        /// A walk's stack does not fit into workgroup memory.
        const DEEP_TREE = 1 << 43;
        /// Second vertices are found for a tile.
        const FINDING = 1 << 44;
        /// The device finds what rays hit.
        const HARDWARE_RAYS = 1 << 45;
        /// Paths are traced to learn from.
        const LEARNING = 1 << 46;
        /// Second vertices are shared.
        const SHARING = 1 << 47;
        /// Paths train the radiance cache.
        const TRAINING = 1 << 48;
        // Of what follows from others.
        /// Some hits of closest-hit rays do not count.
        const FILTERED_HITS = 1 << 51;
        /// The same, or rays pass them.
        const FILTERED_OR_PASSED = 1 << 52;
        /// Surfaces that take a part of the light of a ray.
        const PARTIAL = 1 << 53;
        /// A ray may pass a surface without being scattered.
        const PASS_THROUGH = 1 << 54;
        /// Lights that are not the map.
        const SCENE_LIGHTS = 1 << 55;
        /// Shadow rays lose light on their way.
        const SHADOW_MEDIA = 1 << 56;
        /// There are shadow rays.
        const SHADOW_RAYS = 1 << 57;
        /// A kernel walks the tree.
        const SOFTWARE_WALK = 1 << 58;
        /// A summed-area table, whatever its numbers.
        const SUMMED_AREA = 1 << 59;
        /// Tangents of vertices.
        const TANGENTS = 1 << 60;
        /// Light that comes through undiffused.
        const TRANSMISSION = 1 << 61;
        /// Textures that few materials have.
        const UNCOMMON_TEXTURES = 1 << 62;
        // Of the scene, again.
        /// Emissive triangles under a clearcoat.
        const COATED_EMITTERS = 1 << 49;
        /// Meshes that instances share.
        const INSTANCES = 1 << 63;
    }
}

impl Features {
    /// Names of the needs, in small letters.
    pub fn names(self) -> impl Iterator<Item = String> {
        self.iter_names().map(|(name, _)| name.to_lowercase())
    }

    /// These, if `on`.
    #[must_use]
    pub fn only_if(self, on: bool) -> Self {
        if on { self } else { Self::empty() }
    }
}
