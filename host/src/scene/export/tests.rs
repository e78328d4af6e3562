//! What is exported comes back. The suite `gltf` has built-in scenes and files.

use std::sync::Arc;

use glam::{DAffine3, DQuat, DVec3};

use super::*;
use crate::scene::{
    AlphaMode, Camera, Filter, Instance, Light, LightKind, Material, Mesh, Texels, Texture, TextureUse, UvSet, Volume,
    VolumeScattering, Wrap, gltf,
};

fn back(scene: &Scene) -> Scene {
    gltf::import(&scene.name, &glb(scene).unwrap(), None).unwrap()
}

/// All of a scene, numbers written so that no bit is lost.
fn text(scene: &Scene) -> String {
    let Scene { meshes, instances, materials, textures, lights, camera, default_size, warnings, .. } = scene;
    // the import says of its volumes that they are open
    let warnings: Vec<&String> = warnings.iter().filter(|warning| !warning.contains("is not closed")).collect();
    format!(
        "{meshes:?}\n{instances:?}\n{materials:?}\n{textures:?}\n{lights:?}\n{camera:?}{default_size:?}{warnings:?}"
    )
}

fn texture(name: &str, alpha: u8) -> Texture {
    let texels = (0..15).map(|i| [i, 255 - i, 16 * i, alpha.saturating_sub(i)]).collect();
    Texture { name: name.to_owned(), size: [5, 3], texels, wrap: [Wrap::Mirror, Wrap::Clamp], filter: Filter::Nearest }
}

