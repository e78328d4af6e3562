//! What a scene holds and glTF's numbers do not, in both directions.
//!
//! A scene has matrices, cameras and cone angles in double precision, lenses, and texture transforms that are any affine
//! map. The export rounds them to what glTF can say, for other programs, and keeps them as they are in a member `restir`
//! of the `extras` beside it. The import believes the extras only if rounding them gives what the file says: a program
//! that edits the file and copies the extras is not overruled.

use glam::{DAffine3, DVec3};
use gltf::json::Extras;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};

use crate::image::MAX_SIDE;
use crate::scene::Camera;

/// A texture transform in the form of `KHR_texture_transform`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::scene) struct PlacedTexture {
    pub(in crate::scene) offset: [f32; 2],
    /// In radians.
    pub(in crate::scene) rotation: f32,
    pub(in crate::scene) scale: [f32; 2],
}

impl PlacedTexture {
    /// As [`crate::scene::TextureUse::transform`]: scaled, then turned counter-clockwise as seen in the image, then
    /// moved. The signs of the sine are those of the extension's example (and of its implementations), not of its GLSL.
    pub(in crate::scene) fn transform(&self) -> [f32; 6] {
        let (sine, cosine) = f64::from(self.rotation).sin_cos();
        let [x, y] = self.scale.map(f64::from);
        let linear = [cosine * x, sine * y, -sine * x, cosine * y].map(|entry| (entry + 0.0) as f32);
        [linear[0], linear[1], self.offset[0], linear[2], linear[3], self.offset[1]]
    }

    /// The nearest form of an affine map; exact if it has no shear.
    pub(in crate::scene) fn of(transform: [f32; 6]) -> Self {
        let [a, b, tx, c, d, ty] = transform;
        let [a64, b64, c64, d64] = [a, b, c, d].map(f64::from);
        if [b, c] == [0.0; 2] {
            return Self { offset: [tx, ty], rotation: 0.0, scale: [a, d] };
        }
        let rotation = (-c64).atan2(a64);
        let (sine, cosine) = rotation.sin_cos();
        let scale = [a64 * cosine - c64 * sine, b64 * sine + d64 * cosine].map(|x| x as f32);
        Self { offset: [tx, ty], rotation: rotation as f32, scale }
    }
}

/// A matrix as a node has it: column by column, in single precision.
pub(in crate::scene) fn matrix(transform: &DAffine3) -> [f32; 16] {
    let [x, y, z] = transform.matrix3.to_cols_array_2d().map(|column| column.map(|entry| entry as f32));
    let [tx, ty, tz] = transform.translation.to_array().map(|entry| entry as f32);
    [x[0], x[1], x[2], 0.0, y[0], y[1], y[2], 0.0, z[0], z[1], z[2], 0.0, tx, ty, tz, 1.0]
}

/// Where a node of `matrix` is, in the precision of its extras if they fit.
pub(super) fn node_transform(extras: &Extras, rounded: [f32; 16]) -> Option<DAffine3> {
    let exact = DAffine3::from_cols_array(&own::<[f64; 12]>(extras, "transform")?);
    (exact.is_finite() && matrix(&exact) == rounded).then_some(exact)
}

/// The group of a node's instances.
pub(super) fn node_group(extras: &Extras) -> Option<u32> {
    own(extras, "group")
}

/// The extras of a node: its matrix, unless single precision holds it.
pub(in crate::scene) fn node_extras(transform: &DAffine3) -> Option<Value> {
    let exact = transform.to_cols_array();
    let rounded = matrix(transform);
    let is_rounded = (0..12).all(|i| f64::from(rounded[i / 3 * 4 + i % 3]) == exact[i]);
    (!is_rounded).then(|| json!({ "restir": { "transform": exact } }))
}

