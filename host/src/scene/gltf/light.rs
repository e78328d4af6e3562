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
use crate::scene::{Light, LightKind, MAX_COORDINATE};

/// The largest share of its outer angle that the inner angle of a cone has: the falloff needs some room.
const MAX_INNER: f64 = 0.999;

impl Importer<'_> {
    /// Adds the light of a node, if it has one.
    pub(super) fn add_light(&mut self, node: &Node, world: &DAffine3) -> Result<(), Problem> {
        let Some(reference) = node.extensions.as_ref().and_then(|extensions| extensions.khr_lights_punctual.as_ref())
        else {
            return Ok(());
        };
        let index = reference.light.value();
        let extensions = self.document.root.extensions.as_ref();
        let lights = extensions.and_then(|extensions| extensions.khr_lights_punctual.as_ref());
        let light = lights
            .and_then(|lights| lights.lights.get(index))
            .ok_or_else(|| format!("a node has light {index}, which does not exist"))?;
        let name = label(light.name.as_ref(), "light", index);
        let light = self.light(&name, light, world).map_err(|problem| format!("light {name}: {problem}"))?;
        self.scene.lights.push(light);
        Ok(())
    }

    fn light(&mut self, name: &str, light: &JsonLight, world: &DAffine3) -> Result<Light, Problem> {
        let intensity = light.color.map(|channel| channel * light.intensity);
        if !intensity.iter().all(|channel| channel.is_finite() && *channel >= 0.0) {
            return Err(format!("its intensity is {intensity:?}; it has to be finite and not negative"));
        }
        if light.range.is_some() {
            self.warn(format!("light {name}: its range is ignored"));
        }
        let position = world.translation;
        // A light shines along its -z.
        let direction = world.transform_vector3(DVec3::NEG_Z);
        let kind = match light.type_ {
            Checked::Valid(Type::Point) => LightKind::Point { position },
            Checked::Valid(Type::Directional) => LightKind::Directional { direction },
            Checked::Valid(Type::Spot) => {
                let [inner, outer] = self.cone(name, light)?;
                LightKind::Spot { position, direction, inner, outer }
            }
            Checked::Invalid => return Err("it is neither a point, a spot nor a directional light".to_owned()),
        };
        if !matches!(kind, LightKind::Directional { .. }) && position.abs().max_element() > MAX_COORDINATE {
            return Err(format!("it is at {position}, beyond {MAX_COORDINATE:e}; move it nearer to the origin"));
        }
        if !matches!(kind, LightKind::Point { .. }) && direction == DVec3::ZERO {
            return Err("it shines in no direction: its node has a scale of 0".to_owned());
        }
        Ok(Light { name: name.to_owned(), intensity, kind })
    }

    /// Inner and outer angle.
    fn cone(&mut self, name: &str, light: &JsonLight) -> Result<[f64; 2], Problem> {
        let spot = light.spot.as_ref().ok_or("it has no cone")?;
        let rounded = [spot.inner_cone_angle, spot.outer_cone_angle];
        let [inner, outer] = exact::cone(&light.extras, rounded).unwrap_or(rounded.map(f64::from));
        // Half a turn over two is rounded up in single precision.
        let outer = if outer as f32 == FRAC_PI_2 as f32 { outer.min(FRAC_PI_2) } else { outer };
        if !(outer > 0.0 && outer <= FRAC_PI_2 && inner >= 0.0) {
            return Err(format!(
                "its cone has the angles {inner} and {outer}; they have to be at least 0 and at most pi/2"
            ));
        }
        if inner >= outer {
            self.warn(format!("light {name}: the falloff of its cone has no width; it gets a small one"));
            return Ok([MAX_INNER * outer, outer]);
        }
        Ok([inner, outer])
    }
}
