//! The shaders' source: files, lines and bindings that a scene does not need are left out.
//!
//! A line `//#if NAME` keeps what follows, up to `//#else` or `//#end`, only if the feature is on.

use std::collections::BTreeSet;
use std::fmt::Write as _;

use super::super::filter::PixelFilter;
use super::super::{Sampling, View};
use crate::environment::{Environment, Lookup, TableKind};
use crate::path::World;

/// Entry points.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Kernel {
    /// Adds samples to pixels.
    Render,
    /// Traces learning paths.
    Learn,
}

impl Kernel {
    /// Name of the entry point.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Render => "render",
            Self::Learn => "learn",
        }
    }
}

/// What a shader is built with, by name.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub(crate) struct Features(BTreeSet<&'static str>);

impl Features {
    /// All names a shader asks for.
    pub(crate) const ALL: [&'static str; 32] = [
        "alpha_mask",
        "clearcoat",
        "emitters",
        "faces",
        "filtered_hits",
        "learning",
        "layers",
        "lens",
        "light_grid",
        "local_lights",
        "map",
        "map_sampling",
        "metals",
        "nearest_lookup",
        "normal_maps",
        "partial",
        "pass_through",
        "punctual_lights",
        "record_cosine",
        "scene_lights",
        "shadow_rays",
        "single_sided",
        "solid_transmission",
        "summed_area",
        "table_f32",
        "table_f64",
        "table_u32",
        "textures",
        "transmission",
        "unlit",
        "vertex_colors",
        "wide_filter",
    ];

    /// What a picture needs: the scene's materials and lights, the map, how it is sampled.
    pub(crate) fn of(world: &World, environment: &Environment, view: &View) -> Self {
        let needs = &world.needs;
        let samples_map = view.sampling != Sampling::Bsdf && !environment.is_black();
        let learns = matches!(view.sampling, Sampling::Adaptive | Sampling::Talk);
        let options = environment.kind();
        Self::from_names([
            ("alpha_mask", needs.alpha_mask),
            ("clearcoat", needs.clearcoat),
            ("emitters", needs.emitters),
            ("faces", view.sampling == Sampling::Adaptive),
            ("layers", view.layers),
            ("lens", view.camera.lens_radius > 0.0),
            ("light_grid", samples_map && learns),
            ("local_lights", !world.lights.is_empty()),
            ("map", !environment.is_black()),
            ("map_sampling", samples_map),
            ("metals", needs.metals),
            ("nearest_lookup", options.1 == Lookup::Nearest),
            ("normal_maps", needs.normal_maps),
            ("partial", needs.alpha_blend || needs.thin_transmission),
            ("punctual_lights", needs.punctual_lights),
            ("record_cosine", view.sampling == Sampling::Adaptive),
            ("single_sided", needs.single_sided),
            ("solid_transmission", needs.solid_transmission),
            ("table_f32", options.0 == TableKind::F32),
            ("table_f64", options.0 == TableKind::F64),
            ("table_u32", options.0 == TableKind::U32),
            ("textures", needs.textures),
            ("transmission", needs.thin_transmission || needs.solid_transmission),
            ("unlit", needs.unlit),
            ("vertex_colors", needs.vertex_colors),
            ("wide_filter", view.filter != PixelFilter::Box),
        ])
    }

    /// Features by name, and those that follow from them.
    pub(crate) fn from_names(names: impl IntoIterator<Item = (&'static str, bool)>) -> Self {
        let mut set: BTreeSet<_> =
            names.into_iter().filter(|(_, on)| *on).map(|(n, _)| n).collect();
        let follows: [(&str, &[&str]); 5] = [
            ("filtered_hits", &["alpha_mask", "single_sided"]),
            ("pass_through", &["alpha_mask", "partial"]),
            ("scene_lights", &["emitters", "punctual_lights"]),
            ("shadow_rays", &["map_sampling", "local_lights"]),
            ("summed_area", &["table_f32", "table_f64", "table_u32"]),
        ];
        for (name, causes) in follows {
            if causes.iter().any(|cause| set.contains(cause)) {
                set.insert(name);
            }
        }
        Self(set)
    }

    /// The same for a kernel.
    fn in_kernel(&self, kernel: Kernel) -> Self {
        let mut set = self.0.clone();
        if kernel == Kernel::Learn {
            set.insert("learning");
            set.remove("layers");
        }
        Self(set)
    }

    /// Whether a feature is on.
    pub(crate) fn has(&self, name: &str) -> bool {
        debug_assert!(Self::ALL.contains(&name), "{name} is no feature");
        self.0.contains(name)
    }

    /// Names of the features that are on.
    pub(crate) fn names(&self) -> impl Iterator<Item = &'static str> {
        self.0.iter().copied()
    }
}