/// The camera that the extras describe, if it is that of the file.
pub(super) fn camera(extras: &Extras, world: &DAffine3, vertical_fov: f32) -> Option<Camera> {
    let vector = |member: &str| own(extras, member).map(DVec3::from_array);
    let camera = Camera {
        position: vector("position")?,
        target: vector("target")?,
        up: vector("up")?,
        vertical_fov: own(extras, "verticalFov")?,
        lens_radius: own(extras, "lensRadius")?,
        focus_distance: own(extras, "focusDistance"),
    };
    let fits = near(&camera.node_transform(), world) && camera.vertical_fov as f32 == vertical_fov;
    (fits && camera.check().is_ok()).then_some(camera)
}

/// Whether two transforms differ by roundings to single precision alone.
fn near(a: &DAffine3, b: &DAffine3) -> bool {
    let same = |(a, b): (&f64, &f64)| (a - b).abs() <= 4.0 * f64::from(f32::EPSILON) * a.abs().max(1.0);
    a.to_cols_array().iter().zip(&b.to_cols_array()).all(same)
}

/// The extras of a camera.
pub(in crate::scene) fn camera_extras(camera: &Camera) -> Value {
    json!({ "restir": {
        "position": camera.position.to_array(),
        "target": camera.target.to_array(),
        "up": camera.up.to_array(),
        "verticalFov": camera.vertical_fov,
        "lensRadius": camera.lens_radius,
        "focusDistance": camera.focus_distance,
    } })
}

/// Inner and outer angle of a spot light in double precision, if they are those of the file.
pub(super) fn cone(extras: &Extras, rounded: [f32; 2]) -> Option<[f64; 2]> {
    let angles: [f64; 2] = own(extras, "cone")?;
    (angles.map(|angle| angle as f32) == rounded).then_some(angles)
}

/// The extras of a spot light.
pub(in crate::scene) fn cone_extras(angles: [f64; 2]) -> Value {
    json!({ "restir": { "cone": angles } })
}

/// See [`restir_shared::medium::Interior::denser_outside`]: nothing that other programs know.
pub(super) fn denser_outside(extras: &Extras) -> Option<f32> {
    own(extras, "denserOutside")
}

/// The extras of a material whose interior has an outside that is denser.
pub(in crate::scene) fn denser_outside_extras(index: f32) -> Value {
    json!({ "restir": { "denserOutside": index } })
}

/// An affine map of texture coordinates.
pub(super) fn texture_transform(extras: &Extras) -> Option<[f32; 6]> {
    own::<[f64; 6]>(extras, "transform").map(|transform| transform.map(|entry| entry as f32))
}

/// The extras of a use of a texture, unless `KHR_texture_transform` says the same.
pub(in crate::scene) fn texture_extras(transform: [f32; 6]) -> Option<Value> {
    let is_said = PlacedTexture::of(transform).transform() == transform;
    (!is_said).then(|| json!({ "restir": { "transform": transform } }))
}

/// The image size that suits the scene.
pub(super) fn size(extras: &Extras) -> Option<[u32; 2]> {
    let size: [f64; 2] = own(extras, "size")?;
    size.iter().all(|side| (1.0..=f64::from(MAX_SIDE)).contains(side)).then_some(size.map(|side| side as u32))
}

/// How the times of tracks and frames go together.
#[derive(Clone, Copy, Debug, Default, PartialEq, Deserialize, Serialize)]
#[serde(rename_all = "camelCase")]
pub(in crate::scene) struct Times {
    pub(in crate::scene) frame_rate: f64,
    pub(in crate::scene) start: f64,
    pub(in crate::scene) period: Option<f64>,
}

/// The times of the scene's animation.
pub(super) fn times(extras: &Extras) -> Option<Times> {
    own(extras, "times")
}

/// A member of what the export has written into extras.
fn own<T: DeserializeOwned>(extras: &Extras, member: &str) -> Option<T> {
    let mut value: Value = serde_json::from_str(extras.as_ref()?.get()).ok()?;
    serde_json::from_value(value.get_mut("restir")?.get_mut(member)?.take()).ok()
}
