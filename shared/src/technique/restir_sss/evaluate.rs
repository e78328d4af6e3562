//! What a sample sends to the camera.

use crate::bsdf::Material;
use crate::geometry::{Hit, Ray};
use crate::scene::{AddressedLight, Location, Surface};
use crate::technique::path::hybrid::Exit;
use crate::vec::flush;
use glam::Vec3;

/// The integrand over the addresses of point and light, without visibility: of a light by way of a point of the body, of which light that becomes
/// diffuse there is worth `worth`.
#[inline(always)]
pub(super) fn evaluate<S: Surface<Material = Material>>(
    scene: &S,
    (hit, at): (&Hit, &Location),
    worth: Vec3,
    light: &AddressedLight,
) -> Vec3 {
    // light enters on the front side
    let outside = Ray { direction: -at.normal, ..Ray::NONE };
    let vertex = Exit::vertex(&scene.surface(&outside, hit), scene.features());
    let connection = vertex.connect(&light.sample);
    flush(worth * connection.value * connection.spread(light))
}
