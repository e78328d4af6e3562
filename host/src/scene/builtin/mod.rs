//! Scenes that need no file, by their names.
//!
//! ```
//! use restir_host::scene::builtin::{NAMES, scene};
//!
//! let cornell = scene("cornell").expect("a built-in scene");
//! assert!(cornell.has_light() && cornell.camera.is_some());
//! assert!(NAMES.iter().any(|(name, _)| *name == "cornell") && scene("teapot").is_none());
//! ```

use super::{Mesh, Scene};
use crate::Error;

mod ajar;
mod arguments;
mod candles;
mod cornell;
mod cornell_mitsuba;
mod cornell_mixed;
mod cube;
mod foliage;
mod furnace;
mod glass;
mod glossy;
mod hall;
mod isosurface;
mod many_lights;
#[cfg(test)]
mod measure;
mod moving;
mod parts;
mod random;
mod slab;
mod statue;
mod tower;
mod toys;

pub(in crate::scene) use random::Random;

/// Name of each built-in scene, and a line about it.
pub const NAMES: &[(&str, &str)] = &[
    ("cornell", "the Cornell box from its measured data"),
    ("cornell-mitsuba", "the Cornell box as Mitsuba 3 has it (mi.cornell_box()), for comparisons with Mitsuba"),
    ("furnace", "inside a closed box that emits 1 and reflects 0.5: at depth n every pixel is 2 (1 - 0.5^n)"),
    ("cornell-mixed", "the Cornell box with glossy blocks, a mirror and a glass sphere"),
    ("ajar", "two rooms and a door ajar; the only light is in the far room"),
    ("many-lights", "a hall of stalls with more than 10000 emissive triangles, most of them hidden"),
    ("glossy", "a corridor of metal and plastic whose roughness grows with the distance"),
    ("glass", "a mirror, and glass that is smooth, rough, or coloured by absorption"),
    ("tower", "two towers of bricks at night: a sky of small bright lights, a shadow side lit indirectly"),
    ("moving", "a room with a moving board, lamp and ball, and lights that go out and come back: frame f is time f"),
    (
        "toys",
        "a tentacle on joints, a ball with morph targets, a carousel of nodes and a camera on a rail: 4 s, 24 frames each",
    ),
    ("foliage", "a terrace under leaves, with a veil and a paper lantern: masks and blending"),
    ("candles", "candles that burn inside of their wax, and a block of milk: lights inside of bodies that scatter"),
    ("cube", "a cube of wax between a small light at its back and a large one above"),
    ("slab", "a slab of a scattering medium, one mean free path thick, under a white sky"),
    (
        "statue",
        "a hare in the colour of wax: one closed mesh with ears, fingers and a thick belly, to be filled with a medium",
    ),
];

/// Scenes that are made of a seed or of arguments: what their names are like, and a line about them. What goes through all built-in
/// scenes does not go through these.
#[doc(hidden)]
pub const FAMILIES: &[(&str, &str)] = &[
    ("hall-SEED", "a hall by a generator, hall-1 for instance: 60 to 959 lights, glossy and diffuse surfaces"),
    ("cube:depth=D", "the cube as a slab of that depth, at most 1"),
    (
        "slab:ARGUMENTS",
        "a slab by any of depth=4,albedo=0.99,g=0.5,border=dielectric (or open, denser-outside, clear); depth in mean free paths",
    ),
];

/// A scene that takes arguments, made with the ones that are written behind its name, `slab:depth=4` for instance; none for the name of anything
/// else.
///
/// # Errors
/// [`Error::Scene`] for arguments that the scene does not have, and for values that it cannot take.
pub(crate) fn varied(name: &str) -> Option<Result<Scene, Error>> {
    match name.split_once(':')? {
        ("cube", arguments) => Some(cube::varied(name, arguments)),
        ("slab", arguments) => Some(slab::varied(name, arguments)),
        _ => None,
    }
}

