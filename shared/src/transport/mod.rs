//! What techniques share that follow light: vertices of paths, connections, straight ways through glass.

mod connect;
mod passage;
mod vertex;

pub use connect::{Connection, Reconnection};
pub use passage::{Passage, follow, transmittance};
pub use vertex::Vertex;
