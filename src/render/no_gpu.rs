//! In the place of GPUs where the feature `gpu` is not built in: there are none, and what would be on
//! one cannot exist.

use std::ops::Range;
use std::sync::atomic::AtomicBool;

use super::film::Film;
use super::{Advance, Pass, View};
use crate::bvh::Ray;
use crate::environment::Environment;
use crate::error::{Error, Result};
use crate::light_grid::{LearningGrid, LightGrid};
use crate::path::{Lit, LocalLights, World};
use crate::radiance_cache::{RadianceCache, RadianceSums};

pub(crate) use super::gpu_facts::Question;
pub use super::gpu_facts::{
    AdapterFacts, DeviceChoice, FlightFigures, GpuFigures, KernelFacts, RayChoice, Schedule,
};

/// What is said where a GPU is asked for.
pub(crate) const NO_GPU: &str = "this lightgrid was built without GPU rendering (feature `gpu`)";

/// Functions that are given what there cannot be one of, which is named first: a macro's own `self` is another.
macro_rules! never {
    ($this:ident; impl $type:ty {
        $($(#[$attribute:meta])* $visibility:vis fn $name:ident $arguments:tt $(-> $result:ty)?;)+
    }) => {
        impl $type {
            $($(#[$attribute])* $visibility fn $name $arguments $(-> $result)? {
                match *$this {}
            })+
        }
    };
}

/// All adapters: none.
pub fn adapters() -> Vec<AdapterFacts> {
    Vec::new()
}

/// A connection to an adapter.
#[derive(Clone)]
pub enum Gpu {}

impl Gpu {
    /// Opens an adapter.
    ///
    /// # Errors
    /// Always.
    pub fn open(name: Option<&str>) -> Result<Self> {
        Self::open_or_share(name, None)
    }

    pub(super) fn open_or_share(_: Option<&str>, _: Option<&Self>) -> Result<Self> {
        Err(Error::new(NO_GPU))
    }

    /// The same connection with rays traced as is asked for.
    ///
    /// # Errors
    /// None.
    pub fn with_rays(self, _: RayChoice) -> Result<Self> {
        match self {}
    }

    /// The same connection with kernels that share the work so.
    #[must_use]
    pub fn with_schedule(self, _: Option<Schedule>) -> Self {
        match self {}
    }
}

never! { self; impl Gpu {
    /// What it is.
    pub fn facts(&self) -> &AdapterFacts;
    /// Gives the device up.
    pub fn lose(&self);
    /// Whether its own ray queries find what rays hit.
    pub fn has_hardware_rays(&self) -> bool;
} }

/// A scene and a map on a device.
pub enum UploadedScene {}

never! { gpu; impl UploadedScene {
    /// Uploads both.
    ///
    /// # Errors
    /// None.
    pub fn new(gpu: &Gpu, _: &World, _: &Environment) -> Result<Self>;
} }

never! { self; impl UploadedScene {
    /// The same scene under another map.
    ///
    /// # Errors
    /// None.
    pub fn relit(&self, _: &Environment) -> Result<Self>;
} }

impl KernelFacts {
    /// Of the kernel for a scene: none.
    pub fn of_scene(_: &World) -> Option<Self> {
        None
    }
}

/// The film on a device.
pub(crate) enum DeviceFilm {}

/// What a device holds of a picture in the making.
pub(crate) enum Renderer {}

never! { uploaded; impl Renderer {
    pub(crate) fn new(uploaded: &UploadedScene, _: Lit<'_>, _: (&View, Option<&LocalLights>), _: bool) -> Result<Self>;
} }

/// Traces rays alone on a device.
pub(crate) enum Caster {}

never! { uploaded; impl Caster {
    pub(crate) fn new(uploaded: &UploadedScene, _: Lit<'_>, _: &View) -> Result<Self>;
} }

never! { self; impl Caster {
    pub(crate) fn put_rays(&mut self, _: &[Ray]) -> Result<()>;
    pub(crate) fn cast(&mut self, _: Question, _: u32) -> Result<f64>;
    pub(crate) fn cast_results(&self, _: usize) -> Result<Vec<(f32, u32)>>;
} }

never! { self; impl Renderer {
    pub(super) fn set_film(&mut self, _: &Film) -> Result<()>;
    pub(crate) fn set_grid(&mut self, _: Option<&LightGrid>) -> Result<()>;
    pub(crate) fn set_cache(&mut self, _: Option<&RadianceCache>) -> Result<()>;
    pub(crate) fn learn(
        &mut self, _: Range<u64>, _: &LearningGrid, _: &AtomicBool,
    ) -> Result<Option<u64>>;
    pub(crate) fn train(
        &mut self, _: Range<u64>, _: &RadianceSums, _: &AtomicBool,
    ) -> Result<(u64, u64)>;
    pub(super) fn render(
        &mut self, _: Pass, _: Option<&LearningGrid>, _: &AtomicBool,
    ) -> Result<Advance>;
    pub(super) fn settle(&mut self) -> Result<()>;
    pub(super) fn read_film(&self, _: &mut Film) -> Result<()>;
    pub(super) fn rays(&self) -> u64;
    pub(crate) fn film_on_device(&self) -> Option<(Gpu, DeviceFilm)>;
    pub(crate) fn figures(&self) -> GpuFigures;
} }
