//! WGSL functions of the kernels that render and learn against their Rust twins, on the device at hand.
//!
//! A [`Probe`] is a few lines of WGSL that read the words of a case, call functions of the shaders and
//! write what they return; its twin reads the same words and says what is right and how near the
//! device must come. The shaders are put together as for rendering, and the probes added to them, so
//! that what runs is what renders. Helpers are compared through those that call them;
//! [`no_function_is_left_out`] sees to it that all are.
//!
//! Bounds were measured on software Vulkan (llvmpipe), where two thirds are taken up at most, save
//! for whole paths. It computes most functions bit by bit as the CPU does; their bounds of some units
//! in the last place are for devices that divide and take roots otherwise, as WGSL allows. GPUs also fuse
//! products with sums, which changes more where terms cancel: [`OF_GPUS`] was measured on an H200.
//! `cargo test gpu::parity -- --nocapture` prints how much of its bound each probe takes up.

mod cases;
pub(super) mod fixture;
mod functions;
mod layouts;
mod map;
mod media;
mod scattering;
mod surfaces;
mod twin;

use std::collections::BTreeSet;

use super::features::Features;
use super::kernel::Kernel;
use super::kernel_cache::Pipeline;
use super::layout::Work;
use super::shader::{ArrayPlaces, Binding, Constants, Program};
use super::texels::VertexTexels;
use super::{Gpu, Renderer, UploadedScene};
use fixture::Fixture;
use twin::Twin;

/// Words of a case, and of its answer.
const STRIDE: usize = 64;
/// What an answer is filled with beforehand.
const UNTOUCHED: u32 = 0xdead_beef;

/// What a device may do otherwise than its twin.
#[derive(Debug, Clone, Copy)]
struct Tolerance {
    /// So many times a [`twin::Bound`].
    bounds: f32,
    /// One case in so many may be decided otherwise, whatever the probe allows.
    share_of_flips: usize,
}

/// Of software.
const OF_SOFTWARE: Tolerance = Tolerance { bounds: 1.0, share_of_flips: usize::MAX };
/// Of GPUs: 7.8 times a bound and one case in 59 (rays towards corners) were seen, and cases that
/// are nothing but rounding: a triangle without area, Fresnel's equations where nothing is refracted.
const OF_GPUS: Tolerance = Tolerance { bounds: 12.0, share_of_flips: 40 };

/// WGSL that runs with every case, and the same in Rust.
struct Probe<'a> {
    name: &'static str,
    body: &'static str,
    cases: Vec<Vec<u32>>,
    /// Cases that may come out otherwise, for a decision in them hangs on the last bit.
    flips: usize,
    twin: Box<dyn Fn(&mut Twin<'_>) + 'a>,
}

