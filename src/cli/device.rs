//! Which device renders, and `lightgrid devices`.

use serde_json::json;

use crate::environment::Environment;
use crate::error::{Error, Notices, Result};
use crate::path::World;
use crate::render::gpu::{DeviceChoice, Gpu, NO_GPU, RayChoice, Schedule, UploadedScene, adapters};
use crate::render::{Session, View};
use crate::terminal::{notice, print};

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
        return print(json!(adapters));
    }
    if adapters.is_empty() {
        print(format_args!("{NO_GPU}; the CPU renders"))?;
    }
    for adapter in &adapters {
        print(&adapter.name)?;
        print(format_args!("  {}, {}, driver {}", adapter.backend, adapter.kind, adapter.driver))?;
        print(format_args!(
            "  up to {} storage buffers of {} MiB, {} ray queries",
            adapter.storage_buffers,
            adapter.storage_binding_bytes >> 20,
            if adapter.has_ray_queries { "with" } else { "without" }
        ))?;
    }
    Ok(())
}

/// Prints a notice and keeps it for the record.
pub(super) fn say(notices: &mut Notices, sentence: String) {
    notice(&sentence);
    notices.add(sentence);
}

/// Connects to the GPU that is asked for; `None` is the CPU.
pub(super) fn open(
    choice: DeviceChoice,
    adapter: Option<&str>,
    (rays, schedule): (RayChoice, Option<Schedule>),
    notices: &mut Notices,
) -> Result<Option<Gpu>> {
    let opened = match choice.open(adapter) {
        Err(failure) if choice == DeviceChoice::Auto && adapter.is_none() => {
            say(notices, format!("{failure}; the CPU renders"));
            None
        }
        opened => opened?,
    };
    match opened {
        Some(gpu) => gpu.with_rays(rays).map(|gpu| Some(gpu.with_schedule(schedule))),
        None if rays == RayChoice::Hardware => {
            Err(Error::new("--rays hardware: the CPU has no ray queries; --device gpu takes a GPU"))
        }
        None => Ok(None),
    }
}

/// Puts scene and map on the GPU, for any number of pictures; `None` if there is none or, with `auto`, if they
/// do not fit.
pub(super) fn upload(
    choice: DeviceChoice,
    gpu: Option<Gpu>,
    (world, environment): (&World, &Environment),
    notices: &mut Notices,
) -> Result<Option<UploadedScene>> {
    let uploaded = gpu.map(|gpu| UploadedScene::new(&gpu, world, environment)).transpose();
    or_without(choice, uploaded, notices)
}

/// Starts the session on the GPU, or on the CPU if nothing is there or, with `auto`, if the picture does not fit.
pub(super) fn start<'a>(
    choice: DeviceChoice,
    uploaded: Option<&UploadedScene>,
    (world, environment): (&'a World, &'a Environment),
    view: View,
    notices: &mut Notices,
) -> Result<Session<'a>> {
    let on_gpu = uploaded.map(|on| Session::on(world, environment, view.clone(), Some(on)));
    let session = or_without(choice, on_gpu.transpose(), notices)?;
    Ok(session.unwrap_or_else(|| Session::new(world, environment, view)))
}

/// With `auto` the CPU renders what a GPU cannot.
fn or_without<T>(
    choice: DeviceChoice,
    outcome: Result<Option<T>>,
    notices: &mut Notices,
) -> Result<Option<T>> {
    match outcome {
        Err(failure) if choice == DeviceChoice::Auto => {
            say(notices, format!("{failure}; the CPU renders"));
            Ok(None)
        }
        outcome => outcome,
    }
}
