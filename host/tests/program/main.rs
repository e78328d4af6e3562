//! The program `restir`, run as a user runs it.

#![cfg(feature = "cli")]

mod bad_input;
mod data_files;
#[cfg(feature = "gpu")]
mod gpu;
#[cfg(unix)]
mod interrupt;
mod measure;
mod results;
mod support;
