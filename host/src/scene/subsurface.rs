//! Media by name, such as marble and milk, and bodies that are filled with them.
//!
//! ```
//! use restir_host::scene::subsurface::medium;
//! use restir_host::scene::{Material, Mesh, Scene};
//! use restir_shared::glam::DVec3;
//!
//! let mut scene = Scene::default();
//! let white = scene.add_material(Material::diffuse("white", [0.8; 3]));
//! scene.add_mesh("block", white, Mesh::cuboid(DVec3::ZERO, DVec3::ONE));
//!
//! // the block becomes one of marble, where a millimetre is a hundredth of the scene's unit
//! scene.fill("marble", Some(0.01))?;
//! let material = &scene.materials[scene.meshes[0].material];
//! let marble = medium("marble", 0.01)?;
//! assert_eq!(material.volume, Some(marble.clone()));
//! // its blue has the shortest mean free path, 3.95 millimetres
//! assert!((1.0 / marble.extinction()[2] - 0.0395).abs() < 1e-4);
//! # Ok::<(), restir_host::Error>(())
//! ```

use std::sync::Arc;

use super::closed::closed;
use super::{Material, Mesh, Scene, Volume, VolumeScattering};
use crate::Error;
use crate::settings::unknown;
use restir_shared::medium::color_behind;

/// A medium: its colour, linear RGB, and its mean free path in millimetres. The numbers are those of NVIDIA's RTXCR (Zhang and d'Eon 2025), which
/// go back to the measurements of Jensen et al. (2001, table 1), but for those of wax, which are ours, and of apple, where RTXCR repeats
/// chicken: its numbers are those of Werner et al. (2024).
pub const MEDIA: &[(&str, [f32; 3], [f32; 3])] = &[
    ("apple", [0.846, 0.841, 0.528], [6.96, 6.40, 1.90]),
    ("chicken", [0.44, 0.22, 0.14], [9.44, 3.35, 1.79]),
    ("cream", [0.99, 0.94, 0.83], [15.03, 4.66, 2.54]),
    ("ketchup", [0.22, 0.01, 0.001], [4.76, 0.57, 0.39]),
    ("marble", [0.93, 0.91, 0.88], [8.51, 5.57, 3.95]),
    ("milk", [0.95, 0.93, 0.85], [10.90, 6.58, 2.51]),
    ("potato", [0.86, 0.74, 0.29], [14.27, 7.23, 2.04]),
    ("skim-milk", [0.89, 0.89, 0.80], [18.42, 10.44, 3.50]),
    ("skin1", [0.57, 0.31, 0.17], [3.67, 1.37, 0.68]),
    ("skin2", [0.75, 0.57, 0.47], [4.82, 1.69, 1.09]),
    ("wax", [0.95, 0.87, 0.70], [6.0, 4.0, 2.0]),
];

/// Mean free paths below this, in units of the scene, are refused, and those beyond its reciprocal.
const SHORTEST: f32 = 1.0e-20;

/// Colours behind dielectrics are fitted up to this index of refraction.
const LARGEST_INDEX: f32 = 1.8;

/// How large a body is taken to be, corner to corner, unless a scale says how long a millimetre is.
const USUAL_SIZE: f64 = 100.0;

/// The interior of the medium called `name`, where a millimetre is `scale` > 0 units of the scene. A colour, as in `0.9,0.5,0.2`, is a name, too: of
/// what has it and a mean free path of a millimetre.
///
/// # Errors
/// [`Error::Unknown`] for a name that there is not, [`Error::Medium`] for what is no colour, and for a scale that cannot be rendered.
pub fn medium(name: &str, scale: f64) -> Result<Volume, Error> {
    let (color, mean_free_path) = if name.contains(',') { (color(name)?, [1.0; 3]) } else { known(name)? };
    let scaled = mean_free_path.map(|mean| (f64::from(mean) * scale) as f32);
    if !scaled.iter().all(|mean| SHORTEST <= *mean && *mean <= 1.0 / SHORTEST) {
        return Err(refused(name, format!("a millimetre of {scale} units is beyond what can be rendered")));
    }
    Ok(Volume::scattering(color, scaled, 0.0))
}

