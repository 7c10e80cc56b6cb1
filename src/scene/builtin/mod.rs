//! Scenes made by code.
