//! The per-pixel bodies of the techniques.

pub mod path;
pub mod restir_di;
pub mod restir_pt;
