//! Lights without a surface, and the environment.

use glam::DVec3;
use std::sync::Arc;

/// A light without a surface: rays do not hit it, and only sampling finds it (`KHR_lights_punctual`).
#[derive(Clone, Debug, PartialEq)]
pub struct Light {
    /// Name for messages.
    pub name: String,
    /// Radiant intensity of a point or spot light, in power per steradian; of a directional light the irradiance on a
    /// surface that faces it. Linear RGB, not negative; see [`EMISSION_RANGE`](super::EMISSION_RANGE).
    pub intensity: [f32; 3],
    /// The shape of the light.
    pub kind: LightKind,
}

/// The shapes of punctual lights.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum LightKind {
    /// Shines alike in all directions.
    Point {
        /// Where it is.
        position: DVec3,
    },
    /// Shines into a cone, with glTF's quadratic falloff between the inner and the outer angle.
    Spot {
        /// Where it is.
        position: DVec3,
        /// Where it shines to, the axis of the cone; any positive length.
        direction: DVec3,
        /// From the axis to where the falloff begins, in radians, in [0, outer).
        inner: f64,
        /// From the axis to where the falloff ends, in radians, in (0, pi/2].
        outer: f64,
    },
    /// Infinitely far away.
    Directional {
        /// Where it shines to; any positive length.
        direction: DVec3,
    },
}

/// Radiance from infinitely far away, as a latitude-longitude image, filtered bilinearly.
#[derive(Clone, Debug, PartialEq)]
pub struct Environment {
    /// Name for messages.
    pub name: String,
    /// Width and height in pixels.
    pub size: [u32; 2],
    /// Linear RGB radiance, rows from +y down to -y. The middle column lies at +z, and a quarter of the width to its
    /// left at +x.
    pub pixels: Arc<[[f32; 3]]>,
    /// Factor on the radiance; see [`EMISSION_RANGE`](super::EMISSION_RANGE).
    pub scale: f32,
    /// Turn about +y in degrees, counter-clockwise as seen from +y.
    pub rotation: f64,
}
