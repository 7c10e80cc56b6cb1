//! What is drawn: free functions over plain data. No panel knows another one.

mod button;
mod color_bar;
pub(super) mod convergence;
pub(super) mod dock;
pub(super) mod final_render;
mod gestures;
pub(super) mod history;
pub(super) mod inspector;
mod lamps;
mod late;
pub(super) mod left;
mod map_view;
mod material;
pub(super) mod messages;
pub(super) mod method;
pub(super) mod needs;
pub(super) mod overlay;
pub(super) mod picture;
mod pixel_light;
pub(super) mod prompt;
pub(super) mod right;
pub(super) mod scope;
pub(super) mod shortcuts;
pub(super) mod status;
pub(super) mod top;
pub(super) mod viewport;