/// The built-in scene called `name`, if there is one.
pub fn scene(name: &str) -> Option<Scene> {
    match name {
        "cornell" => Some(cornell::scene()),
        "cornell-mitsuba" => Some(cornell_mitsuba::scene()),
        "furnace" => Some(furnace::scene()),
        "cornell-mixed" => Some(cornell_mixed::scene()),
        "ajar" => Some(ajar::scene(AJAR_DEGREES)),
        "many-lights" => Some(many_lights::scene()),
        "glossy" => Some(glossy::scene()),
        "glass" => Some(glass::scene()),
        "tower" => Some(tower::scene()),
        "moving" => Some(moving::scene()),
        "toys" => Some(toys::scene()),
        "foliage" => Some(foliage::scene()),
        "candles" => Some(candles::scene()),
        "cube" => Some(cube::scene()),
        "slab" => Some(slab::scene()),
        "statue" => Some(statue::scene()),
        _ => generated(name),
    }
}

/// A seed is written as numbers are, without signs or zeros before it.
fn generated(name: &str) -> Option<Scene> {
    let seed = name.strip_prefix(hall::PREFIX)?.parse().ok()?;
    (name == format!("{}{seed}", hall::PREFIX)).then(|| hall::scene(seed))
}

/// How far the door of `ajar` is open.
const AJAR_DEGREES: f64 = 16.68;

/// Planar quadrilaterals, their corners counter-clockwise as seen from the front.
fn quads(quads: &[[[f64; 3]; 4]]) -> Mesh {
    let first = (0..quads.len() as u32).map(|quad| 4 * quad);
    Mesh {
        positions: quads.as_flattened().iter().map(|corner| corner.map(|x| x as f32)).collect(),
        indices: first.flat_map(|i| [[i, i + 1, i + 2], [i, i + 2, i + 3]]).collect(),
        ..Mesh::default()
    }
}

