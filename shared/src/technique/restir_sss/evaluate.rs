//! What a sample sends to the camera.

use crate::bsdf::Material;
use crate::geometry::{Hit, Ray};
use crate::scene::{AddressedLight, Location, Surface};
use crate::technique::path::hybrid::Exit;
use crate::vec::flush;
use glam::Vec3;

/// What a light sends to the camera by way of a point of the body, without visibility: the integrand over the addresses of both. Light that becomes
/// diffuse at the point is multiplied by `worth` on its way to the camera.
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
