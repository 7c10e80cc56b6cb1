//! The window: what a person sees and does, as plain data that is sent down.
//!
//! [`App`] holds a [`document::Document`] (what the picture is; `edited` undoes changes by comparing snapshots), an
//! [`interface::Interface`] (what is open and pointed at) and, beside them, parts that know nothing of each other:
//! `assets` (what is loaded), `rendering` (the worker), `display` (the presenter and the screen), `library` (what
//! outlasts the window), `renders` (files that other processes render) and `tasks`. Every frame panels draw from them and change document and interface or ask for a
//! `commands::Command`; then the `worker` is told what to render and the `presenter` what to make ready on the device.
//! Both take the latest value and publish the latest picture: nothing here waits. The viewport develops it on the
//! device of the `screen` in the frame that draws it. `window` shows it on a display, [`screenshot`] in a texture
//! without one.

mod album;
mod application;
mod assets;
mod blit;
mod camera_pictures;
pub(crate) mod commands;
mod comparison;
pub(crate) mod convergence;
mod desktop;
mod display;
pub mod document;
pub mod drag;
mod dropped;
mod edited;
mod execute;
pub mod final_render;
pub(crate) mod history;
mod input_order;
mod inspect;
pub mod interface;
pub(crate) mod kept_picture;
mod learning_steps;
mod library;
pub(crate) mod loader;
mod looks;
pub(crate) mod messages;
mod navigation;
pub mod overlays;
mod panels;
pub(crate) mod presenter;
mod reload;
mod render_queue;
mod rendering;
mod save;
pub(crate) mod screen;
pub mod screenshot;
pub mod settings_file;
mod small_maps;
mod speed_up;
mod sync;
mod tasks;
#[cfg(test)]
mod tests;
mod theme;
pub mod threads;
mod undo;
pub(crate) mod window;
pub(crate) mod worker;
pub mod zoom;

pub use application::{App, Start};
pub use threads::{Wake, Wakes};
