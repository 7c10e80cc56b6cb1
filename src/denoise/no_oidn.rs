//! Stands in for Open Image Denoise on systems that cannot load shared libraries.

use std::sync::atomic::AtomicBool;

use super::samples::{Quality, Samples};
use crate::error::{Error, Result};
use crate::image::Image;

/// # Errors
/// Always.
pub(super) fn check() -> Result<()> {
    Err(Error::new("Open Image Denoise cannot be loaded on this system"))
}

/// # Errors
/// Always.
pub(super) fn denoise(_: &Samples<'_>, _: Quality, _: &AtomicBool) -> Result<Option<Image>> {
    check().map(|()| None)
}
