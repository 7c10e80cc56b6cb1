//! Low-discrepancy random numbers.
