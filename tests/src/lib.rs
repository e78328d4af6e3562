//! Harness of the suites: sweeps of scalar functions, statistics, an independent path tracer, scenes.

pub mod brute;
pub mod bsdf_f64;
pub mod chain;
pub mod counting;
pub mod data;
pub mod device;
pub mod features;
pub mod flush;
pub mod foreign;
pub mod gltf_files;
pub mod liveness;
pub mod meshes;
pub mod num;
pub mod oracle;
pub mod panes;
pub mod parity;
pub mod random;
pub mod rays;
pub mod resampling;
pub mod scenes;
pub mod stats;
pub mod stress;
pub mod suite;
pub mod visibility;
pub mod watertight;
pub mod wrong;
