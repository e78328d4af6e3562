//! Scenes far from the origin are moved near it.
//!
//! Kernels compute in single precision, whose steps grow with coordinates, and start rays a step or so off surfaces: a room of 4
//! units that stands 10^5 from the origin gains 13 % of its light. So a scene has an origin of its own.

use glam::DVec3;

use super::{Camera, LightKind, Scene, double};

/// A scene whose middle is within so many of its sizes from the origin stays: what rays gain there is below 10^-4 of the light.
const NEAR: f64 = 8.0;
/// Origins are multiples of a power of two that is at most so many sizes, and more than half as many: they are exact in either
/// precision, and do not follow each change of the bounds.
const GRID: f64 = 4.0;
/// Steps of single precision that are a larger part of a mesh's size are seen in its shape.
const COARSE: f64 = 1.0e-3;

impl Scene {
    /// Moves a scene that is far from the origin near it: instances, lights and the camera move, and [`Self::origin`] says by
    /// how much. What a rig places follows, and nothing near the origin changes.
    ///
    /// A scene is far if a coordinate of the middle of its bounds at time 0 is more than 8 times the longest side of these. The import
    /// does this; a scene that was made otherwise may do it at any time, best before its buffers are built: cameras and positions
    /// that were told before have the old coordinates.
    pub fn move_to_origin(&mut self) {
        if let Some(middle) = self.far_middle() {
            self.set_origin(self.origin + middle);
        }
    }

    /// Where the scene would be near, on the grid of origins, if it is not near already.
    pub(super) fn far_middle(&self) -> Option<DVec3> {
        let [lo, hi] = self.exact_bounds();
        let (middle, size) = (0.5 * (lo + hi), (hi - lo).max_element());
        let is_far = size.is_finite() && size > 0.0 && middle.abs().max_element() > NEAR * size;
        let grid = GRID * power_of_two_below(size);
        is_far.then(|| (middle / grid).round() * grid)
    }

    /// Changes the coordinates of the scene to those relative to another origin.
    pub(super) fn set_origin(&mut self, origin: DVec3) {
        let step = self.origin - origin;
        // the joints of a skin place its mesh
        let rig = &self.animation.rig;
        let skinned = |mesh| rig.deformations.iter().any(|other| other.mesh == mesh && other.skinning.is_some());
        for instance in self.instances.iter_mut().filter(|instance| !skinned(instance.mesh)) {
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

impl Scene {
    /// Warns of meshes of which single precision has lost too much: by the vertices that they have, or by where these are in the scene.
    #[cfg(feature = "gltf")]
    pub(super) fn warn_of_coarse_vertices(&mut self) {
        let own =
            self.meshes.iter().map(|mesh| (mesh.name.as_str(), coarseness(mesh.positions.iter().map(|p| double(*p)))));
        let placed = self.instances.iter().map(|instance| {
            let mesh = &self.meshes[instance.mesh];
            let place = |p: &[f32; 3]| instance.transform.transform_point3(double(*p));
            (mesh.name.as_str(), coarseness(mesh.positions.iter().map(place)))
        });
        let own = coarsest(
            own,
            "their mesh",
            "move the vertices to the origin of the mesh, and their node to where they were",
        );
        let placed = coarsest(placed, "the scene", "leave out what is far away, or scale it");
        self.warnings.extend(own.into_iter().chain(placed));
    }
}

/// How coarse the steps of single precision are for some points.
#[cfg(feature = "gltf")]
struct Coarseness {
    /// The largest coordinate.
    far: f64,
    /// The step there.
    step: f64,
    /// The largest side of the bounds.
    size: f64,
}

#[cfg(feature = "gltf")]
fn coarseness(points: impl Iterator<Item = DVec3>) -> Coarseness {
    let bounds = [DVec3::INFINITY, DVec3::NEG_INFINITY];
    let [lo, hi] = points.fold(bounds, |[lo, hi], point| [lo.min(point), hi.max(point)]);
    let far = lo.abs().max(hi.abs()).max_element();
    let step = f64::from((far as f32).next_up()) - f64::from(far as f32);
    Coarseness { far, step, size: (hi - lo).max_element() }
}

/// A sentence about the mesh that suffers most, if one does.
#[cfg(feature = "gltf")]
fn coarsest<'a>(meshes: impl Iterator<Item = (&'a str, Coarseness)>, whose: &str, remedy: &str) -> Option<String> {
    let mut coarse: Vec<_> = meshes.filter(|(_, c)| c.size > 0.0 && c.step > COARSE * c.size).collect();
    let share = |(_, c): &(&str, Coarseness)| c.step / c.size;
    coarse.sort_by(|a, b| share(b).total_cmp(&share(a)));
    let (name, Coarseness { far, step, size }) = coarse.first()?;
    let others = if coarse.len() > 1 { format!(" (and {} more)", coarse.len() - 1) } else { String::new() };
    Some(format!(
        "mesh {name}{others}: it has a size of {size:.4}, and vertices {far:.4e} from the origin of {whose}, where single precision has \
         steps of {step:.2e}; {remedy}"
    ))
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
