//! What techniques share that reuse samples.

pub mod mis;
pub mod reservoir;
