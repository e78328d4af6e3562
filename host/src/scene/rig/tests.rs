//! Tracks, surfaces under deformations, and rigs that an embedder got wrong. The suite `posed` has whole files.

use super::*;
use crate::scene::{Animation, Instance, Material, Mesh};

/// A triangle on a node.
fn scene() -> Scene {
    let mesh = Mesh {
        name: "sail".to_owned(),
        positions: vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]],
        normals: vec![[0.0, 0.0, 1.0]; 3],
        tangents: vec![[1.0, 0.0, 0.0, -1.0]; 3],
        uvs: vec![[0.0; 2]; 3],
        indices: vec![[0, 1, 2]],
        ..Mesh::default()
    };
    let rig = Rig {
        nodes: vec![Node { name: "mast".to_owned(), weights: vec![0.0], ..Node::default() }],
        attachments: vec![Attachment { node: 0, part: Part::Instance(0) }],
        deformations: vec![Arc::new(Deformation { targets: vec![MorphTarget::default()], ..Deformation::default() })],
        ..Rig::default()
    };
    Scene {
        meshes: vec![mesh.into()],
        instances: vec![Instance::new(0, DAffine3::IDENTITY)],
        materials: vec![Material::diffuse("cloth", [0.5; 3])],
        animation: Animation { rig, ..Animation::default() },
        ..Scene::default()
    }
}

fn track(property: Property, interpolation: Interpolation, times: &[f32], values: &[f32]) -> Track {
    Track { node: 0, property, interpolation, times: times.to_vec(), values: values.to_vec() }
}

#[test]
fn keys_are_met_and_the_first_and_last_one_stay() {
    let times = [1.0, 2.0, 4.0];
    for (interpolation, values, middle) in [
        (Interpolation::Step, &[5.0, 7.0, 3.0][..], 7.0),
        (Interpolation::Linear, &[5.0, 7.0, 3.0], 5.0),
        // derivatives of 3 from the second key on and of -1 before the third
        (Interpolation::CubicSpline, &[9.0, 5.0, 9.0, 9.0, 7.0, 3.0, -1.0, 3.0, 9.0], 5.0 + 2.0 * (3.0 + 1.0) / 8.0),
    ] {
        let track = track(Property::Weights, interpolation, &times, values);
        for (time, value) in [(0.0, 5.0), (1.0, 5.0), (2.0, 7.0), (3.0, middle), (4.0, 3.0), (9.0, 3.0)] {
            assert_eq!(track.at(time), [value], "{interpolation:?} at {time}");
        }
    }
}

#[test]
fn rotations_go_the_shorter_way_at_constant_speed() {
    let turned = |angle: f64| DQuat::from_rotation_y(angle).to_array().map(|x| x as f32);
    // the second one is written as its negative, thrice as long
    let keys = [turned(0.2), turned(1.4).map(|x| -3.0 * x)];
    let track = track(Property::Rotation, Interpolation::Linear, &[0.0, 4.0], keys.as_flattened());
    for (time, angle) in [(0.0, 0.2), (1.0, 0.5), (3.0, 1.1), (4.0, 1.4)] {
        let mut node = Changed::default();
        track.change(&mut node, time);
        let found = unit(node.rotation.unwrap()) * DVec3::X;
        assert!((found - DQuat::from_rotation_y(angle) * DVec3::X).length() < 1.0e-6, "{time}: {found}");
    }
}

#[test]
fn normals_stay_perpendicular_and_tangents_along_their_surface() {
    let mut scene = scene();
    let rig = &mut scene.animation.rig;
    let shear = DAffine3::from_cols(DVec3::new(2.0, 0.5, 1.0), DVec3::new(0.3, 0.4, -0.7), DVec3::Z, DVec3::ONE);
    rig.nodes[0].placement = Placement::Matrix(shear);
    rig.nodes[0].weights.clear();
    rig.attachments.clear();
    rig.skins = vec![Skin { joints: vec![0], ..Skin::default() }];
    let set = Influences { joints: vec![[0; 4]; 3], weights: vec![[0.0, 0.25, 0.0, 0.0]; 3] };
    rig.deformations =
        vec![Arc::new(Deformation { skinning: Some(Skinning { skin: 0, sets: vec![set] }), ..Deformation::default() })];
    assert_eq!(scene.animation.problem(&scene), None);
    let posed = scene.at(0.0);
    assert_eq!(posed.instances[0].transform, DAffine3::IDENTITY);
    let [a, b, c] = posed.meshes[0].triangles().next().unwrap();
    assert!((a - DVec3::ONE).length() < 1.0e-6);
    for (normal, [x, y, z, sign]) in posed.meshes[0].normals.iter().zip(&posed.meshes[0].tangents) {
        assert!((double(*normal) - (b - a).cross(c - a).normalize()).length() < 1.0e-6);
        assert!((double([*x, *y, *z]) - (b - a).normalize()).length() < 1.0e-6);
        assert_eq!(*sign, -1.0);
    }
    assert!(
        posed.bounds() == scene.bounds()
            && posed.bounds() != Scene { animation: Animation::default(), ..scene }.bounds()
    );
}

#[test]
fn what_does_not_deform_is_shared() {
    let mut scene = scene();
    scene.add_mesh("floor", 0, Mesh::quad(DVec3::ZERO, [DVec3::X, DVec3::Y]));
    let posed = scene.at(3.0);
    assert!(Arc::ptr_eq(&scene.meshes[1], &posed.meshes[1]) && !Arc::ptr_eq(&scene.meshes[0], &posed.meshes[0]));
    let split = scene.subdivided(2);
    assert_eq!([0, 1].map(|mesh| split.meshes[mesh].indices.len()), [1, 32]);
}

#[test]
fn what_an_embedder_got_wrong_is_named_and_does_not_panic() {
    type Edit = fn(&mut Rig);
    let wrong: [(Edit, &str); 12] = [
        (|rig| rig.nodes[0].parent = Some(0), "after"),
        (|rig| rig.nodes[0].weights[0] = f32::NAN, "not finite"),
        (|rig| rig.nodes[0].weights.clear(), "0 weights"),
        (|rig| rig.attachments[0].node = 7, "node 7"),
        (|rig| rig.attachments[0].part = Part::Instance(7), "Instance(7)"),
        (|rig| rig.attachments[0].part = Part::Camera, "Camera"),
        (|rig| rig.attachments.push(rig.attachments[0]), "another node carries"),
        (|rig| rig.deformations.push(rig.deformations[0].clone()), "two ways"),
        (|rig| Arc::make_mut(&mut rig.deformations[0]).mesh = 7, "mesh 7"),
        (|rig| Arc::make_mut(&mut rig.deformations[0]).skinning = Some(Skinning::default()), "skin 0"),
        (|rig| rig.skins.push(Skin { joints: vec![7], ..Skin::default() }), "node 7"),
        (|rig| rig.tracks = vec![track(Property::Scale, Interpolation::Step, &[], &[])], "scale"),
    ];
    for (edit, word) in wrong {
        let mut scene = scene();
        edit(&mut scene.animation.rig);
        let problem = scene.animation.problem(&scene).unwrap();
        assert!(problem.contains(word), "{word}: {problem}");
        assert_eq!(scene.at(1.0).meshes.len(), 1);
    }
}
