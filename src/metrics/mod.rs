//! Comparing pictures.
