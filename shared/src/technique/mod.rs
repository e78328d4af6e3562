//! The per-pixel bodies of the techniques.

pub mod di;
pub mod path;