/// A scene with everything, and with numbers that single precision does not hold.
fn everything() -> Scene {
    let painted = texture("painted", 255);
    // of sixteen bits
    let shades = texture("", 250).texels.iter().map(|[r, g, b, a]| [r ^ 1, g, b, a]).collect();
    let translucent = Texture { texels: Texels::new(shades), ..texture("translucent", 255) };
    let repeated = Texture { name: "repeated".to_owned(), wrap: [Wrap::Repeat; 2], ..painted.clone() };
    let sheared = TextureUse { texture: 2, transform: [1.0, 0.1, 0.3, 0.7, 2.0, 0.1], uv_set: UvSet::Second };
    let turned = TextureUse { texture: 1, transform: [0.6, 0.8, 0.1, -0.8, 0.6, 0.2], uv_set: UvSet::First };
    let glazed = Material {
        alpha: 0.4,
        alpha_mode: AlphaMode::Mask { cutoff: 0.3 },
        base_color_texture: Some(TextureUse::new(0)),
        metallic: 0.3,
        roughness: 0.7,
        metallic_roughness_texture: Some(turned),
        normal_texture: Some(sheared),
        normal_scale: 0.9,
        emission_texture: Some(TextureUse { transform: [-2.0, 0.0, 0.1, 0.0, 3.0, 0.2], ..turned }),
        two_sided_emission: true,
        ior: 1.33,
        specular: 0.6,
        specular_texture: Some(TextureUse::new(2)),
        specular_color: [0.5, 0.25, 3.0],
        specular_color_texture: Some(turned),
        ..Material::emitter("glazed", [0.1, 0.2, 0.3], [0.7, 33.3, 1e-7])
    };
    let glass = Material {
        transmission: 0.9,
        diffuse_transmission: 0.1,
        diffuse_transmission_color: [0.9, 0.8, 0.7],
        volume: Some(Volume::absorbing([0.3, 0.6, 0.9], 0.1)),
        ..Material::diffuse("glass", [1.0; 3])
    };
    let clear = Volume::absorbing([1.0; 3], f32::INFINITY);
    let medium = Volume::scattering([0.9, 0.8, 0.7], [0.3, 1e-2, 1e3], -0.3);
    let scattering = medium.scattering.map(|scattering| VolumeScattering {
        denser_outside: 1.3,
        color_texture: Some(turned),
        ..scattering
    });
    let strength_texture = Some(TextureUse::new(2));
    let patchy = scattering.map(|scattering| VolumeScattering { strength_texture, denser_outside: 1.0, ..scattering });
    let cloud = Material {
        transmission: 1.0,
        volume: Some(Volume { scattering: patchy, ..medium }),
        ..Material::diffuse("cloud", [1.0; 3])
    };
    let milk = Material {
        diffuse_transmission: 1.0,
        volume: Some(Volume { scattering, ..medium }),
        ..Material::diffuse("milk", [1.0; 3])
    };
    let water = Material {
        alpha: 0.7,
        alpha_mode: AlphaMode::Blend,
        volume: Some(clear),
        ..Material::diffuse("water", [0.5; 3])
    };
    let unit = |v: DVec3| v.normalize().as_vec3().to_array();
    let corners = [[0.0, 0.0, 0.0], [0.1, 0.0, 0.0], [0.0, 0.3, 1e-30]];
    let shaded = Mesh {
        name: "shaded".to_owned(),
        positions: corners.to_vec(),
        normals: vec![unit(DVec3::new(0.1, 0.2, 0.9)), unit(DVec3::ONE), [0.0, 0.0, 1.0]],
        uvs: vec![[0.1, 0.2], [-3.3, 7.7], [1.0, 0.0]],
        second_uvs: vec![[0.5, 0.1], [2.0, -1.0], [0.3, 0.9]],
        tangents: [1.0, -1.0, 1.0].map(|sign| [1.0, 0.0, 0.0, sign]).to_vec(),
        indices: vec![[0, 1, 2], [2, 1, 0]],
        material: 0,
    };
    let faceted = |name: &str, material| Mesh {
        name: name.to_owned(),
        positions: corners.to_vec(),
        indices: vec![[0, 2, 1]],
        material,
        ..Mesh::default()
    };
    let textured = |name: &str, material| Mesh { uvs: shaded.uvs.clone(), ..faceted(name, material) };
    let (milky, cloudy) = (textured("milk", 3), textured("cloud", 4));
    let turn = DAffine3::from_rotation_translation(DQuat::from_rotation_y(0.1), DVec3::new(0.1, 1e-3, 7.0));
    let light = |name: &str, kind| Light { name: name.to_owned(), intensity: [0.3, 1234.5, 0.0], kind };
    let [position, direction] = [DVec3::new(0.1, 0.2, 0.3), DVec3::new(0.3, -2.0, 0.1)];
    Scene {
        name: "everything".to_owned(),
        meshes: [shaded, faceted("pane", 1), faceted("water", 2), milky, cloudy].map(Arc::new).into(),
        instances: vec![
            Instance::new(0, DAffine3::IDENTITY),
            Instance::new(1, turn),
            Instance::new(0, DAffine3::from_scale(DVec3::new(-2.0, 0.5, 4.0))),
            Instance::new(2, DAffine3::from_scale(DVec3::splat(1.0 / 3.0))),
            Instance::new(3, DAffine3::IDENTITY),
            Instance::new(4, DAffine3::IDENTITY),
        ],
        materials: vec![glazed, glass, water, milk, cloud],
        textures: vec![painted, repeated, translucent],
        lights: vec![
            light("point", LightKind::Point { position }),
            light("spot", LightKind::Spot { position, direction, inner: 0.1, outer: 0.7 }),
            light("sun", LightKind::Directional { direction }),
        ],
        camera: Some(Camera {
            lens_radius: 0.1,
            focus_distance: Some(2.2),
            ..Camera::pinhole(position, DVec3::new(0.7, -0.1, 0.2), DVec3::new(0.1, 0.9, 0.0), 0.7)
        }),
        default_size: Some([640, 360]),
        ..Scene::default()
    }
}

#[test]
fn everything_comes_back() {
    let (expected, found) = (text(&everything()), text(&back(&everything())));
    for (expected, found) in expected.lines().zip(found.lines()) {
        assert_eq!(expected, found);
    }
}

