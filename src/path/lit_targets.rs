//! Targets as they were lit last: a camera that moves does not look for them again.

use std::sync::{Arc, Mutex, PoisonError};

use super::aim_targets::AimTargets;
use super::lights::LightChoice;
use super::limits::PathLimits;
use crate::environment::Environment;
use crate::scene::Medium;

/// What decides, beside the scene and the map, how bright targets are.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Conditions {
    pub(crate) limits: PathLimits,
    /// In place of the scene's own.
    pub(crate) medium: Option<Medium>,
    pub(crate) lights: LightChoice,
}

/// A map, conditions, and the targets that were found under both, if there are any.
type Found = (Environment, Conditions, Option<Arc<AimTargets>>);

/// Targets of a scene in the light that was asked for last.
#[derive(Debug, Default)]
pub(crate) struct LitTargets(Mutex<Option<Found>>);

impl LitTargets {
    /// The targets in that light; `find` is asked where the light is another than the last.
    pub(crate) fn of(
        &self,
        environment: &Environment,
        conditions: Conditions,
        find: impl FnOnce() -> Option<AimTargets>,
    ) -> Option<Arc<AimTargets>> {
        let last = || self.0.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some((map, of, targets)) = &*last()
            && map.shares_map_with(environment)
            && map.rotation_and_intensity() == environment.rotation_and_intensity()
            && *of == conditions
        {
            return targets.clone();
        }
        // Whoever looks for the same at the same time finds the same.
        let targets = find().map(Arc::new);
        *last() = Some((environment.clone(), conditions, targets.clone()));
        targets
    }
}
