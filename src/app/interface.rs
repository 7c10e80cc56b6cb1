//! What is open, chosen and pointed at: nothing of it changes the picture's samples.

use glam::Vec2;
use serde::{Deserialize, Serialize};

use super::document::{PictureSize, in_other_shape};
use super::drag::Drag;
use super::final_render::FinalRender;
use super::overlays::Overlay;
use super::zoom::Zoom;
use crate::scene::MaterialEdit;

with_defaults! {
    /// State of the window that is not the picture's.
    #[derive(Debug, Clone, PartialEq)]
    pub struct Interface {
        /// Whether panels are shown.
        pub panels: bool = true,
        /// What the right panel shows.
        pub tab: Tab = Tab::Picture,
        /// What is open below the picture.
        pub dock: Option<Dock> = None,
        /// Whether the list of keys is open.
        pub shortcuts: bool = false,
        /// What is asked in a prompt.
        pub prompt: Option<Prompt> = None,
        /// What is drawn over the picture.
        pub overlay: Option<Overlay> = None,
        /// How much of the picture it covers, `[0,1]`.
        pub overlay_opacity: f32 = 0.75,
        /// What the map of tiles shows.
        pub tiles: TileView = TileView::Energy,
        /// The tile chosen on the map.
        pub tile: Option<u32> = None,
        /// Place of the picture under the pointer, both coordinates in `[0,1]`.
        pub pointed: Option<Vec2> = None,
        /// The same of the whole that the picture is a part of.
        pub pointed_in_whole: Option<Vec2> = None,
        /// Place the inspector stays at.
        pub pinned: Option<Vec2> = None,
        /// The material that is looked at.
        pub material: Option<u32> = None,
        /// Whether it was just clicked: its settings are to come into sight.
        pub is_material_new: bool = false,
        /// What a copied material looks like.
        pub copied_material: Option<MaterialEdit> = None,
        /// What of the history is compared.
        pub compared: Chosen = Chosen::default(),
        /// Pixels of the screen that the whole picture fills from left to right where it fits, once it was drawn.
        pub fitting_pixels: Option<f32> = None,
        /// How large the picture is shown.
        pub zoom: Zoom = Zoom::default(),
        /// Where the wipe is, `[0,1]` across the picture.
        pub wipe: f32 = 0.5,
        /// The step of learning that is looked at, if it is not the last.
        pub learning_step: Option<usize> = None,
        /// Whether what was learned is kept as it is.
        pub is_frozen: bool = false,
        /// What the next drag or click in the picture does, if it does not move the camera.
        pub tool: Option<Tool> = None,
        /// Size and movement of what is rendered into files.
        pub final_render: FinalRender = FinalRender::default(),
        /// The drag over the picture under way.
        pub drag: Option<Drag> = None,
        /// That of the wipe.
        pub wipe_drag: Option<Drag> = None,
        /// That of the map.
        pub map_drag: Option<Drag> = None,
        /// Whether rendering is halted.
        pub paused: bool = false,
        /// Counts restarts by hand.
        pub run: u32 = 0,
        /// Size of the viewport in pixels, once it was drawn.
        pub viewport_pixels: Option<[u32; 2]> = None,
        /// Size of the window in pixels that this was for, and whether panels were shown.
        pub viewport_of: Option<([u32; 2], bool)> = None,
        /// Until when the camera counts as moving, in the window's seconds.
        pub moving_until: f64 = f64::NEG_INFINITY,
        /// Until when the map counts as turning.
        pub turning_until: f64 = f64::NEG_INFINITY,
        /// Keys held that fly the camera.
        pub flying: Vec<egui::Key> = Vec::new(),
    }
}

/// What a drag or a click in the picture is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Tool {
    /// It marks the part that is to be rendered.
    Region,
    /// It puts the map's sun there.
    Sun,
}

/// Pictures of the history, by their number, that are compared.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Chosen {
    /// The one at the left; `None` compares nothing.
    pub left: Option<usize>,
    /// The one at the right; `None` is what is rendered.
    pub right: Option<usize>,
    /// Whether their difference is shown, and not one beside the other.
    pub is_difference: bool,
}

impl Chosen {
    /// Keeps to the same pictures when one of the list goes; without the left one nothing is compared.
    pub(super) fn without(&mut self, gone: usize) {
        if self.left == Some(gone) {
            *self = Self::default();
        }
        self.right.take_if(|right| *right == gone);
        for index in self.left.iter_mut().chain(&mut self.right) {
            *index -= usize::from(*index > gone);
        }
    }

    /// Keeps to the same pictures when so many come before them.
    pub(super) fn shift(&mut self, count: usize) {
        for index in self.left.iter_mut().chain(&mut self.right) {
            *index += count;
        }
    }
}

/// What the right panel shows.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Tab {
    /// What the left panel shows where there is room for one.
    Scene,
    /// Settings of the picture.
    Picture,
    /// Kept pictures.
    Compare,
    /// Overlays and inspector.
    Inspect,
}

/// What the map of tiles shows.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TileView {
    /// Share of the map's energy.
    Energy,
    /// Share of what all cells together have learned to sample.
    Learned,
}

/// What is open below the picture.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Dock {
    /// Error against time.
    Convergence,
    /// What the scene needs of the renderer.
    Needs,
}

/// A question with a path for an answer.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Prompt {
    /// What the path is for.
    pub purpose: Purpose,
    /// What has been typed.
    pub path: String,
    /// Whether it was just opened: its field is to get the keyboard, and typing to replace the path.
    pub is_new: bool,
    /// The path that was not taken last.
    pub refusal: Option<Refusal>,
}

