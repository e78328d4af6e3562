//! Scenes far from the origin are moved near it.
//!
//! Kernels compute in single precision, whose steps grow with coordinates, and start rays a step or so off surfaces: a room of 4
//! units that stands 10^5 from the origin gains 13 % of its light. So a scene has an origin of its own.

use std::collections::BTreeSet;

use glam::DVec3;

use super::{Camera, LightKind, Scene, boxes::Box3};

/// A scene whose middle is within so many of its sizes from the origin stays: what rays gain there is below 10^-4 of the light.
const NEAR: f64 = 8.0;
/// Origins are multiples of a power of two that is at most so many sizes, and more than half as many: they are exact in either
/// precision, and do not follow each change of the bounds.
const GRID: f64 = 4.0;

impl Scene {
    /// Moves a scene that is far from the origin near it: instances, lights and the camera move, and [`Self::origin`] says by
    /// how much. What a rig places follows, and nothing near the origin changes.
    ///
    /// A scene is far if a coordinate of the middle of its bounds at time 0, those of the boxes of its meshes, is more than 8 times the longest side of these. The import
    /// does this; a scene that was made otherwise may do it at any time, best before its buffers are built: cameras and positions
    /// that were told before have the old coordinates.
    pub fn move_to_origin(&mut self) {
        if let Some(middle) = self.far_middle() {
            self.set_origin(self.origin + middle);
        }
    }

    /// Where the scene would be near, on the grid of origins, if it is not near already.
    pub(super) fn far_middle(&self) -> Option<DVec3> {
        let Box3 { lo, hi } = self.box_of_all();
        let (middle, size) = (0.5 * (lo + hi), (hi - lo).max_element());
        let is_far = size.is_finite() && size > 0.0 && middle.abs().max_element() > NEAR * size;
        let grid = GRID * power_of_two_below(size);
        is_far.then(|| (middle / grid).round() * grid)
    }

    /// Changes the coordinates of the scene to those relative to another origin.
    pub(super) fn set_origin(&mut self, origin: DVec3) {
        let step = self.origin - origin;
        // the joints of a skin place its mesh
        let deformations = self.animation.rig.deformations.iter();
        let skinned: BTreeSet<usize> = deformations.filter(|d| d.skinning.is_some()).map(|d| d.mesh).collect();
        for instance in self.instances.iter_mut().filter(|instance| !skinned.contains(&instance.mesh)) {
            instance.transform.translation += step;
        }
        for light in &mut self.lights {
            if let LightKind::Point { position } | LightKind::Spot { position, .. } = &mut light.kind {
                *position += step;
            }
        }
        self.camera = self.camera.map(|camera| camera.moved(step));
        self.origin = origin;
    }
}

impl Camera {
    /// The camera elsewhere, with the same view. A camera in coordinates of the world is that of a scene if it is moved by
    /// minus [`Scene::origin`].
    #[must_use]
    pub fn moved(self, step: DVec3) -> Camera {
        Camera { position: self.position + step, target: self.target + step, ..self }
    }
}

/// The largest power of two that is not above a positive normal number.
fn power_of_two_below(number: f64) -> f64 {
    const EXPONENT: u64 = 0x7ff << 52;
    f64::from_bits(number.to_bits() & EXPONENT)
}
