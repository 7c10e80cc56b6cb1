//! The shaders' source: files, lines and bindings that a scene does not need are left out.
//!
//! A line `//#if NAME` keeps what follows, up to `//#else` or `//#end`, only if the feature is on, and
//! `//#if !NAME` only if it is off.

use std::collections::BTreeSet;
use std::fmt::Write as _;

use wgpu::TextureFormat;

use super::constants;
use super::features::{Condition, Features, ViewFeatures};
use super::kernel::Kernel;
use super::layout::{MaterialFlags, TextureFlags};
use super::texels::{SlotTexels, VertexTexels};
use crate::path::sharing::SharedTile;
use crate::scene::needs::SceneFeatures;

/// Shaders' names of where each table of numbers begins: those of scattering, the pixel filter's, the map's rows.
const TABLES: [&str; 5] = ["ALBEDO_AT", "SHEEN_AT", "RESCATTER_AT", "FILTER_AT", "ROWS_AT"];

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
    /// Texels of `tables` at which each of `TABLES` begins.
    pub(crate) tables_at: [u32; 5],
    /// Bits of the length of the scene's unit in metres of its file.
    pub(crate) metres: u32,
    /// How pixels share, if they do.
    pub(crate) shared_tile: Option<SharedTile>,
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
#[derive(Debug, Clone, Copy)]
pub(crate) struct ArrayKind {
    /// Name of the function that reads an element.
    pub(crate) name: &'static str,
    /// What a texel holds: one of those that `ARRAYS` has.
    pub(crate) format: TextureFormat,
    /// Whether kernels with given features read it.
    is_needed: Condition,
}

/// All arrays.
pub(crate) const ARRAYS: [ArrayKind; 17] = {
    use TextureFormat::{R32Uint, Rg32Uint, Rgba8Unorm, Rgba32Float, Rgba32Uint};
    use {SceneFeatures as S, ViewFeatures as V};
    const fn array(name: &'static str, format: TextureFormat, is_needed: Condition) -> ArrayKind {
        ArrayKind { name, format, is_needed }
    }
    [
        array("bvh_nodes", Rgba32Uint, Features::software_walk),
        array("bvh_triangles", Rgba32Uint, Features::software_walk),
        array("query_triangles", R32Uint, |f| !f.software_walk()),
        array("triangles", Rgba32Uint, |_| true),
        array("vertices", Rgba32Uint, |_| true),
        array("instances", Rgba32Uint, |f| f.scene.contains(S::INSTANCES)),
        array("instance_slots", R32Uint, |f| f.scene.contains(S::INSTANCES)),
        array("materials", Rgba32Uint, |_| true),
        array("tables", Rgba32Float, |_| true),
        array("texture_refs", Rgba32Uint, |f| f.scene.contains(S::TEXTURES)),
        array("texels", Rgba8Unorm, |f| f.scene.contains(S::TEXTURES)),
        array("map_texels", Rg32Uint, |f| f.view.contains(V::MAP)),
        array("sums", R32Uint, |f| f.view.contains(V::MAP_SAMPLING)),
        array("distributions", R32Uint, |f| f.view.contains(V::MAP_SAMPLING)),
        array("lights", R32Uint, Features::scene_lights),
        array("light_nodes", Rgba32Uint, Features::scene_lights),
        array("cache_slots", Rgba32Uint, |f| f.view.contains(V::RADIANCE_CACHE)),
    ]
};

impl ArrayKind {
    /// Bytes of a texel.
    pub(crate) fn texel_bytes(&self) -> u64 {
        self.format.block_copy_size(None).map_or(4, u64::from)
    }

    /// Type of an element in a storage buffer, and what makes a vector of an element `e`.
    fn in_buffer(&self) -> (&'static str, &'static str) {
        match self.format {
            TextureFormat::R32Uint => ("array<u32>", "vec4u(e, 0u, 0u, 0u)"),
            TextureFormat::Rg32Uint => ("array<vec2u>", "vec4u(e, 0u, 0u)"),
            TextureFormat::Rgba32Uint => ("array<vec4u>", "e"),
            TextureFormat::Rgba32Float => ("array<vec4f>", "e"),
            _ => ("array<u32>", "unpack4x8unorm(e)"),
        }
    }

    /// Whether shaders see floats.
    pub(crate) fn is_float(&self) -> bool {
        matches!(self.format, TextureFormat::Rgba32Float | TextureFormat::Rgba8Unorm)
    }