impl<'a> Probe<'a> {
    fn new(
        name: &'static str,
        body: &'static str,
        cases: Vec<Vec<u32>>,
        twin: impl Fn(&mut Twin<'_>) + 'a,
    ) -> Self {
        assert!(cases.iter().all(|case| case.len() <= STRIDE), "{name}: cases are short");
        Self { name, body, cases, flips: 0, twin: Box::new(twin) }
    }

    /// Allows one case in `share` to come out otherwise.
    fn flips(mut self, share: usize) -> Self {
        self.flips = self.cases.len() / share;
        self
    }

    /// Compares the device's answers; `Err` says what was wrong first.
    fn compare(&self, answers: &[u32], tolerance: Tolerance) -> Result<String, String> {
        let (mut worst, mut wrong) = (0.0_f32, Vec::new());
        for (case, answer) in self.cases.iter().zip(answers.chunks_exact(STRIDE)) {
            let mut twin = Twin::new(case, answer, tolerance.bounds);
            (self.twin)(&mut twin);
            match twin.finish() {
                Ok(share) => worst = worst.max(share),
                Err(complaint) => wrong.push(complaint),
            }
        }
        let Self { name, cases, flips, .. } = self;
        let count = cases.len();
        let summary =
            format!("{name}: {count} cases, {} flips, {worst:.2} of the bound", wrong.len());
        if wrong.len() <= (*flips).max(count / tolerance.share_of_flips) {
            return Ok(summary);
        }
        let some: String = wrong.iter().take(4).map(|w| format!("\n    {w}")).collect();
        Err(format!("{name}: {} of {count} cases are wrong{some}", wrong.len()))
    }
}

/// How probes read and write. Words of a case follow one another, as do those of its answer.
const PRELUDE: &str = "
var<private> read_at: u32;
var<private> write_at: u32;
fn take_word() -> u32 { read_at += 1u; return probe_cases[read_at - 1u]; }
fn take() -> f32 { return bitcast<f32>(take_word()); }
fn take2() -> vec2f { let x = take(); return vec2f(x, take()); }
fn take3() -> vec3f { let xy = take2(); return vec3f(xy, take()); }
fn take4() -> vec4f { let xyz = take3(); return vec4f(xyz, take()); }
fn put_word(word: u32) { probe_answers[write_at] = word; write_at += 1u; }
fn put_bool(value: bool) { put_word(select(0u, 1u, value)); }
fn put(value: f32) { put_word(bitcast<u32>(value)); }
fn put2(value: vec2f) { put(value.x); put(value.y); }
fn put3(value: vec3f) { put2(value.xy); put(value.z); }
fn put4(value: vec4f) { put3(value.xyz); put(value.w); }
";

/// Adds probes to a program, whose entry point is then `probe`. `Work::first` says which one runs.
fn with_probes(mut program: Program, preludes: &[&str], probes: &[Probe<'_>]) -> Program {
    for (name, is_written) in [("probe_cases", false), ("probe_answers", true)] {
        let access = if is_written { "read_write" } else { "read" };
        let (index, store) = (program.bindings.len(), "array<u32>");
        program.source +=
            &format!("@group(0) @binding({index}) var<storage, {access}> {name}: {store};\n");
        program.bindings.push(Binding::Buffer { name, store, is_written });
    }
    program.source += PRELUDE;
    program.source.extend(preludes.iter().copied());
    let mut choices = String::new();
    for (index, probe) in probes.iter().enumerate() {
        program.source += &format!("fn probe_{index}() {{\n{}\n}}\n", probe.body);
        choices += &format!("        case {index}u: {{ probe_{index}(); }}\n");
    }
    program.source += &format!(
        "@compute @workgroup_size(64)
fn probe(
    @builtin(global_invocation_id) id: vec3u,
    @builtin(local_invocation_index) lane: u32,
) {{
    own_lane = lane;
    if id.x >= globals.work.count {{
        return;
    }}
    read_at = id.x * {STRIDE}u;
    write_at = read_at;
    switch globals.work.first {{
{choices}        default: {{}}
    }}
}}
"
    );
    program
}

/// Where arrays and stacks lie.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Places {
    /// Where the device wants them.
    Usual,
    /// Arrays in storage buffers, and most of a walk's stack in a lane's own memory.
    Other,
}

/// Runs probes on a fixture's scene and map and compares; prints a line a probe.
fn run(fixture: &Fixture, preludes: &[&str], probes: &[Probe<'_>], places: Places) {
    let Some(mut gpu) = Gpu::for_test() else { return };
    if places == Places::Other {
        gpu = gpu.with_arrays_in_buffers();
    }
    let Fixture { world, environment, view, grid, .. } = fixture;
    let mut uploaded = UploadedScene::new(&gpu, world, environment).expect("it fits");
    if places == Places::Other {
        uploaded.constants.shared_stack_size = 1;
        assert!(uploaded.constants.stack_size > 1, "the tree is deep enough");
    }
    let mut renderer =
        Renderer::with_kernel(&uploaded, (world, environment), view, |gpu, program| {
            Pipeline::new(gpu, "probe", with_probes(program, preludes, probes))
        })
        .expect("it compiles");
    renderer.set_grid(Some(grid)).expect("it fits");
    let tolerance = if gpu.facts().is_software() { OF_SOFTWARE } else { OF_GPUS };
    let mut complaints = Vec::new();
    for (index, probe) in probes.iter().enumerate() {
        match probe.compare(&ask(&mut renderer, index, probe), tolerance) {
            Ok(line) => eprintln!("{line}"),
            Err(complaint) => complaints.push(complaint),
        }
    }
    assert!(complaints.is_empty(), "{}:\n{}", gpu.facts().name, complaints.join("\n"));
}

/// The device's answers to all cases of a probe.
fn ask(renderer: &mut Renderer, index: usize, probe: &Probe<'_>) -> Vec<u32> {
    let mut words = vec![0_u32; probe.cases.len() * STRIDE];
    for (words, case) in words.chunks_exact_mut(STRIDE).zip(&probe.cases) {
        words[..case.len()].copy_from_slice(case);
    }
    let untouched = vec![UNTOUCHED; words.len()];
    let on = &mut renderer.dispatcher;
    on.buffers.put("probe_cases", bytemuck::cast_slice(&words), "cases").expect("it fits");
    on.buffers.put("probe_answers", bytemuck::cast_slice(&untouched), "answers").expect("it fits");
    let count = probe.cases.len() as u32;
    let work = Work { first: index as u32, count, ..Work::default() };
    on.dispatch(&[Kernel::Render], &work, (1, count.div_ceil(64)), 1, None).expect("it runs");
    on.read_words("probe_answers", words.len()).expect("it can be read")
}

/// A fixture, what its probes' WGSL shares, and the probes.
type Group<'a> = (&'a Fixture, &'static [&'static str], Vec<Probe<'a>>);

/// All probes: most on a scene with everything, some with other maps, cells and cameras.
fn groups(fixtures: &[Fixture]) -> Vec<Group<'_>> {
    let mut groups: Vec<Group<'_>> = vec![
        (&fixtures[0], &[], functions::probes(&fixtures[0])),
        (&fixtures[0], &[scattering::PRELUDE], scattering::probes()),
        (&fixtures[0], &[scattering::PRELUDE], surfaces::probes(&fixtures[0])),
        (&fixtures[0], &[], surfaces::path_probes(&fixtures[0])),
        (&fixtures[0], &[], media::probes(&fixtures[0])),
        (&fixtures[0], &[], map::probes(&fixtures[0])),
    ];
    groups.extend(fixtures[1..4].iter().map(|fixture| (fixture, &[][..], map::of_view(fixture))));
    let large = fixtures[4..6].iter();
    groups.extend(large.map(|fixture| (fixture, &[][..], map::samples(&fixture.environment))));
    let prelude = &[scattering::PRELUDE];
    groups.push((&fixtures[6], prelude, surfaces::probes(&fixtures[6])));
    groups.push((&fixtures[6], &[], surfaces::path_probes(&fixtures[6])));
    groups
}