/// A path that was not taken.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Refusal {
    /// The path as it was typed.
    pub path: String,
    /// Why it was not taken.
    pub sentence: String,
    /// Whether a file would be replaced: entered again, the path is taken.
    pub replaces: bool,
}

/// What a path is asked for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Purpose {
    /// A scene to open.
    Scene,
    /// A map to open.
    Map,
    /// A look to open.
    Look,
    /// A picture to write.
    Picture,
    /// A picture to be rendered into a file.
    Render,
    /// The same of frames.
    RenderFrames,
    /// A file for the distributions.
    Distributions,
    /// A picture without noise.
    Reference,
}

impl Purpose {
    /// What the question is called, what its files hold, and their extensions.
    pub fn words(self) -> (&'static str, &'static str, &'static [&'static str]) {
        const MAPS: &[&str] =
            &["exr", "hdr", "png", "jpg", "jpeg", "webp", "tif", "tiff", "bmp", "tga"];
        match self {
            Self::Scene => ("Open a scene", "glTF scene", &["gltf", "glb"]),
            Self::Map => ("Open a map", "Map", MAPS),
            Self::Look => ("Open a look", "Look", &["cube"]),
            Self::Picture => ("Save the picture", "Picture", &["png", "exr"]),
            Self::Render => ("Render into a file", "Picture", &["png", "exr"]),
            Self::RenderFrames => {
                ("Render frames into a file", "Frames", &["mp4", "webm", "gif", "png", "exr"])
            }
            Self::Distributions => {
                ("Export the distributions", "Distributions", &["csv", "json", "exr"])
            }
            Self::Reference => ("Open a reference", "Picture", &["exr", "hdr"]),
        }
    }

    /// Whether they are written.
    pub fn is_output(self) -> bool {
        !matches!(self, Self::Scene | Self::Map | Self::Look | Self::Reference)
    }
}

impl Interface {
    /// Whether the camera or the map is being moved.
    pub fn is_moving(&self, now: f64) -> bool {
        now < self.moving_until
    }

    /// Tells that something moves: for a moment small pictures are better than good ones.
    ///
    /// It lasts for some frames, so that it does not flicker where frames take long.
    pub fn keep_moving(&mut self, context: &egui::Context) {
        let frame_seconds = context.input(|input| input.unstable_dt);
        self.moving_until = context.time() + f64::from((3.0 * frame_seconds).clamp(0.18, 1.0));
    }

    /// Tells that the map turns, as [`Self::keep_moving`] does: for a moment it is marked where its sun shines.
    pub fn keep_turning(&mut self, context: &egui::Context) {
        self.keep_moving(context);
        self.turning_until = self.moving_until;
    }

    /// What is drawn over the picture.
    pub fn overlay_at(&self, now: f64) -> Option<Overlay> {
        self.overlay.or((now < self.turning_until).then_some(Overlay::Sun))
    }

    /// Looks at a material, whose settings come into sight, or at none.
    pub fn choose_material(&mut self, number: Option<u32>) {
        self.material = number;
        self.is_material_new = number.is_some();
    }

    /// Whether a dialogue has the keyboard.
    pub fn is_modal(&self) -> bool {
        self.prompt.is_some()
    }

    /// Whether anything tells what is in the radiance cache.
    pub fn inspects_cache(&self) -> bool {
        self.overlay.is_some_and(Overlay::is_of_cache) || (self.panels && self.tab == Tab::Inspect)
    }

    /// Pixels of the screen for one of a picture of this size, where it is magnified.
    pub(super) fn magnification(&self, size: PictureSize) -> Option<f32> {
        let fitting = self.fitting(size).filter(|_| self.zoom.is_some())?;
        Some(self.zoom.times * fitting)
    }

    /// The same where it fits.
    fn fitting(&self, size: PictureSize) -> Option<f32> {
        let [width, _] = size.pixels(self.viewport_pixels)?;
        Some(self.fitting_pixels? / width as f32)
    }

    /// To a pixel of the picture for one of the screen, or four where that is about what fits, around the pointer;
    /// or back.
    pub(super) fn toggle_zoom(&mut self, size: PictureSize) {
        if self.zoom.is_some() {
            self.zoom = Zoom::default();
            return;
        }
        let least = self.fitting(size).map_or(1.0, f32::recip);
        let times = if least > 1.05 { least } else { (4.0 * least).max(2.0) };
        let middle = self.pointed_in_whole.unwrap_or(Vec2::splat(0.5));
        self.zoom = Zoom::new(times, egui::vec2(middle.x, middle.y));
    }

    /// Asks for a path.
    pub(super) fn ask(&mut self, purpose: Purpose, path: String) {
        self.prompt = Some(Prompt { purpose, path, is_new: true, refusal: None });
    }

    /// Opens what developers look at, or closes it.
    pub(super) fn toggle_developer(&mut self) {
        if self.dock.is_some() || self.tab == Tab::Inspect {
            self.dock = None;
            self.tab = Tab::Picture;
            self.overlay = None;
        } else {
            self.dock = Some(Dock::Convergence);
            self.tab = Tab::Inspect;
        }
    }

    /// Width over height of the room.
    pub(super) fn aspect(&self) -> f32 {
        self.viewport_pixels.map_or(16.0 / 9.0, |[w, h]| w as f32 / h.max(1) as f32)
    }

    /// Keeps the inspected place on the same part of the scene where the aspect was so many times what it is now.
    pub(super) fn follow_shape(&mut self, factor: f32) {
        if let Some(place) = self.pinned {
            let place = Vec2::new(in_other_shape(place.x, factor), place.y);
            self.pinned = Some(place).filter(|place| (0.0..=1.0).contains(&place.x));
        }
    }

    /// The place that is inspected.
    pub fn inspected(&self) -> Option<Vec2> {
        self.pinned.or(self.pointed)
    }
}
