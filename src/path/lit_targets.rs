//! Targets as they were lit last: a camera that moves does not look for them again.

use std::sync::{Arc, Mutex, PoisonError};

use super::aim_targets::AimTargets;
use super::lights::LightChoice;
use super::limits::PathLimits;
use crate::environment::Environment;
use crate::scene::Medium;

/// What decides, beside the scene, how bright targets are.
#[derive(Debug, Clone)]
pub(crate) struct Lighting {
    pub(crate) environment: Environment,
    pub(crate) limits: PathLimits,
    /// In place of the scene's own.
    pub(crate) medium: Option<Medium>,
    pub(crate) lights: LightChoice,
}

impl Lighting {
    fn is_same(&self, other: &Self) -> bool {
        let (map, others) = (&self.environment, &other.environment);
        map.shares_map_with(others)
            && map.rotation_and_intensity() == others.rotation_and_intensity()
            && (self.limits, self.medium, &self.lights)
                == (other.limits, other.medium, &other.lights)
    }
}

/// Targets of a scene, if there are any, with the light that they were weighed by.
#[derive(Debug, Default)]
pub(crate) struct LitTargets(Mutex<Option<(Lighting, Option<Arc<AimTargets>>)>>);

impl LitTargets {
    /// The targets in that light; `find` is asked where the light is another than the last.
    pub(crate) fn of(
        &self,
        lighting: Lighting,
        find: impl FnOnce() -> Option<AimTargets>,
    ) -> Option<Arc<AimTargets>> {
        let last = || self.0.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some((of, targets)) = &*last()
            && of.is_same(&lighting)
        {
            return targets.clone();
        }
        // Whoever looks for the same at the same time finds the same.
        let targets = find().map(Arc::new);
        *last() = Some((lighting, targets.clone()));
        targets
    }
}
