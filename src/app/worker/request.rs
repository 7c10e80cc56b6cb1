//! What the window asks of the render thread, and what a new request means for the one before.

use std::sync::Arc;

use crate::environment::Environment;
use crate::image::Image;
use crate::path::World;
use crate::render::gpu::DeviceChoice;
use crate::render::light_groups::LightFactors;
use crate::render::{StopRule, View};

/// What is to be rendered.
#[derive(Clone)]
pub(crate) struct Request {
    /// The scene.
    pub world: Arc<World>,
    /// The map, turned and scaled.
    pub environment: Arc<Environment>,
    /// What is seen and how.
    pub view: View,
    /// Render plainly beside it, at equal time.
    pub split: bool,
    /// The camera moves: a small picture at once rather than a good one.
    pub moving: bool,
    /// Show pictures on the way; else only what [`View`] asks for, for repeatable screenshots.
    pub previews: bool,
    /// Where it is rendered.
    pub device: DeviceChoice,
    /// Show light from a radiance cache while there is little of what is asked for.
    pub wants_cached: bool,
    /// Tell what is in that cache.
    pub inspects_cache: bool,
    /// When to stop.
    pub rule: StopRule,
    /// Render with what was learned before rather than learn anew.
    pub is_frozen: bool,
    /// What errors are measured against.
    pub reference: Option<Arc<Reference>>,
    /// Render each group of light by itself, and show their sum times these factors. World and environment have none.
    pub mix: Option<LightFactors>,
    /// Do nothing for now.
    pub paused: bool,
    /// Counts restarts asked for by hand.
    pub run: u32,
}

impl Request {
    /// Whether what is rendered for `self` is of no use for `new`.
    pub(in crate::app) fn restarts(&self, new: &Self) -> bool {
        !Arc::ptr_eq(&self.world, &new.world)
            || !Arc::ptr_eq(&self.environment, &new.environment)
            || self.view != new.view
            || (self.moving, self.run) != (new.moving, new.run)
            || self.mix.is_some() != new.mix.is_some()
            || self.moving && self.mix != new.mix
    }

    /// Whether the very same picture is rendered for both. Its map may have been turned back meanwhile, or read again.
    pub(in crate::app) fn is_resumed_by(&self, new: &Self) -> bool {
        let (map, other) = (&self.environment, &new.environment);
        let is_equal = || map.map() == other.map() && map.tile_energies() == other.tile_energies();
        let is_as_lit = (map.shares_map_with(other) || is_equal())
            && map.rotation_and_intensity() == other.rotation_and_intensity();
        let environment = Arc::clone(other);
        is_as_lit
            && (self.is_frozen, &self.mix) == (new.is_frozen, &new.mix)
            && !Self { environment, ..self.clone() }.restarts(new)
    }

    /// Whether `new` is only the next moment of a movement, for which a picture of this one is worth to be seen:
    /// were each ended by the next, none would be seen before the movement ends.
    pub(super) fn is_followed_by(&self, new: &Self) -> bool {
        self.moving
            && new.moving
            && Arc::ptr_eq(&self.world, &new.world)
            && self.environment.shares_map_with(&new.environment)
    }

    /// Whether pictures for `self` show something else than `new` asks for. A movement's pictures show the view at rest
    /// that it ends in.
    pub(in crate::app) fn is_left_for(&self, new: &Self) -> bool {
        let moving = self.moving && new.moving;
        Self { moving, ..self.clone() }.restarts(new)
    }

    /// Whether work for `self` is to be dropped for `new`.
    pub(super) fn is_ended_by(&self, new: &Self) -> bool {
        self.restarts(new) && !self.is_followed_by(new)
    }

    /// Whether the same light falls on the same scene, whatever its surfaces make of it.
    pub(super) fn is_lit_like(&self, other: &Self) -> bool {
        self.world.has_same_visibility(&other.world)
            && Arc::ptr_eq(&self.environment, &other.environment)
            && (self.view.medium, self.view.limits) == (other.view.medium, other.view.limits)
    }

    /// Whether the same surfaces are seen in the same pixels, whatever they make of light.
    pub(in crate::app) fn has_surfaces_of(&self, new: &Self) -> bool {
        let (a, b) = (&self.view, &new.view);
        self.world.has_same_visibility(&new.world)
            && (&a.camera, a.width, a.height) == (&b.camera, b.width, b.height)
            && (a.crop, a.medium) == (b.crop, b.medium)
    }

    /// Whether surfaces look for `self` as they do for `new`, from wherever they are seen.
    pub(in crate::app) fn is_seen_like(&self, new: &Self) -> bool {
        let (a, b) = (&self.view, &new.view);
        Arc::ptr_eq(&self.world, &new.world)
            && Arc::ptr_eq(&self.environment, &new.environment)
            && (a.crop, b.crop) == (None, None)
            && (a.medium, a.background, a.limits) == (b.medium, b.background, b.limits)
            && self.mix == new.mix
    }

    pub(super) fn is_same(&self, new: &Self) -> bool {
        let wants =
            |of: &Self| (of.split, of.wants_cached, of.inspects_cache, of.paused, of.device);
        let reference = |of: &Self| of.reference.as_ref().map(Arc::as_ptr);
        !self.restarts(new)
            && wants(self) == wants(new)
            && reference(self) == reference(new)
            && (self.is_frozen, self.rule, &self.mix) == (new.is_frozen, new.rule, &new.mix)
    }
}

/// A picture without noise.
pub(crate) struct Reference {
    /// Where it came from.
    pub name: String,
    /// Linear radiance.
    pub image: Image,
}
