//! What techniques share that follow light: vertices of paths, connections, straight ways through glass, collisions inside media.

mod connect;
mod passage;
mod single_scattering;
mod vertex;

pub use connect::{Connection, Reconnection};
pub use passage::{Passage, follow, transmittance};
pub use single_scattering::{ScatteredOnce, WayOut, scatter_once, uncollided};
pub use vertex::Vertex;