/// The faces of the cube from -1 to 1, front sides out.
const CUBE: [[[f64; 3]; 4]; 6] = [
    [[1.0, -1.0, -1.0], [1.0, 1.0, -1.0], [1.0, 1.0, 1.0], [1.0, -1.0, 1.0]],
    [[-1.0, -1.0, 1.0], [-1.0, 1.0, 1.0], [-1.0, 1.0, -1.0], [-1.0, -1.0, -1.0]],
    [[-1.0, 1.0, 1.0], [1.0, 1.0, 1.0], [1.0, 1.0, -1.0], [-1.0, 1.0, -1.0]],
    [[-1.0, -1.0, -1.0], [1.0, -1.0, -1.0], [1.0, -1.0, 1.0], [-1.0, -1.0, 1.0]],
    [[-1.0, -1.0, 1.0], [1.0, -1.0, 1.0], [1.0, 1.0, 1.0], [-1.0, 1.0, 1.0]],
    [[-1.0, 1.0, -1.0], [1.0, 1.0, -1.0], [1.0, -1.0, -1.0], [-1.0, -1.0, -1.0]],
];

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;

    /// Centre and unit normal of every triangle of the mesh, in world space.
    fn faces(scene: &Scene, mesh_name: &str) -> Vec<(DVec3, DVec3)> {
        let mut faces = Vec::new();
        for instance in scene.instances.iter().filter(|instance| scene.meshes[instance.mesh].name == mesh_name) {
            for corners in scene.meshes[instance.mesh].triangles() {
                let [a, b, c] = corners.map(|corner| instance.transform.transform_point3(corner));
                faces.push(((a + b + c) / 3.0, (b - a).cross(c - a).normalize()));
            }
        }
        assert!(!faces.is_empty(), "no mesh {mesh_name}");
        faces
    }

    /// Of the cones from the origin to the triangles, positive where their front sides are out.
    fn volume(mesh: &Mesh, origin: DVec3) -> f64 {
        mesh.triangles().map(|[a, b, c]| (a - origin).cross(b - origin).dot(c - origin) / 6.0).sum()
    }

    fn centre_of(faces: &[(DVec3, DVec3)]) -> DVec3 {
        faces.iter().map(|(centre, _)| *centre).sum::<DVec3>() / faces.len() as f64
    }

    /// All triangles face the origin, or away from the mesh's middle.
    fn assert_faces(scene: &Scene, mesh: &str, inwards: bool) {
        let faces = faces(scene, mesh);
        let (middle, sign) = if inwards { (DVec3::ZERO, 1.0) } else { (centre_of(&faces), -1.0) };
        for (centre, normal) in faces {
            assert!(sign * normal.dot(middle - centre) > 0.0, "{mesh}: {centre} {normal}");
        }
    }

    #[test]
    fn every_name_is_a_sound_scene_with_closed_glass() {
        for (name, _) in NAMES {
            let built = scene(name).unwrap();
            assert_eq!(built.name, *name);
            assert!(built.has_light() && built.camera.is_some() && built.default_size.is_some());
            for mesh in &built.meshes {
                let material = &built.materials[mesh.material];
                assert!(!material.is_textured() || !mesh.uvs.is_empty(), "{name}: {}", mesh.name);
                // the volume between an origin and the surface is the same for all origins if the surface is closed
                let [here, there] = [DVec3::ZERO, DVec3::new(3.0, -5.0, 7.0)].map(|origin| volume(mesh, origin));
                let closed = here > 0.0 && (there / here - 1.0).abs() < 1e-4;
                assert!(material.volume.is_none() || closed, "{name}: {} {here} {there}", mesh.name);
            }
            // which refuses what is inconsistent
            let stats = crate::buffers::SceneBuffers::build(&built).unwrap().stats();
            assert_eq!(stats.skipped_triangles, 0, "{name} has triangles without area");
        }
        assert!(
            ["Cornell", "hall", "hall-", "slab:depth=2", "hall-01", "hall-+1", "hall-4294967296"]
                .iter()
                .all(|name| scene(name).is_none())
        );
    }

    #[test]
    fn arguments_are_taken_or_refused_in_a_sentence() {
        let thin = varied("cube:depth=0.25").expect("takes arguments").expect("a depth that there is");
        let reach = thin.meshes[1].positions.iter().map(|p| p[2]).fold(f32::NEG_INFINITY, f32::max);
        assert_eq!((reach, thin.name.as_str()), (-0.25, "cube:depth=0.25"));
        assert!(varied("slab").is_none() && varied("cornell:depth=1").is_none() && varied("C:\\slab").is_none());
        for (name, known) in [
            ("slab:", "is no argument"),
            ("slab:depth", "depth=..., albedo=..., g=..., border=..."),
            ("slab:thickness=2", "\"thickness=2\""),
            ("slab:depth=0", "from 0.000001 to 1000000"),
            ("slab:depth=NaN", "NaN"),
            ("slab:albedo=1.1", "from 0 to 1"),
            ("slab:depth=1,depth=2", "twice"),
            ("slab:border=glass", "open, denser-outside, dielectric, clear"),
            ("cube:depth=2", "from 0.001 to 1"),
        ] {
            let message = varied(name).expect("takes arguments").expect_err(name).to_string();
            assert!(message.contains(known) && message.contains(name), "{name}: {message}");
        }
    }

    #[test]
    fn the_rooms_face_inwards_and_the_blocks_outwards() {
        for (name, blocks) in
            [("cornell", ["short block", "tall block"]), ("cornell-mitsuba", ["small-box", "large-box"])]
        {
            let built = scene(name).unwrap();
            for mesh in &built.meshes {
                assert_faces(&built, &mesh.name, !blocks.contains(&mesh.name.as_str()));
            }
        }
        assert_faces(&scene("furnace").unwrap(), "walls", true);
    }

    #[test]
    fn the_two_cornell_boxes_are_alike() {
        let size = |name: &str| {
            let [lo, hi] = scene(name).unwrap().bounds();
            [0, 1, 2].map(|axis| f64::from(hi[axis]) - f64::from(lo[axis]))
        };
        for name in ["cornell", "cornell-mitsuba"] {
            assert!(size(name).iter().all(|extent| (extent - 2.0).abs() < 0.03), "{name}: {:?}", size(name));
            let built = scene(name).unwrap();
            let red = built.materials.iter().position(|material| material.name == "red").unwrap();
            let wall = built.meshes.iter().find(|mesh| mesh.material == red).unwrap();
            assert!(centre_of(&faces(&built, &wall.name)).x < -0.9, "red is on the left");
        }
    }
}
