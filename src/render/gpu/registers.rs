//! What the kernels of the built-in scenes take on a GPU, against `tests/gpu/registers.txt`.
//!
//! How many waves hide the memory's latency depends on the registers of a kernel, and no GPU is needed
//! to count them: RADV, the driver of Radeons, compiles for a chip it is told of. Without RADV the test
//! says so and is passed over. A kernel is compiled where its source, the driver or the translator is another one
//! than the table's: all of them take minutes.

use std::collections::BTreeMap;
use std::ffi::{CStr, CString};
use std::fmt::Write as _;
use std::path::Path;
use std::process::Command;

use ash::vk;

use super::features::{Features, KernelFeatures, ViewFeatures};
use super::kernel::Kernel;
use super::shader::{ARRAYS, ArrayPlaces, Binding, Constants, Program, SHARED_STACK_SIZE};
use super::texels::VertexTexels;
use crate::digest::Digest;
use crate::path::World;
use crate::scene::builtin;

/// The chip of the table: a Radeon RX 6800 (RDNA2).
const CHIP: &str = "navi21";
/// The table.
const TABLE: &str = include_str!("../../../tests/gpu/registers.txt");
/// Scenes whose kernels take the compiler longer than all others together.
const LONG: [&str; 1] = ["materials"];
/// Compiles those as well.
const ALL: &str = "LIGHTGRID_REGISTERS_ALL";
/// Manifest of RADV, where Debian has it.
const MANIFEST: &str = "/usr/share/vulkan/icd.d/radeon_icd.x86_64.json";
/// Before each line of what the compiling process finds.
const MARK: &str = "kernel: ";

/// The driver's names of the table's columns: registers of a lane, waves that fit a SIMD, registers
/// spilled, bytes of memory a wave spills to, instructions. Less is better but for waves;
/// instructions are for information.
const COLUMNS: [&str; 6] = [
    "VGPRs",
    "Subgroups per SIMD",
    "Spilled SGPRs",
    "Spilled VGPRs",
    "Scratch size",
    "Instructions",
];
/// Follows the names of kernels for paths that end in the radiance cache.
const CACHED: &str = "_cached";
/// The column of waves.
const WAVES: usize = 1;
/// Columns that are held against the table. (Scalar registers are spilled to vector registers.)
const CHECKED: [usize; 4] = [0, WAVES, 3, 4];

/// Columns by scene and kernel, and the digest of what they are found from.
type Table = BTreeMap<(String, String), Vec<u64>>;

fn parse(text: &str) -> Table {
    let lines = text.lines().filter(|line| !line.starts_with('#') && !line.is_empty());
    lines
        .map(|line| {
            let mut words = line.split_whitespace().map(str::to_owned);
            let mut word = || words.next().expect("a scene and a kernel");
            let key = (word(), word());
            (key, words.map(|word| word.parse().expect("a number")).collect())
        })
        .collect()
}

#[test]
fn kernels_of_built_in_scenes_fit_registers() {
    if !Path::new(MANIFEST).exists() {
        return eprintln!("SKIPPED: no RADV at {MANIFEST}");
    }
    // The driver reads its environment when it is loaded; other tests load others.
    let child = Command::new(std::env::current_exe().expect("this program has a path"))
        .args(["--exact", "render::gpu::registers::compile", "--ignored", "--nocapture"])
        .envs([("RADV_FORCE_FAMILY", CHIP), ("VK_ICD_FILENAMES", MANIFEST)])
        .env("VK_DRIVER_FILES", MANIFEST)
        .env("MESA_SHADER_CACHE_DISABLE", "true")
        .output()
        .expect("it starts");
    let output = String::from_utf8_lossy(&child.stdout);
    let errors = String::from_utf8_lossy(&child.stderr);
    if let Some(reason) = errors.lines().find(|line| line.starts_with("SKIPPED")) {
        return eprintln!("{reason}");
    }
    assert!(child.status.success(), "{output}{errors}");
    let lines: String = output
        .lines()
        .filter_map(|line| line.split(MARK).nth(1))
        .flat_map(|line| [line, "\n"])
        .collect();
    eprint!("{lines}");
    let found = parse(&lines);
    let table = parse(TABLE);
    let is_expected = |scene: &str| std::env::var_os(ALL).is_some() || !LONG.contains(&scene);
    let mut worse = Vec::new();
    for (key, limits) in table.iter().filter(|((scene, _), _)| is_expected(scene)) {
        let Some(found) = found.get(key) else {
            worse.push(format!("{key:?} was not compiled"));
            continue;
        };
        for column in CHECKED {
            let (now, limit) = (found[column], limits[column]);
            if if column == WAVES { now < limit } else { now > limit } {
                worse.push(format!("{key:?}: {}: {now}, was {limit}", COLUMNS[column]));
            }
        }
    }
    for key in found.keys().filter(|key| !table.contains_key(*key)) {
        worse.push(format!("{key:?} is not in the table"));
    }
    assert!(worse.is_empty(), "{}\nnow:\n{lines}", worse.join("\n"));
}

