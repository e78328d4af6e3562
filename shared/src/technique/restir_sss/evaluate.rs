//! What a sample sends to the camera.

use super::origin::Entrance;
use super::record::Kind;
use crate::bsdf::Material;
use crate::geometry::{Hit, Ray};
use crate::scene::{AddressedLight, Location, Surface};
use crate::technique::path::hybrid::Exit;
use crate::vec::flush;
use glam::Vec3;

/// A sample at an entry.
pub(super) struct Evaluated {
    /// The integrand over the addresses of point and light, without visibility.
    pub(super) value: Vec3,
    /// Density over (light, u, v) with which lights are sampled.
    pub(super) light_density: f32,
    /// From the point to the light.
    pub(super) shadow: Ray,
}

/// The light of an address by way of a point of the body.
#[inline(always)]
pub(super) fn evaluate<S: Surface<Material = Material>>(
    scene: &S,
    entrance: &Entrance,
    (hit, at, kind): (&Hit, &Location, Kind),
    light: &AddressedLight,
) -> Evaluated {
    let worth = if kind == Kind::AtEntry { entrance.lambert() } else { entrance.worth(at) };
    let any = Ray { direction: -at.normal, ..Ray::NONE };
    let vertex = Exit::vertex(&scene.surface(&any, hit), scene.features());
    let connection = vertex.connect(&light.sample);
    Evaluated {
        value: flush(worth * connection.value * connection.spread(light)),
        light_density: light.sample.density * light.extent,
        shadow: connection.shadow,
    }
}
