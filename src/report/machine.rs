//! The machine and the devices that measurements are made on.

use std::fs;

use serde::{Deserialize, Serialize};

use super::plan::Device;
use crate::digest::Digest;
use crate::error::Result;
use crate::render::SAMPLES_VERSION;
use crate::render::gpu::Gpu;

/// The machine, in words.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Machine {
    /// Processor's name.
    pub processor: String,
    /// Threads that render.
    pub threads: usize,
    /// Operating system and architecture.
    pub system: String,
    /// lightgrid's version and how it was built.
    pub build: String,
    /// Mean number of other processes that wanted to run during the minute before.
    pub load: Option<f64>,
}

impl Machine {
    /// This one, now.
    pub fn here() -> Self {
        let optimised = if cfg!(debug_assertions) { "development build" } else { "release build" };
        let version = env!("CARGO_PKG_VERSION");
        let loads = fs::read_to_string("/proc/loadavg");
        Self {
            processor: processor(),
            threads: rayon::current_num_threads(),
            system: format!("{} {}", std::env::consts::OS, std::env::consts::ARCH),
            build: format!(
                "lightgrid {version}, {optimised}, samples of version {SAMPLES_VERSION}"
            ),
            load: loads.ok().and_then(|text| text.split_whitespace().next()?.parse().ok()),
        }
    }

    /// Digest of all that timings depend on: this machine and this executable's bytes.
    pub(super) fn digest(&self) -> Digest {
        let executable = std::env::current_exe().and_then(fs::read).unwrap_or_default();
        Digest::new()
            .debug(&(&self.processor, self.threads, &self.system, &self.build))
            .bytes(&executable)
    }
}

/// The processor's name, as it says itself.
fn processor() -> String {
    #[cfg(target_arch = "x86_64")]
    {
        use std::arch::x86_64::__cpuid;
        /// CPUID leaf whose `eax` is the highest extended leaf.
        const LAST: u32 = 0x8000_0000;
        /// First of three leaves with the name ("Processor Brand String" of Intel's and AMD's manuals).
        const NAME: u32 = 0x8000_0002;
        if __cpuid(LAST).eax >= NAME + 2 {
            let leaves = (NAME..NAME + 3).map(__cpuid);
            let words = leaves.flat_map(|leaf| [leaf.eax, leaf.ebx, leaf.ecx, leaf.edx]);
            let bytes: Vec<u8> = words.flat_map(u32::to_le_bytes).collect();
            return String::from_utf8_lossy(&bytes).trim_end_matches('\0').trim().to_owned();
        }
    }
    format!("unnamed {} processor", std::env::consts::ARCH)
}

/// A device ready to be measured on.
pub(crate) struct OpenDevice {
    pub(crate) device: Device,
    pub(crate) gpu: Option<Gpu>,
    /// Processor or adapter, in words.
    pub(crate) name: String,
}

impl OpenDevice {
    /// Opens a device; `adapter` chooses among GPUs.
    ///
    /// # Errors
    /// If there is no such GPU.
    pub(crate) fn open(device: Device, adapter: Option<&str>, machine: &Machine) -> Result<Self> {
        if device == Device::Cpu {
            let name = format!("{}, {} threads", machine.processor, machine.threads);
            return Ok(Self { device, gpu: None, name });
        }
        let gpu = Gpu::open(adapter)?;
        let facts = gpu.facts();
        let kind = if facts.is_software() { "software, " } else { "" };
        let name = format!("{} ({kind}{}, driver {})", facts.name, facts.backend, facts.driver);
        Ok(Self { device, gpu: Some(gpu), name })
    }

    /// Whether it is a GPU that is not emulated in software.
    pub(super) fn is_real_gpu(&self) -> bool {
        self.gpu.as_ref().is_some_and(|gpu| !gpu.facts().is_software())
    }
}
