//! Harness of the suites: sweeps of scalar functions, statistics, an independent path tracer, scenes.

pub mod num;
pub mod random;
pub mod suite;