#[test]
fn groups_stay_objects() {
    let mut scene = everything();
    assert_eq!(back(&scene).objects(), [0, 1, 2, 3, 4, 5]);
    for instance in &mut scene.instances {
        instance.group = Some(0);
    }
    // of five materials
    assert_eq!(scene.objects(), [0, 1, 0, 3, 4, 5]);
    assert_eq!(back(&scene).objects(), scene.objects());
}

#[test]
fn equal_scenes_give_equal_files() {
    assert!(glb(&everything()).unwrap() == glb(&everything()).unwrap());
}

#[test]
fn textures_of_the_same_texels_share_an_image() {
    let file = glb(&everything()).unwrap();
    let text = String::from_utf8_lossy(&file);
    assert_eq!(text.matches("image/png").count(), 2);
    let scene = back(&everything());
    assert!(scene.textures[0].texels.is_shared(&scene.textures[1].texels));
}

/// Replaces text of the JSON by text of the same length.
fn edited(scene: &Scene, old: &str, new: &str) -> Scene {
    let file = glb(scene).unwrap();
    let at = file.windows(old.len()).position(|window| window == old.as_bytes()).unwrap();
    let mut changed = file;
    assert_eq!(old.len(), new.len());
    changed[at..at + old.len()].copy_from_slice(new.as_bytes());
    gltf::import("edited", &changed, None).unwrap()
}

#[test]
fn extras_do_not_overrule_what_a_program_changed() {
    let mut scene = everything();
    scene.instances.truncate(2);
    // The translation of the second instance along z.
    let moved = edited(&scene, "7.0,1.0]", "9.0,1.0]");
    assert_eq!(moved.instances[1].transform.translation.z, 9.0);
    assert_eq!(moved.instances[1].transform.translation.x, f64::from(0.1_f32));
    let yfov = format!("\"yfov\":{}", f64::from(0.7_f32));
    let widened = edited(&scene, &yfov, &yfov.replace("0.6", "0.9")).camera.unwrap();
    assert_eq!(widened.lens_radius, 0.0);
    assert!(widened.vertical_fov > 0.9);
}

#[test]
fn what_cannot_be_written_is_refused() {
    let problem = |change: fn(&mut Scene)| {
        let mut scene = everything();
        change(&mut scene);
        glb(&scene).unwrap_err().to_string()
    };
    fn mesh(scene: &mut Scene, index: usize) -> &mut Mesh {
        Arc::make_mut(&mut scene.meshes[index])
    }
    assert!(problem(|s| mesh(s, 0).normals.truncate(1)).contains("attribute for 1"));
    assert!(problem(|s| mesh(s, 0).indices[0][0] = 9).contains("index 9"));
    assert!(problem(|s| mesh(s, 0).material = 9).contains("material 9"));
    assert!(problem(|s| mesh(s, 1).positions[0][1] = f32::NAN).contains("not finite"));
    assert!(problem(|s| s.instances[0].mesh = 9).contains("mesh 9"));
    assert!(problem(|s| s.instances[0].transform.translation.x = f64::NAN).contains("transform"));
    assert!(problem(|s| s.textures[0].size = [4, 4]).contains("15 texels"));
    assert!(problem(|s| s.textures.truncate(1)).contains("texture 1"));
    assert!(problem(|s| s.materials[1].ior = f32::NAN).contains("glass"));
    assert!(problem(|s| s.materials[0].alpha_mode = AlphaMode::Mask { cutoff: f32::NAN }).contains("glazed"));
    assert!(problem(|s| s.lights[0].intensity[0] = -1.0).contains("point"));
    assert!(problem(|s| s.camera.as_mut().unwrap().lens_radius = -1.0).contains("lens"));
}

#[test]
fn an_empty_scene_is_a_file() {
    let scene = back(&Scene::default());
    assert!(scene.meshes.is_empty() && scene.instances.is_empty() && scene.warnings.is_empty());
}