/// Numbers of a shader that are known when it is built.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Constants {
    /// Groups of nodes the traversal may have to remember.
    pub(crate) stack_size: u32,
    /// Words of `tables` at which each begins.
    pub(crate) srgb_at: u32,
    pub(crate) albedo_at: u32,
    pub(crate) filter_at: u32,
    pub(crate) rows_at: u32,
}

/// How a buffer is bound.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Access {
    Read,
    ReadWrite,
}

/// One binding of a kernel, in order.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Binding {
    /// Name of the variable and of the buffer.
    pub(crate) name: String,
    pub(crate) access: Access,
    element: &'static str,
}

/// An array that may be too large for one binding.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct SplitArray {
    /// Name of the function that reads an element.
    pub(crate) name: &'static str,
    /// Bindings it takes, at least one.
    pub(crate) chunks: u32,
    /// Elements in every chunk but the last.
    pub(crate) chunk_elements: u32,
}

/// Names, WGSL element types and bytes of the arrays that may be split.
pub(crate) const SPLIT_ARRAYS: [(&str, &str, usize); 6] = [
    ("bvh_nodes", "vec4u", 16),
    ("bvh_triangles", "vec4f", 16),
    ("geometry", "u32", 4),
    ("texels", "u32", 4),
    ("map_texels", "vec2u", 8),
    ("sums", "u32", 4),
];

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
        arrays: &[SplitArray],
    ) -> Self {
        let features = features.in_kernel(kernel);
        let bindings = bindings(kernel, &features, arrays);
        let mut source = String::new();
        let Constants { stack_size, srgb_at, albedo_at, filter_at, rows_at } = constants;
        for (name, value) in [
            ("STACK_SIZE", stack_size),
            ("SRGB_AT", srgb_at),
            ("ALBEDO_AT", albedo_at),
            ("FILTER_AT", filter_at),
            ("ROWS_AT", rows_at),
        ] {
            let _ = writeln!(source, "const {name} = {value}u;");
        }
        for (index, binding) in bindings.iter().enumerate() {
            let Binding { name, access, element } = binding;
            let space = match access {
                Access::Read => "storage, read",
                Access::ReadWrite => "storage, read_write",
            };
            let _ = writeln!(source, "@group(0) @binding({index}) var<{space}> {name}: {element};");
        }
        for array in arrays.iter().filter(|array| is_needed(array.name, &features)) {
            source.push_str(&accessor(array));
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
fn files(kernel: Kernel, features: &Features) -> [(&'static str, bool); 18] {
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
        (wgsl!("bsdf"), true),
        (wgsl!("light_grid"), true),
        (wgsl!("environment"), true),
        (wgsl!("tile_local"), samples_map && !features.has("summed_area")),
        (wgsl!("summed_area"), samples_map && features.has("summed_area")),
        (wgsl!("lights"), features.has("scene_lights")),
        (wgsl!("bvh"), true),
        (wgsl!("camera"), true),
        (wgsl!("path"), true),
        (wgsl!("render"), kernel == Kernel::Render),
        (wgsl!("learn"), kernel == Kernel::Learn),
    ]
}

fn is_needed(array: &str, features: &Features) -> bool {
    match array {
        "texels" => features.has("textures"),
        "map_texels" => features.has("map"),
        "sums" => features.has("map_sampling"),
        _ => true,
    }
}

fn bindings(kernel: Kernel, features: &Features, arrays: &[SplitArray]) -> Vec<Binding> {
    let learns = kernel == Kernel::Learn;
    use Access::{Read, ReadWrite};
    let mut bindings: Vec<Binding> = [
        // Not a uniform: software Vulkan optimises a shader anew, for 40 ms, before each dispatch if
        // it branches on uniforms.
        ("globals", Read, "Globals", true),
        ("materials", Read, "array<Material>", true),
        ("tables", Read, "array<f32>", true),
        ("texture_refs", Read, "array<TextureRef>", features.has("textures")),
        ("laws", Read, "array<u32>", features.has("map_sampling")),
        ("lights", Read, "array<u32>", features.has("scene_lights")),
        ("film", ReadWrite, "array<PixelSums>", !learns),
        ("surfaces", ReadWrite, "array<FirstHit>", features.has("layers")),
        ("visits", ReadWrite, "array<atomic<u32>>", learns),
        ("counters", ReadWrite, "array<atomic<u32>>", learns),
        ("slot_of_cell", Read, "array<u32>", learns),
        ("learning_rays", ReadWrite, "atomic<u32>", learns),
    ]
    .into_iter()
    .filter(|(.., is_needed)| *is_needed)
    .map(|(name, access, element, _)| Binding { name: name.to_owned(), access, element })
    .collect();
    for array in arrays.iter().filter(|array| is_needed(array.name, features)) {
        let element = match element_of(array.name) {
            "vec4u" => "array<vec4u>",
            "vec4f" => "array<vec4f>",
            "vec2u" => "array<vec2u>",
            _ => "array<u32>",
        };
        bindings.extend((0..array.chunks).map(|chunk| Binding {
            name: chunk_name(array.name, chunk),
            access: Read,
            element,
        }));
    }
    bindings
}

/// Name of one binding of a split array.
pub(crate) fn chunk_name(array: &str, chunk: u32) -> String {
    format!("{array}_{chunk}")
}

fn element_of(array: &str) -> &'static str {
    SPLIT_ARRAYS.iter().find(|(name, ..)| *name == array).map_or("u32", |(_, element, _)| element)
}

/// The function that reads an element, whichever binding it lies in.
fn accessor(array: &SplitArray) -> String {
    let SplitArray { name, chunks, chunk_elements } = *array;
    let mut function = format!("fn {name}(index: u32) -> {} {{\n", element_of(name));
    for chunk in 1..chunks {
        let end = u64::from(chunk) * u64::from(chunk_elements);
        let start = end - u64::from(chunk_elements);
        let _ = writeln!(
            function,
            "    if index < {end}u {{ return {name}_{}[index - {start}u]; }}",
            chunk - 1
        );
    }
    let start = u64::from(chunks - 1) * u64::from(chunk_elements);
    let _ = writeln!(function, "    return {name}_{}[index - {start}u];\n}}", chunks - 1);
    function
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

    const CONSTANTS: Constants =
        Constants { stack_size: 20, srgb_at: 0, albedo_at: 256, filter_at: 2368, rows_at: 2625 };

    fn validate(kernel: Kernel, features: &Features, chunks: u32) {
        let arrays =
            SPLIT_ARRAYS.map(|(name, ..)| SplitArray { name, chunks, chunk_elements: 1 << 20 });
        let program = Program::new(kernel, features, &CONSTANTS, &arrays);
        let names: Vec<_> = features.names().collect();
        let module = naga::front::wgsl::parse_str(&program.source)
            .unwrap_or_else(|e| panic!("{names:?}: {}", e.emit_to_string(&program.source)));
        let mut validator = naga::valid::Validator::new(
            naga::valid::ValidationFlags::all(),
            naga::valid::Capabilities::empty(),
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

    /// Features that a picture can have or not have on their own; the others follow from them.
    fn independent() -> Vec<&'static str> {
        let follow = ["filtered_hits", "pass_through", "scene_lights", "shadow_rays", "learning"];
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
        if !(chosen.contains("emitters") || chosen.contains("punctual_lights")) {
            chosen.remove("local_lights");
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
            let bits = crate::sampler::hash(seed + 1);
            sets.push(reachable(|i| bits >> i & 1 == 1, tables[seed as usize % 4]));
        }
        for (index, features) in sets.iter().enumerate() {
            validate(Kernel::Render, features, 1 + index as u32 % 3);
            if features.has("light_grid") {
                validate(Kernel::Learn, features, 1 + index as u32 % 3);
            }
        }
    }

    #[test]
    fn a_split_array_is_read_from_the_right_chunk() {
        let array = SplitArray { name: "geometry", chunks: 3, chunk_elements: 100 };
        let function = accessor(&array);
        assert!(function.contains("if index < 100u { return geometry_0[index - 0u]; }"));
        assert!(function.contains("if index < 200u { return geometry_1[index - 100u]; }"));
        assert!(function.contains("return geometry_2[index - 200u];"));
    }
}
