//! A wide slab of a scattering medium under a sky that is white above the horizon: as bright as what is reflected is every pixel, and as
//! what is transmitted, seen from below. It is one mean free path thick, unless it is asked for otherwise.

use glam::DVec3;

use super::arguments::Arguments;
use super::parts::{sky, stage, waxy};
use crate::Error;
use crate::scene::{Material, Mesh, Scene, Volume, VolumeScattering};

/// Light that enters far from the border does not reach it.
const SIDE: f64 = 80.0;
/// What of a collision is scattered.
const ALBEDO: f64 = 0.9;
/// Of dielectric borders.
const INDEX: f32 = 1.4;

#[derive(Clone, Copy)]
enum Border {
    Open,
    DenserOutside,
    Dielectric,
    Clear,
}

pub(super) fn scene() -> Scene {
    built("slab", 1.0, [ALBEDO, 0.0], Border::Open)
}

/// The slab that `name` asks for by the arguments in `text`.
pub(super) fn varied(name: &str, text: &str) -> Result<Scene, Error> {
    let given = Arguments::parse(name, text, &["depth", "albedo", "g", "border"])?;
    let borders = [
        ("open", Border::Open),
        ("denser-outside", Border::DenserOutside),
        ("dielectric", Border::Dielectric),
        ("clear", Border::Clear),
    ];
    let depth = given.number("depth", 1.0, 1.0e-6..=1.0e6)?;
    let medium = [given.number("albedo", ALBEDO, 0.0..=1.0)?, given.number("g", 0.0, -0.999..=0.999)?];
    Ok(built(name, depth, medium, given.choice("border", &borders)?))
}

/// What a half space reflects (van de Hulst): the colour that is written for an albedo.
fn color([albedo, g]: [f64; 2]) -> f32 {
    let s = ((1.0 - albedo) / (1.0 - g * albedo)).sqrt();
    ((1.0 - s) * (1.0 - 0.139 * s) / (1.0 + 1.17 * s)) as f32
}

/// One unit thick, which is `depth` mean free paths.
fn built(name: &str, depth: f64, medium: [f64; 2], border: Border) -> Scene {
    let mut scene = stage(name, [DVec3::new(0.0, 6.0, 0.0), DVec3::new(0.3, 0.0, 0.1)], 40.0, [64, 64]);
    scene.environment = Some(sky("above", [4, 256], |direction| if direction.y > 0.0 { [1.0; 3] } else { [0.0; 3] }));
    let mut volume = Volume::scattering([color(medium); 3], [(1.0 / depth) as f32; 3], medium[1] as f32);
    if let Border::DenserOutside = border {
        volume.scattering = volume.scattering.map(|s| VolumeScattering { denser_outside: INDEX, ..s });
    }
    let diffuse = waxy("medium", volume);
    let smooth =
        |ior| Material { diffuse_transmission: 0.0, transmission: 1.0, roughness: 0.0, ior, ..diffuse.clone() };
    let medium = scene.add_material(match border {
        Border::Open | Border::DenserOutside => diffuse,
        Border::Dielectric => smooth(INDEX),
        Border::Clear => smooth(1.0),
    });
    let half = 0.5 * SIDE;
    scene.add_mesh("slab", medium, Mesh::cuboid(DVec3::new(-half, -1.0, -half), DVec3::new(half, 0.0, half)));
    scene
}

#[cfg(test)]
mod tests {
    use restir_shared::glam::Vec3;
    use restir_shared::medium::Medium;

    use super::*;

    /// What was asked for is what the medium has, as it is and as the kernels see it.
    #[test]
    fn the_medium_is_what_is_asked_for() {
        for (name, text, [depth, albedo, g]) in [
            ("slab", "", [1.0, 0.9, 0.0]),
            ("slab:", "depth=4,albedo=0.99,g=0.5,border=dielectric", [4.0, 0.99, 0.5]),
            ("slab:", "g=-0.3,border=denser-outside", [1.0, 0.9, -0.3]),
        ] {
            let built = if text.is_empty() { scene() } else { varied(name, text).expect("arguments that there are") };
            let volume = built.materials[0].volume.expect("an interior");
            let scattering = volume.scattering.expect("scatters");
            let medium = Medium::of_color(Vec3::from_array(scattering.color), Vec3::ONE, scattering.anisotropy);
            let found = [f64::from(volume.extinction()[1]), f64::from(medium.albedo.y), f64::from(medium.anisotropy)];
            let near = |(a, b): (f64, f64)| (a - b).abs() < 1.0e-6 * b.abs().max(1.0);
            assert!(found.into_iter().zip([depth, albedo, g]).all(near), "{name}{text}: {found:?}");
        }
    }

    #[test]
    fn borders_are_those_that_are_asked_for() {
        let material =
            |border: &str| varied("slab:", &format!("border={border}")).expect("a border").materials.remove(0);
        let of = |border: &str| {
            let Material { transmission, diffuse_transmission, ior, volume, .. } = material(border);
            (
                transmission,
                diffuse_transmission,
                ior,
                volume.and_then(|v| v.scattering).map_or(0.0, |s| s.denser_outside),
            )
        };
        assert_eq!(of("dielectric"), (1.0, 0.0, 1.4, 1.0));
        assert_eq!(of("clear"), (1.0, 0.0, 1.0, 1.0));
        assert_eq!((of("open").1, of("open").3, of("denser-outside").3), (1.0, 1.0, 1.4));
    }
}
