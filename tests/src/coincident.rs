//! Lamps that lie in other surfaces, in a room whose other light is dim: what loaders make of doubled nodes, of lamps flush with a ceiling, and of decals.

use crate::scenes::matte;
use glam::{DAffine3, DQuat, DVec3};
use restir_host::Error;
use restir_host::buffers::SceneBuffers;
use restir_host::scene::{AlphaMode, Camera, Instance, Material, Mesh, Scene};
use restir_shared::layout::TRIANGLE_WORDS;
use std::sync::Arc;

/// What lies in what.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Arrangement {
    /// A red lamp and a green one of the same mesh, in the same place.
    DoubledNodes,
    /// Every face twice in one mesh, once from each side.
    DoubledFaces,
    /// A turned lamp in the plane of a sloping ceiling.
    Flush,
    /// A lamp in the plane of a wall, half beside it, that half of all rays miss.
    Decal,
    /// Red and green lamps of one plane, of which a part overlaps.
    Overlapping,
    /// A red lamp behind a ceiling, by a distance that rays can tell, and a green one elsewhere.
    Hidden,
}

/// All of them.
pub const ARRANGEMENTS: [Arrangement; 6] = [
    Arrangement::DoubledNodes,
    Arrangement::DoubledFaces,
    Arrangement::Flush,
    Arrangement::Decal,
    Arrangement::Overlapping,
    Arrangement::Hidden,
];

const RED: [f32; 3] = [8.0, 1.0, 2.0];
const GREEN: [f32; 3] = [1.0, 8.0, 2.0];
/// Where ceilings slope: no coordinate of their points is exact.
const SLOPE: f64 = 0.3;

impl Arrangement {
    /// The scene, with its objects in the order of the file or from the last to the first.
    pub fn scene(self, reversed: bool) -> Scene {
        let eye = DVec3::new(0.1, 0.5, 3.2);
        let mut scene = Scene {
            name: format!("{self:?}"),
            camera: Some(Camera::pinhole(eye, DVec3::new(0.0, 0.7, 0.0), DVec3::Y, 0.8)),
            ..Scene::default()
        };
        let white = scene.add_material(matte([0.6, 0.6, 0.6]));
        let mut objects = vec![
            (white, Mesh::quad(DVec3::new(-1.5, 0.0, -1.0), [DVec3::Z * 3.0, DVec3::X * 3.0])),
            (white, Mesh::quad(DVec3::new(-1.5, 0.0, -1.0), [DVec3::X * 3.0, DVec3::Y * 2.0])),
        ];
        let mut emitter = |color, other: fn(&mut Material)| {
            let mut material = Material::emitter("", [0.3; 3], color);
            other(&mut material);
            scene.add_material(material)
        };
        let ceiling = placed(Mesh::quad(DVec3::new(-1.3, 0.0, -1.0), [DVec3::X * 2.6, DVec3::Z * 2.0]), 0.0, 0.0);
        match self {
            Self::DoubledNodes => {
                let lamp = placed(square(0.6), 0.2, 0.0);
                objects.extend([(emitter(RED, |_| ()), lamp.clone()), (emitter(GREEN, |_| ()), lamp)]);
            }
            Self::DoubledFaces => {
                let mut lamp = placed(square(0.6), 0.2, 0.0);
                lamp.indices.extend(lamp.indices.clone().into_iter().map(|[a, b, c]| [a, c, b]));
                objects.push((emitter(GREEN, |_| ()), lamp));
            }
            Self::Flush => objects.extend([(white, ceiling), (emitter(GREEN, |_| ()), placed(square(0.6), 0.7, 0.0))]),
            Self::Decal => {
                let blended = emitter(GREEN, |material| {
                    (material.alpha, material.alpha_mode) = (0.5, AlphaMode::Blend);
                    material.two_sided_emission = true;
                });
                let half = Mesh::quad(DVec3::new(-1.3, 0.0, -1.0), [DVec3::X * 1.3, DVec3::Z * 2.0]);
                objects.extend([(white, placed(half, 0.0, 0.0)), (blended, placed(square(0.5), 0.4, 0.0))]);
            }
            Self::Overlapping => {
                objects.extend([
                    (emitter(RED, |_| ()), placed(square(0.6), 0.7, 0.0)),
                    (emitter(GREEN, |_| ()), placed(square(0.5), -0.2, 0.0)),
                ]);
            }
            Self::Hidden => {
                let elsewhere = placed(square(0.5), 0.1, -0.3);
                objects.extend([
                    (white, ceiling),
                    (emitter(RED, |_| ()), placed(square(0.6), 0.7, 4.0e-6)),
                    (emitter(GREEN, |_| ()), elsewhere),
                ]);
            }
        }
        if reversed {
            objects.reverse();
        }
        for (material, mesh) in objects {
            scene.meshes.push(Arc::new(Mesh { material, uvs: Vec::new(), ..mesh }));
            scene.instances.push(Instance::new(scene.meshes.len() - 1, DAffine3::IDENTITY));
        }
        scene
    }

    /// The channel in which the image is brightest; of two lamps that both shine none.
    pub fn brightest(self, reversed: bool) -> Option<usize> {
        match self {
            Self::DoubledNodes => Some(usize::from(reversed)),
            Self::Overlapping => None,
            Self::DoubledFaces | Self::Flush | Self::Decal | Self::Hidden => Some(1),
        }
    }
}

/// A square in the plane y = 0 around the origin, facing down.
fn square(half: f64) -> Mesh {
    Mesh::quad(DVec3::new(-half, 0.0, -half), [DVec3::X * 2.0 * half, DVec3::Z * 2.0 * half])
}

/// A mesh in the plane y = 0, turned about y, put into the sloping plane of ceilings, and lifted off it.
fn placed(mesh: Mesh, turn: f64, lift: f64) -> Mesh {
    let place = DAffine3::from_rotation_translation(
        DQuat::from_rotation_x(SLOPE) * DQuat::from_rotation_y(turn),
        DVec3::new(0.0, 1.5, 0.1),
    );
    let lift = DQuat::from_rotation_x(SLOPE) * DVec3::Y * lift;
    let moved =
        |p: &[f32; 3]| (place.transform_point3(DVec3::from_array(p.map(f64::from))) + lift).as_vec3().to_array();
    Mesh { positions: mesh.positions.iter().map(moved).collect(), ..mesh }
}

/// The scene's triangles where the scene has them: nothing is set apart.
///
/// # Errors
/// As of [`SceneBuffers::build`].
pub fn as_they_are(scene: &Scene) -> Result<SceneBuffers, Error> {
    let mut buffers = SceneBuffers::build(scene)?;
    // its triangles have the same order
    let places = SceneBuffers::build_editable(scene)?.triangle_ids().unwrap_or_default();
    let mut words = buffers.geometry.to_vec();
    for (id, [instance, index]) in places.into_iter().enumerate() {
        let mesh = &scene.meshes[scene.instances[instance as usize].mesh];
        let first = (buffers.header.triangle_base as usize + id * TRIANGLE_WORDS as usize) * 4;
        for (corner, vertex) in mesh.indices[index as usize].into_iter().enumerate() {
            let position = mesh.positions[vertex as usize].map(f32::to_bits);
            words[first + 4 * corner..][..3].copy_from_slice(&position);
        }
    }
    buffers.geometry = words.into();
    Ok(buffers)
}