fn known(name: &str) -> Result<([f32; 3], [f32; 3]), Error> {
    let found = MEDIA.iter().find(|(of, ..)| *of == name).map(|(_, color, mean_free_path)| (*color, *mean_free_path));
    let names = MEDIA.iter().map(|(of, ..)| *of).chain(["a colour, as 0.9,0.5,0.2"]);
    found.ok_or_else(|| unknown("medium", name, names))
}

fn color(text: &str) -> Result<[f32; 3], Error> {
    let numbers: Option<Vec<f32>> = text.split(',').map(|number| number.trim().parse().ok()).collect();
    let color = numbers.and_then(|numbers| <[f32; 3]>::try_from(numbers).ok());
    let color = color.filter(|color| color.iter().all(|channel| (0.0..=1.0).contains(channel)));
    color.ok_or_else(|| refused(text, "a colour has three numbers from 0 to 1, as 0.9,0.5,0.2".to_owned()))
}

fn refused(medium: &str, problem: String) -> Error {
    Error::Medium { medium: medium.to_owned(), problem }
}

impl Scene {
    /// Fills all bodies, which are closed meshes that emit nothing, with their front sides out, with the medium called `name`, which light enters and leaves by Lambert's
    /// law. A body of glass, which transmits all light specularly, keeps its surface, and its medium is one that has the colour behind it. A millimetre is `scale` units of the scene; without one, each body is taken to be ten centimetres large, as its first instance is.
    ///
    /// # Errors
    /// [`Error::Unknown`] for a name that there is not; [`Error::Medium`] for a scale that is no positive number, and if no mesh is closed.
    pub fn fill(&mut self, name: &str, scale: Option<f64>) -> Result<(), Error> {
        if let Some(scale) = scale.filter(|scale| !(scale.is_finite() && *scale > 0.0)) {
            return Err(refused(
                name,
                format!("a millimetre cannot be {scale} units long; the scale is a positive number"),
            ));
        }
        medium(name, 1.0)?;
        let mut filled = false;
        for index in 0..self.meshes.len() {
            let (mesh, size) = (self.meshes[index].clone(), self.size(index));
            let dark = self.materials[mesh.material].emission == [0.0; 3];
            let body = closed(&mesh).filter(|body| dark && size > 0.0 && volume(body) > 0.0);
            if let Some(body) = body {
                let volume = medium(name, scale.unwrap_or(size / USUAL_SIZE))?;
                let surface = &self.materials[mesh.material];
                let material = self.add_material(filled_with(surface, format!("{name} of {}", mesh.name), volume));
                self.meshes[index] = Arc::new(Mesh { material, ..body });
                filled = true;
            }
        }
        let problem = "no mesh of the scene is closed and emits nothing, so that none can be filled";
        if filled { Ok(()) } else { Err(refused(name, problem.to_owned())) }
    }

    /// How large a mesh is in the world, corner to corner, by its first instance; 0 without one.
    fn size(&self, mesh: usize) -> f64 {
        let instance = self.instances.iter().find(|instance| instance.mesh == mesh);
        instance.map_or(0.0, |instance| {
            let positions = self.meshes[mesh].positions.iter();
            let placed = positions.map(|p| instance.transform.transform_point3(super::double(*p)));
            let (lo, hi) =
                placed.fold((glam::DVec3::INFINITY, glam::DVec3::NEG_INFINITY), |(lo, hi), p| (lo.min(p), hi.max(p)));
            if lo.x <= hi.x { (hi - lo).length() } else { 0.0 }
        })
    }
}