/// Compiles kernels that the table does not know with the driver at hand, and prints the table's lines.
#[test]
#[ignore = "the other test runs it in a process with the driver's environment"]
fn compile() {
    let driver = match Driver::open() {
        Ok(driver) => driver,
        Err(reason) => return eprintln!("SKIPPED: RADV cannot be used: {reason}"),
    };
    let known = parse(TABLE);
    let naga =
        include_str!("../../../Cargo.lock").split("name = \"naga\"").nth(1).unwrap_or_default();
    let naga = naga.lines().nth(1).expect("a version");
    for name in builtin::names() {
        let world = World::new(builtin::build(name).expect("built in"));
        let exact = Features { kernel: KernelFeatures::FUSING, ..Features::by_default(&world) };
        let cached = Features { view: exact.view | ViewFeatures::RADIANCE_CACHE, ..exact };
        let of_exact = [Kernel::Render, Kernel::Learn].into_iter().chain(Kernel::OF_QUEUE);
        let of_exact = of_exact.chain(Kernel::OF_SHARING).map(|kernel| (kernel, exact, ""));
        let of_cached = [Kernel::Render, Kernel::Train].map(|kernel| (kernel, cached, CACHED));
        for (kernel, features, suffix) in of_exact.chain(of_cached) {
            let program = program_of(&world, kernel, features);
            let from = Digest::new().bytes(program.source.as_bytes()).bytes(naga.as_bytes());
            let digest = from.debug(&driver.version).value();
            let key = ((*name).to_owned(), format!("{}{suffix}", kernel.name()));
            let mut line = format!("{name:12} {:15}", key.1);
            let known = known.get(&key).filter(|columns| columns.last() == Some(&digest));
            if known.is_none() && LONG.contains(name) && std::env::var_os(ALL).is_none() {
                continue;
            }
            let columns = known.cloned().unwrap_or_else(|| {
                let found = driver.statistics(kernel, &program);
                let columns = COLUMNS.map(|name| found.get(name).copied().unwrap_or(u64::MAX));
                columns.into_iter().chain([digest]).collect()
            });
            for column in columns {
                let _ = write!(line, " {column:6}");
            }
            println!("{MARK}{line}");
        }
    }
}

/// A scene's kernel, with arrays where GPUs have them.
fn program_of(world: &World, kernel: Kernel, features: Features) -> Program {
    // Where the tables begin is of no account, nor is how deep the tree is: none here is deeper.
    let constants = Constants {
        stack_size: SHARED_STACK_SIZE,
        shared_stack_size: SHARED_STACK_SIZE,
        vertex: VertexTexels::of(features),
        textures_in_scene: world.needs.texture_slots,
        tables_at: [0, 4096, 8192, 12288, 16384],
        metres: 1.0_f32.to_bits(),
        shared_tile: None,
    };
    let in_buffers = ARRAYS.map(|array| array.name).into();
    Program::new(kernel, features, &constants, &ArrayPlaces { in_buffers, ..Default::default() })
}

/// A program as SPIR-V, made as wgpu makes it.
fn spirv_of(kernel: Kernel, program: &Program) -> Vec<u32> {
    use naga::back::spv;
    use naga::proc::{BoundsCheckPolicies, BoundsCheckPolicy};
    use naga::valid::{Capabilities, ValidationFlags, Validator};
    let module = naga::front::wgsl::parse_str(&program.source).expect("it is valid");
    let info = Validator::new(ValidationFlags::all(), Capabilities::empty())
        .validate(&module)
        .expect("it is valid");
    let options = spv::Options {
        lang_version: (1, 6),
        bounds_check_policies: BoundsCheckPolicies {
            index: BoundsCheckPolicy::Restrict,
            ..BoundsCheckPolicies::default()
        },
        zero_initialize_workgroup_memory: spv::ZeroInitializeWorkgroupMemoryMode::None,
        force_loop_bounding: false,
        emit_int_div_checks: false,
        ..spv::Options::default()
    };
    let entry = spv::PipelineOptions {
        shader_stage: naga::ShaderStage::Compute,
        entry_point: kernel.name().to_owned(),
    };
    spv::write_vec(&module, &info, &options, Some(&entry)).expect("it can be written")
}

/// A device that compiles. It lasts as long as the process.
struct Driver {
    _entry: ash::Entry,
    instance: ash::Instance,
    device: ash::Device,
    version: u32,
}

