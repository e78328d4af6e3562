//! Punctual lights (`KHR_lights_punctual`).
//!
//! Candela and lux are taken as watts per steradian and per square metre: a scene has no unit of power. A light has no
//! range: its intensity falls with the square of the distance.

use std::f64::consts::FRAC_PI_2;

use glam::{DAffine3, DVec3};
use gltf::json::extensions::scene::khr_lights_punctual::{Light as JsonLight, Type};
use gltf::json::scene::Node;
use gltf::json::validation::Checked;

use super::{Importer, Problem, exact, label};
use crate::error::ensure;
use crate::scene::{Light, LightKind, MAX_COORDINATE};

/// The largest share of its outer angle that the inner angle of a cone has: the falloff needs some room.
const MAX_INNER: f64 = 0.999;

impl Importer<'_> {
    /// Adds the light of a node, if it has one.
    pub(super) fn add_light(&mut self, node: &Node, world: &DAffine3) -> Result<(), Problem> {
        let reference = node.extensions.as_ref().and_then(|extensions| extensions.khr_lights_punctual.as_ref());
        let Some(index) = reference.map(|reference| reference.light) else {
            return Ok(());
        };
        let light = self.document.get(index, "a node has light")?;
        let name = label(light.name.as_ref(), "light", index);
        let light = self.about(format!("light {name}"), |importer| importer.light(name, light, world))?;
        self.scene.lights.push(light);
        Ok(())
    }

    fn light(&mut self, name: String, light: &JsonLight, world: &DAffine3) -> Result<Light, Problem> {
        let intensity = light.color.map(|channel| channel * light.intensity);
        let possible = intensity.iter().all(|channel| channel.is_finite() && *channel >= 0.0);
        ensure!(possible, "its intensity is {intensity:?}; it has to be finite and not negative");
        self.warn_if(light.range.is_some(), "its range is ignored");
        let position = world.translation;
        // A light shines along its -z.
        let direction = world.transform_vector3(DVec3::NEG_Z);
        let kind = match light.type_ {
            Checked::Valid(Type::Point) => LightKind::Point { position },
            Checked::Valid(Type::Directional) => LightKind::Directional { direction },
            Checked::Valid(Type::Spot) => {
                let [inner, outer] = self.cone(light)?;
                LightKind::Spot { position, direction, inner, outer }
            }
            Checked::Invalid => return Err("it is neither a point, a spot nor a directional light".to_owned()),
        };
        let near = matches!(kind, LightKind::Directional { .. }) || position.abs().max_element() <= MAX_COORDINATE;
        ensure!(near, "it is at {position}, beyond {MAX_COORDINATE:e}; move it nearer to the origin");
        let directed = matches!(kind, LightKind::Point { .. }) || direction != DVec3::ZERO;
        ensure!(directed, "it shines in no direction: its node has a scale of 0");
        Ok(Light { name, intensity, kind })
    }

    /// Inner and outer angle.
    fn cone(&mut self, light: &JsonLight) -> Result<[f64; 2], Problem> {
        let spot = light.spot.as_ref().ok_or("it has no cone")?;
        let rounded = [spot.inner_cone_angle, spot.outer_cone_angle];
        let [inner, outer] = exact::cone(&light.extras, rounded).unwrap_or(rounded.map(f64::from));
        // Half a turn over two is rounded up in single precision.
        let outer = if outer as f32 == FRAC_PI_2 as f32 { outer.min(FRAC_PI_2) } else { outer };
        let possible = outer > 0.0 && outer <= FRAC_PI_2 && inner >= 0.0;
        ensure!(possible, "its cone has the angles {inner} and {outer}; they have to be at least 0 and at most pi/2");
        self.warn_if(inner >= outer, "the falloff of its cone has no width; it gets a small one");
        Ok([if inner >= outer { MAX_INNER * outer } else { inner }, outer])
    }
}
