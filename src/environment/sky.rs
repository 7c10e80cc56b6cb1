//! Procedural skies.