macro_rules! run_group {
    ($($test:ident: $group:literal, $places:ident;)*) => {$(
        #[test]
        fn $test() {
            let fixtures = fixture::all();
            let (fixture, preludes, probes) = groups(&fixtures).swap_remove($group);
            run(fixture, preludes, &probes, Places::$places);
        }
    )*};
}

run_group! {
    numbers_cameras_and_samplers: 0, Usual;
    scattering_of_materials: 1, Usual;
    surfaces_lights_and_hits: 2, Usual;
    whole_paths: 3, Usual;
    media_between_surfaces: 4, Usual;
    map_cells_and_distributions: 5, Usual;
    cells_of_the_talk: 6, Usual;
    cells_and_a_parallel_camera: 7, Usual;
    no_cells: 8, Usual;
    widest_map: 9, Usual;
    tallest_map: 10, Usual;
    // These two read all arrays.
    surfaces_lights_and_hits_in_other_places: 2, Other;
    map_in_other_places: 5, Other;
    instances: 11, Usual;
    instances_in_other_places: 11, Other;
    whole_paths_among_instances: 12, Usual;
}

/// The source of a fixture's kernel; the numbers in it do not matter here.
fn program_of(fixture: &Fixture, kernel: Kernel) -> Program {
    let features = Features::of(&fixture.world, &fixture.environment, &fixture.view);
    let vertex = VertexTexels::of(features);
    let constants =
        Constants { stack_size: 20, shared_stack_size: 10, vertex, ..Constants::default() };
    Program::new(kernel, features, &constants, &ArrayPlaces::default())
}

/// Functions whose effect is no return value: entry points, and what looks at the map to count,
/// which `both_devices_learn_the_same_counters` and the tests of pictures compare.
const COMPARED_ELSEWHERE: [&str; 6] =
    ["add_to_film", "learn", "look_at_map", "path_anywhere", "pixel_in_tile", "render"];

/// Whatever those two kernels define runs in some probe. What only others have is compared by the pictures,
/// counters and hits that come of it.
#[test]
fn no_function_is_left_out() {
    let fixtures = fixture::all();
    let (mut defined, mut reached) = (BTreeSet::new(), BTreeSet::new());
    for fixture in &fixtures {
        for kernel in [Kernel::Render, Kernel::Learn] {
            let source = program_of(fixture, kernel).source;
            let names = source.lines().filter_map(|line| line.strip_prefix("fn "));
            defined.extend(names.map(|rest| rest.split('(').next().unwrap_or(rest).to_owned()));
        }
    }
    for (fixture, preludes, probes) in groups(&fixtures) {
        let source = with_probes(program_of(fixture, Kernel::Render), preludes, &probes).source;
        let module = naga::front::wgsl::parse_str(&source)
            .unwrap_or_else(|e| panic!("{}", e.emit_to_string(&source)));
        let probe = module.entry_points.iter().find(|e| e.name == "probe").expect("it is there");
        let mut waiting = calls(&probe.function.body);
        let mut seen = BTreeSet::new();
        while let Some(function) = waiting.pop() {
            if seen.insert(function) {
                let function = &module.functions[function];
                reached.extend(function.name.clone());
                waiting.extend(calls(&function.body));
            }
        }
    }
    let left: Vec<_> = defined.difference(&reached).map(String::as_str).collect();
    assert_eq!(left, COMPARED_ELSEWHERE);
}

/// Functions that a block calls.
fn calls(block: &naga::Block) -> Vec<naga::Handle<naga::Function>> {
    use naga::Statement;
    let mut found = Vec::new();
    for statement in block {
        match statement {
            Statement::Call { function, .. } => found.push(*function),
            Statement::Block(block) => found.extend(calls(block)),
            Statement::If { accept, reject, .. } => {
                found.extend(calls(accept));
                found.extend(calls(reject));
            }
            Statement::Switch { cases, .. } => {
                found.extend(cases.iter().flat_map(|case| calls(&case.body)));
            }
            Statement::Loop { body, continuing, .. } => {
                found.extend(calls(body));
                found.extend(calls(continuing));
            }
            _ => {}
        }
    }
    found
}
