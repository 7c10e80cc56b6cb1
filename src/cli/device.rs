//! Which device renders, and `lightgrid devices`.

use serde_json::json;

use crate::error::{Error, Notices, Result};
use crate::render::Session;
use crate::render::gpu::{DeviceChoice, Gpu, NO_GPU, RayChoice, adapters};
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

/// Refuses a GPU that no build without GPU rendering has, before anything is loaded.
pub(super) fn check(choice: DeviceChoice) -> Result<()> {
    if choice == DeviceChoice::Gpu && !cfg!(feature = "gpu") {
        return Err(Error::new(NO_GPU));
    }
    Ok(())
}

/// Prints a notice and keeps it for the record.
pub(super) fn say(notices: &mut Notices, sentence: String) {
    notice(&sentence);
    notices.add(sentence);
}

/// Lets the CPU take over from a GPU that is not there, lacks memory or fails, unless that was asked for by name.
pub(super) struct TakeOver<'a> {
    pub(super) choice: DeviceChoice,
    pub(super) notices: &'a mut Notices,
}

impl TakeOver<'_> {
    /// Connects to the GPU that is asked for; `None` is the CPU.
    pub(super) fn open(&mut self, adapter: Option<&str>, rays: RayChoice) -> Result<Option<Gpu>> {
        let opened = self.choice.open(adapter);
        let opened = if adapter.is_none() { self.renders_instead(opened)? } else { opened? };
        match opened {
            Some(gpu) => gpu.with_rays(rays).map(Some),
            None if rays == RayChoice::Hardware => Err(Error::new(
                "--rays hardware: the CPU has no ray queries; --device gpu takes a GPU",
            )),
            None => Ok(None),
        }
    }

    /// `None` if, with `auto`, the CPU has to render in place of this outcome.
    pub(super) fn renders_instead<T>(&mut self, outcome: Result<Option<T>>) -> Result<Option<T>> {
        self.takes_over(outcome, "renders")
    }

    fn takes_over<T>(&mut self, outcome: Result<Option<T>>, does: &str) -> Result<Option<T>> {
        outcome.or_else(|failure| match self.choice {
            DeviceChoice::Auto => {
                say(self.notices, format!("{failure}; the CPU {does}"));
                Ok(None)
            }
            _ => Err(failure),
        })
    }

    /// `None` if, with `auto`, the CPU has to go on in place of this outcome.
    pub(super) fn goes_on<T>(
        &mut self,
        session: &mut Session<'_>,
        outcome: Result<T>,
    ) -> Result<Option<T>> {
        let outcome = self.takes_over(outcome.map(Some), "goes on")?;
        if outcome.is_none() {
            session.continue_on_cpu();
        }
        Ok(outcome)
    }
}
