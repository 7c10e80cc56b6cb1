//! `lightgrid bench`.

use std::path::PathBuf;

use super::choices::SceneArguments;
use super::picture::{check_output, say_written};
use super::progress::Progress;
use super::{interrupt, render, values};
use crate::bench::{Options, Subject, run as measure};
use crate::environment::{Environment, EnvironmentOptions};
use crate::error::{At as _, Error, Result};
use crate::output::record::write_json;
use crate::path::World;
use crate::render::Sharing;
use crate::render::gpu::{RayChoice, Schedule, adapters};
use crate::report::Device;
use crate::scene::builtin;
use crate::terminal::print;

/// Arguments of `bench`.
#[derive(Debug, clap::Args)]
#[command(
    allow_negative_numbers = true,
    after_help = "Rays are traced alone, the same ones on every device: through each pixel \
(primary), from where they end to the map (shadow), and as a matte surface spreads light (diffuse). \
Paths are what `render` does. `pass` is a pass on the clock, `device` what of it the device was at \
work; `distributions` and `picture` are the seconds until there are any, compiling included; \
`to stop` is how long a device goes on when told to stop, `to turn` the wait for a small picture after the \
camera was turned."
)]
pub(super) struct BenchArguments {
    /// Scenes: glTF files or built-in ones; without any, all that are built in.
    scenes: Vec<String>,
    #[command(flatten)]
    of_scene: SceneArguments,
    /// The map.
    #[arg(long, default_value = "sky:day", value_name = "MAP")]
    env: String,
    /// Devices; without it, the CPU and, if there is one, the best GPU.
    #[arg(long, value_delimiter = ',')]
    device: Vec<Device>,
    /// The GPU whose name or backend contains this; `lightgrid devices` lists them.
    #[arg(long, value_name = "NAME")]
    adapter: Option<String>,
    /// What finds the surfaces that rays hit on a GPU.
    #[arg(long, default_value = "auto")]
    rays: RayChoice,
    /// How a GPU's kernels share the work: one does all, or three take turns; without it, what suits the GPU.
    /// The picture is the same. Where pixels share vertices, kernels always take turns.
    #[arg(long)]
    schedule: Option<Schedule>,
    /// Whether pixels of a tile share what their paths find, as `render` does, or not, as the window does.
    #[arg(long, default_value = "auto", value_name = "off|4x4|8x8|auto")]
    sharing: Sharing,
    /// Picture size in pixels; without it, 1920x1080 with a real GPU, else 640x360.
    #[arg(long, value_parser = values::size, allow_hyphen_values = true, value_name = "WxH")]
    size: Option<(u32, u32)>,
    /// Seconds of rendering a scene on a device.
    #[arg(long, default_value = "3", value_parser = values::positive, value_name = "S")]
    seconds: f64,
    /// Threads; 0 uses every core.
    #[arg(long, default_value = "0", value_parser = values::whole::<u16>(0..=1024), value_name = "N")]
    threads: u16,
    /// Writes every figure as JSON.
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
}

/// Measures and prints.
pub(super) fn run(arguments: &BenchArguments) -> Result<()> {
    if let Some(file) = &arguments.json {
        check_output(file, arguments.scenes.iter().chain([&arguments.env]))?;
    }
    if arguments.adapter.is_some() && arguments.device == [Device::Cpu] {
        return Err(Error::new("--adapter and --device cpu exclude each other"));
    }
    render::start_threads(arguments.threads)?;
    let mut devices = arguments.device.clone();
    let adapters = adapters();
    if devices.is_empty() {
        devices.push(Device::Cpu);
        if arguments.adapter.is_some() || !adapters.is_empty() {
            devices.push(Device::Gpu);
        }
    }
    let has_real_gpu = devices.contains(&Device::Gpu)
        && adapters.iter().any(|adapter| {
            adapter.is_called(arguments.adapter.as_deref()) && !adapter.is_software()
        });
    let suitable_size = if has_real_gpu { (1920, 1080) } else { (640, 360) };
    let interrupt = interrupt::Interrupt::watch("stopping after this scene");
    let progress = Progress::start("loading");
    let names: Vec<&str> = if arguments.scenes.is_empty() {
        builtin::names().to_vec()
    } else {
        arguments.scenes.iter().map(String::as_str).collect()
    };
    let (map, notices) = crate::sources::map(&arguments.env)?;
    notices.iter().for_each(|sentence| progress.tell(&format!("notice: {sentence}")));
    let environment = Environment::new(map, &EnvironmentOptions::default()).at(&arguments.env)?;
    let subject = |name: &&str| {
        let world = World::new(crate::sources::scene_with(name, &arguments.of_scene.options())?);
        Ok(Subject { name: (*name).to_owned(), world, environment: environment.clone() })
    };
    let subjects = names.iter().map(subject).collect::<Result<Vec<_>>>()?;
    let options = Options {
        devices,
        adapter: arguments.adapter.clone(),
        rays: arguments.rays,
        schedule: arguments.schedule,
        sharing: arguments.sharing,
        size: arguments.size.unwrap_or(suitable_size),
        seconds: arguments.seconds,
    };
    interrupt.keep();
    let bench = measure(&options, &subjects, &interrupt.asked, &|doing| progress.say(doing))?;
    progress.finish();
    if let Some(file) = &arguments.json {
        write_json(file, &bench)?;
        say_written(file);
    }
    print(bench.to_string().trim_end())?;
    if interrupt.was_signalled() { Err(Error::new("stopped before the end")) } else { Ok(()) }
}
