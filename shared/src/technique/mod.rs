//! The per-pixel bodies of the techniques.

pub mod path;
