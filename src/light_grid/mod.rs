//! The learned grid.
