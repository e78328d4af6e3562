//! What techniques share that follow light: vertices of paths, connections and their weights, what interiors leave of light,
//! straight ways through glass, collisions inside media.

mod connect;
mod interior;
mod passage;
mod single_scattering;
mod vertex;
mod weight;

pub use connect::{Connection, connect_inside, passes};
pub use interior::through_interior;
pub use passage::{Passage, follow, transmittance};
pub use single_scattering::{Collision, ScatteredOnce, WayOut, scatter_once};
pub use vertex::{Departure, Vertex};
pub use weight::{Chosen, emission_weight, environment_weight, next_event};
