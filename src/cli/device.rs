//! Which device renders, and `lightgrid devices`.

use serde::Serialize;
use serde_json::json;

use crate::environment::Environment;
use crate::error::{Error, Notices, Result};
use crate::path::World;
use crate::render::gpu::{Gpu, adapters};
use crate::render::{Session, View};

/// Where to render.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, clap::ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub(super) enum DeviceChoice {
    /// A real GPU if there is one and everything fits on it, else the CPU.
    #[default]
    Auto,
    /// A GPU, be it a software one, or an error.
    Gpu,
    /// The CPU.
    Cpu,
}

/// Arguments of `devices`.
#[derive(Debug, clap::Args)]
pub(super) struct DevicesArguments {
    /// Prints JSON.
    #[arg(long)]
    json: bool,
}

/// Lists the adapters, the one that is taken first.
pub(super) fn run(arguments: &DevicesArguments) -> Result<()> {
    let adapters = adapters();
    if arguments.json {
        println!("{}", json!(adapters));
        return Ok(());
    }
    if adapters.is_empty() {
        println!("no GPU: neither Vulkan, Metal, DX12 nor OpenGL has an adapter; the CPU renders");
    }
    for adapter in &adapters {
        println!("{}", adapter.name);
        println!("  {}, {}, driver {}", adapter.backend, adapter.kind, adapter.driver);
        println!(
            "  up to {} storage buffers of {} MiB",
            adapter.storage_buffers,
            adapter.storage_binding_bytes >> 20
        );
    }
    Ok(())
}

/// Prints a notice and keeps it for the record.
pub(super) fn say(notices: &mut Notices, sentence: String) {
    eprintln!("notice: {sentence}");
    notices.add(sentence);
}

/// Connects to the GPU that is asked for; `None` is the CPU.
pub(super) fn open(
    choice: DeviceChoice,
    adapter: Option<&str>,
    notices: &mut Notices,
) -> Result<Option<Gpu>> {
    match (choice, adapter) {
        (DeviceChoice::Cpu, Some(name)) => {
            Err(Error::new(format!("--adapter {name} and --device cpu exclude each other")))
        }
        (DeviceChoice::Cpu, None) => Ok(None),
        (DeviceChoice::Gpu, name) | (DeviceChoice::Auto, name @ Some(_)) => {
            Gpu::open(name).map(Some)
        }
        (DeviceChoice::Auto, None) => {
            if adapters().first().is_none_or(|best| best.is_software()) {
                return Ok(None);
            }
            Ok(Gpu::open(None)
                .inspect_err(|failure| say(notices, format!("{failure}; the CPU renders")))
                .ok())
        }
    }
}

/// Starts the session on the GPU, or on the CPU if there is none or, with `auto`, if it does not fit.
pub(super) fn start<'a>(
    choice: DeviceChoice,
    gpu: Option<&'a Gpu>,
    world: &'a World,
    environment: &'a Environment,
    view: View,
    notices: &mut Notices,
) -> Result<Session<'a>> {
    let Some(gpu) = gpu else { return Ok(Session::new(world, environment, view)) };
    match Session::on_gpu(world, environment, view.clone(), gpu) {
        Ok(session) => Ok(session),
        Err(failure) if choice == DeviceChoice::Auto => {
            say(notices, format!("{failure}; the CPU renders"));
            Ok(Session::new(world, environment, view))
        }
        Err(failure) => Err(failure),
    }
}
