//! A case of the suite, and how cases are run.

use super::outcome::Outcome;
use crate::error::Result;
use crate::render::gpu::Gpu;

/// How the cases are run: on which device, and how long.
pub struct Setting {
    /// The GPU that renders; `None` is the CPU.
    pub gpu: Option<Gpu>,
    /// Whether the long counts of rays and samples are asked for.
    pub nightly: bool,
}

impl Setting {
    /// The quick count, or the nightly one if that is asked for.
    pub(super) fn count<T>(&self, quick: T, nightly: T) -> T {
        if self.nightly { nightly } else { quick }
    }
}

/// The devices a case runs on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum On {
    /// Its result does not depend on the device: it runs on the CPU only.
    Cpu,
    /// It renders: it runs on either.
    Any,
    /// It tests the GPU only.
    Gpu,
}

/// A case: a scene or a computation with limits.
#[derive(Debug, Clone, Copy)]
pub struct Case {
    /// The group it belongs to.
    pub group: &'static str,
    /// Its name in the group.
    pub name: &'static str,
    /// The devices it runs on.
    pub on: On,
    pub(super) run: fn(&Setting) -> Result<Outcome>,
}

/// A case of a group: its name, the devices it runs on, and what runs it.
pub(super) type Entry = (&'static str, On, fn(&Setting) -> Result<Outcome>);

impl Case {
    /// `group/name`.
    pub fn title(&self) -> String {
        format!("{}/{}", self.group, self.name)
    }

    /// Whether it runs on the GPU, or else on the CPU.
    pub fn runs(&self, with_gpu: bool) -> bool {
        matches!((self.on, with_gpu), (On::Any, _) | (On::Cpu, false) | (On::Gpu, true))
    }
}
