//! Passes over the picture.
