//! The program `restir`, run as a user runs it.

#[cfg(feature = "gpu")]
mod adapter;
mod bad_input;
mod careless;
#[cfg(unix)]
mod child;
mod data_files;
mod far;
mod films;
mod found;
#[cfg(feature = "gpu")]
mod gpu;
mod input_output;
#[cfg(unix)]
mod interrupt;
mod lamps;
mod layers;
mod measure;
mod motion;
#[cfg(unix)]
mod mutation;
mod numbered;
mod overwriting;
mod parts;
mod plans;
mod results;
#[cfg(unix)]
mod signals;
mod stop;
mod support;
mod tev;

/// The program.
const PROGRAM: &str = env!("CARGO_BIN_EXE_restir");