impl Driver {
    fn open() -> Result<Self, String> {
        let failed = |e: vk::Result| e.to_string();
        // SAFETY: a Vulkan loader may be loaded.
        let entry = unsafe { ash::Entry::load() }.map_err(|e| e.to_string())?;
        let app = vk::ApplicationInfo::default().api_version(vk::API_VERSION_1_3);
        let info = vk::InstanceCreateInfo::default().application_info(&app);
        // SAFETY: all that `info` points to is alive, and nothing is destroyed before the process.
        let instance = unsafe { entry.create_instance(&info, None) }.map_err(failed)?;
        // SAFETY: as above.
        let adapters = unsafe { instance.enumerate_physical_devices() }.map_err(failed)?;
        let adapter = *adapters.first().ok_or("it has no device")?;
        // SAFETY: as above.
        let version = unsafe { instance.get_physical_device_properties(adapter) }.driver_version;
        let mut statistics = vk::PhysicalDevicePipelineExecutablePropertiesFeaturesKHR::default()
            .pipeline_executable_info(true);
        let mut memory = vk::PhysicalDeviceVulkan12Features::default().vulkan_memory_model(true);
        let enabled = vk::PhysicalDeviceFeatures::default().robust_buffer_access(true);
        let queues = [vk::DeviceQueueCreateInfo::default().queue_priorities(&[1.0])];
        let extensions = [ash::khr::pipeline_executable_properties::NAME.as_ptr()];
        let info = vk::DeviceCreateInfo::default()
            .queue_create_infos(&queues)
            .enabled_extension_names(&extensions)
            .enabled_features(&enabled)
            .push_next(&mut statistics)
            .push_next(&mut memory);
        // SAFETY: as above.
        let device = unsafe { instance.create_device(adapter, &info, None) }.map_err(failed)?;
        Ok(Self { _entry: entry, instance, device, version })
    }

    /// What the driver says of a kernel, by its names.
    fn statistics(&self, kernel: Kernel, program: &Program) -> BTreeMap<String, u64> {
        let device = &self.device;
        let spirv = spirv_of(kernel, program);
        let bindings: Vec<_> = program
            .bindings
            .iter()
            .zip(0..)
            .map(|(binding, index)| {
                assert!(matches!(binding, Binding::Buffer { .. }), "all arrays are in buffers");
                vk::DescriptorSetLayoutBinding::default()
                    .binding(index)
                    .descriptor_type(vk::DescriptorType::STORAGE_BUFFER)
                    .descriptor_count(1)
                    .stage_flags(vk::ShaderStageFlags::COMPUTE)
            })
            .collect();
        let layout = vk::DescriptorSetLayoutCreateInfo::default().bindings(&bindings);
        // SAFETY: all that the descriptions point to is alive while they are read.
        let layout = unsafe { device.create_descriptor_set_layout(&layout, None) }.expect("made");
        let layouts = [layout];
        let layout = vk::PipelineLayoutCreateInfo::default().set_layouts(&layouts);
        // SAFETY: as above.
        let layout = unsafe { device.create_pipeline_layout(&layout, None) }.expect("made");
        let module = vk::ShaderModuleCreateInfo::default().code(&spirv);
        // SAFETY: as above; naga has validated the module.
        let module = unsafe { device.create_shader_module(&module, None) }.expect("made");
        let entry = CString::new(kernel.name()).expect("a name");
        let stage = vk::PipelineShaderStageCreateInfo::default()
            .stage(vk::ShaderStageFlags::COMPUTE)
            .module(module)
            .name(&entry);
        let pipeline = vk::ComputePipelineCreateInfo::default()
            .flags(vk::PipelineCreateFlags::CAPTURE_STATISTICS_KHR)
            .stage(stage)
            .layout(layout);
        // SAFETY: as above.
        let pipeline = unsafe {
            device.create_compute_pipelines(vk::PipelineCache::null(), &[pipeline], None)
        };
        let pipeline = pipeline.expect("it compiles")[0];
        let extension =
            ash::khr::pipeline_executable_properties::Device::new(&self.instance, device);
        let executable = vk::PipelineExecutableInfoKHR::default().pipeline(pipeline);
        // SAFETY: the pipeline was made to capture statistics; a compute pipeline is one executable.
        let found = unsafe { extension.get_pipeline_executable_statistics(&executable) };
        let found = found.expect("there are statistics").into_iter();
        found
            .map(|statistic| {
                // SAFETY: the driver ends names with a zero.
                let name = unsafe { CStr::from_ptr(statistic.name.as_ptr()) };
                // SAFETY: all of RADV's statistics are of this kind.
                let value = unsafe { statistic.value.u64 };
                (name.to_string_lossy().into_owned(), value)
            })
            .collect()
    }
}