    /// The declaration and the function that reads an element.
    fn accessor(&self, binding: usize, places: &ArrayPlaces) -> String {
        let Self { name, .. } = self;
        let scalar = if self.is_float() { "f32" } else { "u32" };
        let (declaration, reading) = if places.in_buffers.contains(name) {
            let (store, element) = self.in_buffer();
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
#[derive(Debug, Clone, Copy)]
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
        features: Features,
        constants: &Constants,
        places: &ArrayPlaces,
    ) -> Self {
        let features =
            features.in_kernel(kernel, constants.stack_size > constants.shared_stack_size);
        let bindings = bindings(kernel, features, places);
        let mut source = String::new();
        if !features.software_walk() {
            source.push_str("enable wgpu_ray_query;\n");
        }
        source.push_str(&constants::shared());
        let _ = writeln!(source, "const METRES = {:?}f;", f32::from_bits(constants.metres));
        let mut declare = |constants: &[(&str, u32)]| {
            for (name, value) in constants {
                let _ = writeln!(source, "const {name} = {value}u;");
            }
        };
        let of_materials =
            MaterialFlags::all().iter_names().map(|(name, flag)| (name, flag.bits()));
        let of_textures = TextureFlags::all().iter_names().map(|(name, flag)| (name, flag.bits()));
        declare(&of_materials.chain(of_textures).collect::<Vec<_>>());
        declare(&[
            ("STACK_SIZE", constants.stack_size),
            ("SHARED_STACK_SIZE", constants.shared_stack_size),
            ("VERTEX_TEXELS", constants.vertex.count),
            ("SECOND_UV_TEXEL", constants.vertex.second_uv),
            ("TANGENT_TEXEL", constants.vertex.tangent),
            ("COLOR_TEXEL", constants.vertex.color),
            ("TEXTURES_IN_SCENE", constants.textures_in_scene),
        ]);
        declare(&std::array::from_fn::<_, 5, _>(|i| (TABLES[i], constants.tables_at[i])));
        if kernel.keeps_paths() {
            let slot = SlotTexels::of(features);
            declare(&[("SLOT_TEXELS", slot.count)]);
            declare(&slot.parts);
        }
        if kernel.shares() {
            let SharedTile { side, owner_side, continuations } =
                constants.shared_tile.unwrap_or(SharedTile::LARGE);
            declare(&[
                ("TILE_SIDE", side),
                ("OWNER_SIDE", owner_side),
                ("CONTINUATIONS", continuations),
                ("MAP_SAMPLES", SharedTile::MAP_SAMPLES),
            ]);
        }
        for (index, binding) in bindings.iter().enumerate() {
            let array = |name: &str| ARRAYS.into_iter().find(|kind| kind.name == name);
            let declaration = match *binding {
                Binding::Array(array) => array.accessor(index, places),
                Binding::Buffer { name, .. } if let Some(array) = array(name) => {
                    array.accessor(index, places)
                }
                Binding::Buffer { name, store, is_written } => {
                    let access = if is_written { "read_write" } else { "read" };
                    format!("@group(0) @binding({index}) var<storage, {access}> {name}: {store};\n")
                }
                Binding::Tree => {
                    format!("@group(0) @binding({index}) var tree: acceleration_structure;\n")
                }
            };
            source.push_str(&declaration);
        }
        let files = files(kernel, features).into_iter().filter(|(_, is_needed)| *is_needed);
        for text in files.map(|(text, _)| text).chain([kernel.source()]) {
            keep_lines(text, features, &mut source);
        }
        Self { source, bindings }
    }
}

/// The files before that of the entry point, callees before callers, and whether each is needed.
fn files(kernel: Kernel, features: Features) -> [(&'static str, bool); 57] {
    macro_rules! wgsl {
        ($name:literal) => {
            include_str!(concat!("../../../shaders/", $name, ".wgsl"))
        };
    }
    let Features { scene, view, .. } = features;
    let is_clear = features.transmission();
    let is_translucent = scene.contains(SceneFeatures::DIFFUSE_TRANSMISSION);
    let has_instances = scene.contains(SceneFeatures::INSTANCES);
    let samples_map = view.contains(ViewFeatures::MAP_SAMPLING);
    let has_shadow_rays = features.shadow_rays();
    let tells_lobes = ViewFeatures::RADIANCE_CACHE | ViewFeatures::AIMING;
    [
        (wgsl!("globals"), true),
        (wgsl!("math"), true),
        (wgsl!("sampler"), true),
        (wgsl!("texture"), scene.contains(SceneFeatures::TEXTURES)),
        (wgsl!("instances"), has_instances),
        (wgsl!("surface"), true),
        (wgsl!("fresnel"), true),
        (wgsl!("microfacet"), true),
        (wgsl!("iridescence"), scene.contains(SceneFeatures::IRIDESCENCE)),
        (wgsl!("no_iridescence"), !scene.contains(SceneFeatures::IRIDESCENCE)),
        (wgsl!("sheen"), scene.contains(SceneFeatures::SHEEN)),
        (wgsl!("no_sheen"), !scene.contains(SceneFeatures::SHEEN)),
        (wgsl!("albedo"), true),
        (wgsl!("dispersion"), scene.contains(SceneFeatures::DISPERSION)),
        (wgsl!("no_dispersion"), is_clear && !scene.contains(SceneFeatures::DISPERSION)),
        (wgsl!("glass"), is_clear),
        (wgsl!("no_glass"), !is_clear),
        (wgsl!("interface"), true),
        (wgsl!("rescatter"), features.rescatters()),
        (wgsl!("no_rescatter"), !features.rescatters()),
        (wgsl!("diffuse"), !is_translucent),
        (wgsl!("translucent"), is_translucent),
        (wgsl!("coat"), scene.contains(SceneFeatures::CLEARCOAT)),
        (wgsl!("no_coat"), !scene.contains(SceneFeatures::CLEARCOAT)),
        (wgsl!("bsdf"), true),
        (wgsl!("light_grid"), true),
        (wgsl!("environment"), true),
        (wgsl!("tile_local"), samples_map),
        (wgsl!("draw"), features.scene_lights()),
        (wgsl!("light_tree"), features.scene_lights()),
        (wgsl!("lights"), features.scene_lights()),
        (wgsl!("aim"), view.contains(ViewFeatures::AIMING)),
        (wgsl!("medium"), view.contains(ViewFeatures::MEDIUM)),
        (wgsl!("bvh"), true),
        (wgsl!("levels"), has_instances && features.software_walk()),
        (wgsl!("ray_query"), !features.software_walk()),
        (wgsl!("camera"), true),
        (wgsl!("path"), true),
        (wgsl!("body"), scene.contains(SceneFeatures::SOLID_TRANSMISSION)),
        (wgsl!("path_medium"), view.contains(ViewFeatures::MEDIUM)),
        (wgsl!("passing"), features.filtered_or_passed()),
        (wgsl!("through_glass"), scene.contains(SceneFeatures::CLEAR_SOLIDS)),
        (wgsl!("emitted"), scene.contains(SceneFeatures::EMITTERS)),
        (wgsl!("background"), view.contains(ViewFeatures::BACKGROUND_BLUR)),
        (wgsl!("shadows"), has_shadow_rays),
        (wgsl!("gather"), has_shadow_rays && kernel != Kernel::Learn),
        (wgsl!("no_lights"), !has_shadow_rays && kernel != Kernel::Learn),
        (wgsl!("lobes"), kernel.shares() || view.intersects(tells_lobes)),
        (wgsl!("radiance_cache"), view.contains(ViewFeatures::RADIANCE_CACHE)),
        (wgsl!("count"), view.contains(ViewFeatures::COUNTING)),
        (wgsl!("film"), kernel.adds_samples()),
        (wgsl!("sample"), kernel.adds_samples() || kernel == Kernel::FindSeconds),
        (wgsl!("anywhere"), kernel.begins_anywhere()),
        (wgsl!("cast"), kernel.casts()),
        (wgsl!("words"), kernel.is_of_queue() || kernel.shares()),
        (wgsl!("slots"), kernel.keeps_paths()),
        (wgsl!("sharing"), kernel.shares()),
    ]
}

fn bindings(kernel: Kernel, features: Features, places: &ArrayPlaces) -> Vec<Binding> {
    let Features { view, .. } = features;
    let (trains, counts) = (kernel == Kernel::Train, view.contains(ViewFeatures::COUNTING));
    let (renders, is_of_queue) = (kernel.adds_samples(), kernel.is_of_queue());
    let has_layers = renders && view.contains(ViewFeatures::LAYERS);
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
        ("cache_sums", "array<atomic<u32>>", true, trains),
        ("slots", "array<vec4u>", true, kernel.keeps_paths()),
        ("queue", "Queue", true, is_of_queue),
        ("firsts", "array<vec4u>", true, kernel.shares() && kernel != Kernel::LightSeconds),
        ("seconds", "array<vec4u>", true, kernel.shares()),
        ("cast_rays", "array<CastRay>", false, kernel.casts()),
        ("cast_results", "array<vec2u>", true, kernel.casts()),
    ];
    let buffers = buffers.into_iter().filter(|(.., is_needed)| *is_needed);
    let buffers =
        buffers.map(|(name, store, is_written, _)| Binding::Buffer { name, store, is_written });
    let arrays = ARRAYS.into_iter().filter(|array| (array.is_needed)(&features)).map(|array| {
        if places.in_buffers.contains(array.name) {
            let (store, _) = array.in_buffer();
            Binding::Buffer { name: array.name, store, is_written: false }
        } else {
            Binding::Array(array)
        }
    });
    buffers.chain(arrays).chain((!features.software_walk()).then_some(Binding::Tree)).collect()
}

/// Appends the lines of `text` whose conditions hold.
fn keep_lines(text: &str, features: Features, source: &mut String) {
    let mut conditions = Vec::new();
    for line in text.lines() {
        if let Some(condition) = line.strip_prefix("//#if ") {
            let name = condition.trim_start_matches('!');
            let found = features.by_name().find(|(known, _)| *known == name);
            debug_assert!(found.is_some(), "{name} is no feature");
            conditions.push(found.is_some_and(|(_, is_on)| is_on) == (name == condition));
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
    use std::collections::BTreeSet;
    use std::sync::{Mutex, PoisonError};

    use super::super::device::MAX_STORAGE_BUFFERS;
    use super::super::features::KernelFeatures;
    use super::*;
    use crate::digest::Digest;

    #[test]
    fn conditions_nest_and_have_an_else_and_a_not() {
        let features = Features { view: ViewFeatures::MAP, ..Features::default() };
        let text = "a\n//#if MAP\nb\n//#if LENS\nc\n//#else\nd\n//#end\n//#else\ne\n//#end\nf\n\
            //#if !MAP\ng\n//#end\n//#if !LENS\nh\n//#end";
        let mut kept = String::new();
        keep_lines(text, features, &mut kept);
        assert_eq!(kept, "a\nb\nd\nf\nh\n");
    }

    fn validate(kernel: Kernel, features: Features, places: &ArrayPlaces) {
        let constants = Constants {
            stack_size: if places.in_buffers.is_empty() { 20 } else { 10 },
            shared_stack_size: 10,
            vertex: VertexTexels::of(features),
            ..Constants::default()
        };
        let program = Program::new(kernel, features, &constants, places);
        // Many variants of a kernel are the same.
        static KNOWN: Mutex<BTreeSet<u64>> = Mutex::new(BTreeSet::new());
        let digest = Digest::new().bytes(program.source.as_bytes()).value();
        if !KNOWN.lock().unwrap_or_else(PoisonError::into_inner).insert(digest) {
            return;
        }
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
        // The step after validation, in which naga has been seen to fail: for Vulkan, Metal and DX12.
        let options = naga::back::spv::Options::default();
        naga::back::spv::write_vec(&module, &info, &options, None)
            .unwrap_or_else(|e| panic!("{names:?}: {e}"));
        let options = naga::back::msl::Options {
            lang_version: (2, 4),
            ..naga::back::msl::Options::default()
        };
        naga::back::msl::write_string(&module, &info, &options, &Default::default())
            .unwrap_or_else(|e| panic!("{names:?} for Metal: {e}"));
        use naga::back::hlsl;
        let asks_hardware = program.source.contains("rayQueryInitialize");
        let shader_model = match asks_hardware {
            true => hlsl::ShaderModel::V6_5,
            // That of the compiler which every Windows has.
            false => hlsl::ShaderModel::V5_1,
        };
        let options = hlsl::Options { shader_model, ..hlsl::Options::default() };
        hlsl::Writer::new(&mut String::new(), &options, &Default::default())
            .write(&module, &info, None)
            .unwrap_or_else(|e| panic!("{names:?} for DX12: {e}"));
        let entries: Vec<_> = module.entry_points.iter().map(|e| e.name.as_str()).collect();
        assert_eq!(entries, [kernel.name()]);
        let is_buffer = |binding: &&Binding| matches!(binding, Binding::Buffer { .. });
        let buffers = program.bindings.iter().filter(is_buffer).count();
        assert!(buffers as u32 <= MAX_STORAGE_BUFFERS, "{names:?}: {buffers} storage buffers");
    }

    /// Divisions and remainders of integers by what is no constant. naga does not guard them (see
    /// `RUNTIME_CHECKS`), so here is why each divisor is at least 1.
    const DIVISIONS: [&str; 16] = [
        // The share of the whole map's distribution is 1 to 256, and with 256 no number lies beyond it.
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
        let all = [Kernel::Render, Kernel::Learn, Kernel::Train, Kernel::Trace].into_iter();
        for kernel in all.chain(Kernel::OF_SHARING) {
            let features = reachable(|_| true);
            let constants =
                Constants { stack_size: 20, shared_stack_size: 10, ..Constants::default() };
            let source = Program::new(kernel, features, &constants, &ArrayPlaces::default()).source;
            let module = naga::front::wgsl::parse_str(&source).expect("it is valid");
            let entries = module.entry_points.iter().map(|entry| &entry.function);
            for function in module.functions.iter().map(|(_, f)| f).chain(entries) {
                found.extend(integer_divisions(&module, function, &source));
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

    /// Features that a picture can have or not have, each alone.
    fn independent() -> Vec<Features> {
        let none = Features::default();
        let scene = SceneFeatures::all().iter().map(|scene| Features { scene, ..none });
        let view = ViewFeatures::all().iter().map(|view| Features { view, ..none });
        scene.chain(view).collect()
    }

    /// What reachable pictures have: no map to sample without a map, no grid without sampling it.
    fn reachable(on: impl Fn(usize) -> bool) -> Features {
        let (mut scene, mut view) = (SceneFeatures::empty(), ViewFeatures::empty());
        for (_, feature) in independent().into_iter().enumerate().filter(|(i, _)| on(*i)) {
            scene |= feature.scene;
            view |= feature.view;
        }
        for (cause, effect) in [
            (ViewFeatures::MAP, ViewFeatures::MAP_SAMPLING),
            (ViewFeatures::MAP_SAMPLING, ViewFeatures::LIGHT_GRID),
            (ViewFeatures::LIGHT_GRID | ViewFeatures::RECORD_RATIO, ViewFeatures::COUNTING),
        ] {
            if !view.contains(cause) {
                view -= effect;
            }
        }
        for (cause, effect) in [
            (SceneFeatures::SOLID_TRANSMISSION, SceneFeatures::DISPERSION),
            (SceneFeatures::SOLID_TRANSMISSION, SceneFeatures::CLEAR_SOLIDS),
            (SceneFeatures::TEXTURES, SceneFeatures::NORMAL_MAPS),
        ] {
            if !scene.contains(cause) {
                scene -= effect;
            }
        }
        let features = Features { scene, view, ..Features::default() };
        if !features.scene_lights() {
            view -= ViewFeatures::LOCAL_LIGHTS;
        }
        Features { view, ..features }
    }

    /// Each feature alone and all but it, and 60 random sets, in which every combination of two
    /// features occurs (a pair is missed with a probability of 3e-8).
    #[test]
    fn every_variant_validates() {
        let count = independent().len();
        let mut sets = vec![reachable(|_| false), reachable(|_| true)];
        for one in 0..count {
            sets.push(reachable(|i| i == one));
            sets.push(reachable(|i| i != one));
        }
        for seed in 0..60_u32 {
            let half = |at| u64::from(crate::sampler::hash(2 * seed + at));
            let bits = half(1) << 32 | half(2);
            sets.push(reachable(|i| bits >> i & 1 == 1));
        }
        let in_textures = ArrayPlaces { width_log2: 12, ..ArrayPlaces::default() };
        let in_buffers = ARRAYS.map(|array| array.name).into();
        let in_buffers = ArrayPlaces { in_buffers, ..in_textures.clone() };
        for (features, number) in sets.into_iter().zip(0..) {
            let places = if number % 2 == 0 { &in_textures } else { &in_buffers };
            validate(Kernel::Render, features, places);
            if features.view.contains(ViewFeatures::LIGHT_GRID) {
                validate(Kernel::Learn, features, places);
            }
            if features.view.contains(ViewFeatures::RADIANCE_CACHE) {
                validate(Kernel::Train, features, places);
            }
            for kernel in Kernel::OF_SHARING {
                validate(kernel, features, places);
            }
            for kernel in Kernel::OF_QUEUE {
                if kernel != Kernel::FollowShadows || features.shadow_rays() {
                    validate(kernel, features, places);
                }
            }
            validate(Kernel::ClosestHits, features, places);
            validate(Kernel::ShadowRays, features, places);
            let with_rays = Features { kernel: KernelFeatures::HARDWARE_RAYS, ..features };
            validate(Kernel::Render, with_rays, places);
        }
    }
}