/// The material of a body that had the material `surface` and is filled.
fn filled_with(surface: &Material, name: String, volume: Volume) -> Material {
    let white = Material::diffuse(name.clone(), [1.0; 3]);
    if surface.transmission < 1.0 || surface.metallic > 0.0 {
        return Material { diffuse_transmission: 1.0, volume: Some(volume), ..white };
    }
    // a dielectric keeps light inside, so that the same medium is darker behind it
    let behind = |color: f32| color_behind(color, surface.ior.min(LARGEST_INDEX));
    let scattering = volume.scattering.map(|s| VolumeScattering { color: s.color.map(behind), ..s });
    let Material { transmission, roughness, ior, .. } = *surface;
    Material { transmission, roughness, ior, volume: Some(Volume { scattering, ..volume }), ..white }
}

/// The volume that a closed mesh encloses; negative where its front sides are inside, as of a room.
fn volume(mesh: &Mesh) -> f64 {
    let about = mesh.positions.first().map_or(glam::DVec3::ZERO, |p| super::double(*p));
    mesh.triangles().map(|corners| corners.map(|p| p - about)).map(|[p, q, r]| p.cross(q).dot(r) / 6.0).sum()
}

#[cfg(test)]
mod tests {
    use super::super::closed::is_closed;
    use super::*;
    use crate::scene::builtin;
    use glam::DVec3;

    #[test]
    fn rooms_are_no_bodies() {
        let cube = Mesh::cuboid(DVec3::splat(4.0), DVec3::splat(5.0));
        let mut degenerate = cube.clone();
        degenerate.indices.push([0, 0, 1]);
        assert!(is_closed(&degenerate) && (volume(&degenerate) - 1.0).abs() < 1.0e-9);
        let room = Mesh { indices: cube.indices.iter().map(|&[a, b, c]| [a, c, b]).collect(), ..cube };
        assert!(is_closed(&room) && volume(&room) < 0.0);
    }

    #[test]
    fn a_colour_is_a_medium_of_a_mean_free_path_of_a_millimetre() {
        let found = medium("0.9, 0.5,0", 0.25).expect("a colour");
        assert_eq!(found, Volume::scattering([0.9, 0.5, 0.0], [0.25; 3], 0.0));
    }

    #[test]
    fn a_body_of_glass_keeps_its_surface_and_has_the_colour_behind_it() {
        let mut scene = Scene::default();
        let glass = Material { transmission: 1.0, roughness: 0.2, ior: 1.4, ..Material::diffuse("glass", [0.5; 3]) };
        let glass = scene.add_material(glass);
        scene.add_mesh("bead", glass, Mesh::sphere(DVec3::ZERO, 1.0, 2));
        scene.fill("marble", Some(0.1)).expect("closed");
        let body = &scene.materials[scene.meshes[0].material];
        assert_eq!((body.transmission, body.roughness, body.ior, body.base_color), (1.0, 0.2, 1.4, [1.0; 3]));
        let color = body.volume.and_then(|v| v.scattering).expect("a medium").color;
        let [marble, ..] = medium("marble", 0.1).expect("known").scattering.expect("scatters").color;
        // a whiter medium, as white as marble without a surface
        assert!(color[0] == color_behind(marble, 1.4) && color[0] > marble + 0.02 && color[0] < 1.0, "{color:?}");
    }

    #[test]
    fn bodies_of_a_scene_are_filled_and_nothing_else() {
        let mut scene = builtin::scene("statue").expect("built in");
        let before = scene.clone();
        scene.fill("marble", None).expect("the statue is closed");
        let filled = |index: usize| scene.materials[scene.meshes[index].material].volume.is_some();
        for index in 0..scene.meshes.len() {
            assert_eq!(filled(index), is_closed(&before.meshes[index]), "{}", before.meshes[index].name);
        }
        for (name, scale, known) in [
            ("granite", None, "marble"),
            ("milk", Some(0.0), "milk:"),
            ("wax", Some(f64::NAN), "positive"),
            ("0.2,0.3", None, "three numbers"),
            ("0.2,0.3,1.1", None, "from 0 to 1"),
            ("0.2,NaN,0.3", None, "from 0 to 1"),
        ] {
            assert!(before.clone().fill(name, scale).unwrap_err().to_string().contains(known));
        }
    }
}
