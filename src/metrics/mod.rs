//! Comparing pictures, and deciding whether two estimates agree.

pub mod statistics;
