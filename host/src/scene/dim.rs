//! Light that is too dim, or too bright, for single precision.

use std::collections::BTreeSet;

use super::Scene;

/// Light is kept if the brightest emission of a scene is from the first to the second of these, in its units. Of dimmer light kernels lose what they
/// compute to be below 2^-100, and brighter light may overflow where techniques multiply it.
pub const EMISSION_RANGE: [f32; 2] = [1.0e-20, 1.0e15];

impl Scene {
    /// Warns if the brightest light of the scene is outside of [`EMISSION_RANGE`].
    pub fn warn_of_dim_light(&mut self) {
        let (brightest, [least, most]) = (self.brightest(), EMISSION_RANGE);
        if brightest > 0.0 && !(least..=most).contains(&brightest) {
            self.warnings.push(format!(
                "the brightest light of the scene is {brightest:e}, of which single precision may lose a part; light is kept from {least:e} to \
                 {most:e}: scale all lights by the same factor, and the picture by its inverse"
            ));
        }
    }

    /// The largest channel of what materials in use emit, of intensities, and of the environment's radiance.
    fn brightest(&self) -> f32 {
        let meshes = self.instances.iter().filter_map(|instance| self.meshes.get(instance.mesh));
        let used: BTreeSet<usize> = meshes.map(|mesh| mesh.material).collect();
        let materials =
            used.into_iter().filter_map(|material| self.materials.get(material)).flat_map(|material| material.emission);
        let lights = self.lights.iter().flat_map(|light| light.intensity);
        let environment = self.environment.iter();
        let sky = environment.flat_map(|sky| sky.pixels.iter().flatten().map(|radiance| radiance * sky.scale));
        materials.chain(lights).chain(sky).fold(0.0, f32::max)
    }
}
