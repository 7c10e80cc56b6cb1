//! Opens the device that is chosen.

use super::gpu::{self, Gpu};
use super::gpu_facts::{AdapterFacts, DeviceChoice};
use crate::error::{Error, Result};

impl DeviceChoice {
    /// Connects to the GPU that is chosen, the best whose name or backend contains `adapter`;
    /// `None` is the CPU.
    ///
    /// # Errors
    /// If it cannot be opened; with [`Self::Auto`] and no name this is no reason to stop.
    pub fn open(self, adapter: Option<&str>) -> Result<Option<Gpu>> {
        self.open_or_share(adapter, None)
    }

    /// [`Self::open`], but a clone of `shared` if that is the GPU chosen and still of use.
    ///
    /// # Errors
    /// As [`Self::open`].
    pub(crate) fn open_or_share(
        self,
        adapter: Option<&str>,
        shared: Option<&Gpu>,
    ) -> Result<Option<Gpu>> {
        match (self, adapter) {
            (Self::Cpu, Some(name)) => {
                Err(Error::new(format!("--adapter {name} and --device cpu exclude each other")))
            }
            (Self::Cpu, None) => Ok(None),
            (Self::Auto, None) if gpu::adapters().first().is_none_or(AdapterFacts::is_software) => {
                Ok(None)
            }
            // A card that cannot be opened leaves software, which is no reason to leave the CPU.
            (Self::Auto, None) => Gpu::open_or_share(None, shared)
                .map(|gpu| Some(gpu).filter(|gpu| !gpu.facts().is_software())),
            (_, name) => Gpu::open_or_share(name, shared).map(Some),
        }
    }
}
