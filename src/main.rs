//! The `lightgrid` binary.

fn main() {}
