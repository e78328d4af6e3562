//! What moves as glTF has it: a tentacle on joints, a ball with morph targets, a carousel of nodes with a lantern, and a camera
//! on a rail. All of it comes back to where it began.

use std::f64::consts::{PI, TAU};
use std::sync::Arc;

use glam::{DAffine3, DQuat, DVec3};

use super::parts::{checkered_floor, ground, plastic, stage};
use crate::scene::{
    Attachment, Deformation, Influences, Interpolation, Material, Mesh, MorphTarget, Node, Part, Placement, Property,
    Scene, Skin, Skinning, Track, double,
};

/// In seconds; after it everything begins anew.
const PERIOD: f64 = 4.0;
const FRAME_RATE: f64 = 24.0;
/// Keys of the rotations.
const KEYS: u32 = 9;

/// Height of the tentacle, and between its joints.
const HEIGHT: f64 = 1.4;
const JOINTS: u16 = 4;
const BONE: f64 = HEIGHT / JOINTS as f64;

pub(super) fn scene() -> Scene {
    let eye = DVec3::new(0.0, 1.25, 4.6);
    let mut scene = stage("toys", [eye, DVec3::new(0.0, 0.6, 0.0)], 32.0, [640, 360]);
    scene.animation.period = Some(PERIOD);
    scene.animation.frame_rate = FRAME_RATE;
    add_rail(&mut scene);
    add_tentacle(&mut scene, DVec3::new(-1.05, 0.0, 0.0));
    add_ball(&mut scene, DVec3::new(0.0, 0.42, 0.35));
    add_carousel(&mut scene, DVec3::new(1.05, 0.0, 0.0));
    add_room(&mut scene);
    scene
}

fn add_room(scene: &mut Scene) {
    let floor = checkered_floor(scene, [120, 190], [14.0, 14.0]);
    scene.add_mesh("floor", floor, ground(7.0));
    let grey = scene.add_material(Material::diffuse("wall", [0.5, 0.52, 0.55]));
    scene.add_mesh("wall", grey, Mesh::quad(DVec3::new(-3.5, 0.0, -1.5), [DVec3::X * 7.0, DVec3::Y * 4.0]));
    scene.add_quad_light(DVec3::new(-1.0, 3.2, 0.2), [DVec3::X * 1.6, DVec3::Z * 1.0], [16.0, 15.3, 14.2], false);
}

/// Adds a node and gives its index.
fn add_node(scene: &mut Scene, name: &str, parent: Option<usize>, translation: DVec3) -> usize {
    let translation = single(translation).map(f64::from);
    let rest = Placement::Parts { translation, rotation: [0.0, 0.0, 0.0, 1.0], scale: [1.0; 3] };
    let nodes = &mut scene.animation.rig.nodes;
    nodes.push(Node { name: name.to_owned(), parent, placement: rest, weights: Vec::new() });
    nodes.len() - 1
}

/// From the space of a node to the world, where nothing has moved yet.
fn world(scene: &Scene, node: usize) -> DAffine3 {
    let node = &scene.animation.rig.nodes[node];
    node.parent.map_or(DAffine3::IDENTITY, |parent| world(scene, parent)) * node.placement.at_rest()
}

/// Adds a mesh that a node carries, and gives the mesh's index.
fn carry(scene: &mut Scene, node: usize, name: &str, material: usize, mesh: Mesh) -> usize {
    let transform = world(scene, node);
    let part = Part::Instance(scene.instances.len());
    scene.animation.rig.attachments.push(Attachment { node, part });
    scene.place_mesh(name, material, mesh, transform)
}

fn add_track(scene: &mut Scene, node: usize, property: Property, values: impl Fn(f64) -> Vec<f64>) {
    let times: Vec<f64> = (0..KEYS).map(|key| PERIOD * f64::from(key) / f64::from(KEYS - 1)).collect();
    let values = times.iter().flat_map(|time| values(time / PERIOD)).map(|x| x as f32).collect();
    let times = times.iter().map(|time| *time as f32).collect();
    let track = Track { node, property, interpolation: Interpolation::Linear, times, values };
    scene.animation.rig.tracks.push(track);
}

fn add_rail(scene: &mut Scene) {
    let Some(camera) = scene.camera else { return };
    let rail = add_node(scene, "rail", None, DVec3::ZERO);
    let placement = Placement::Matrix(camera.node_transform());
    scene.animation.rig.nodes.push(Node {
        name: "camera".to_owned(),
        parent: Some(rail),
        placement,
        weights: Vec::new(),
    });
    scene.animation.rig.attachments.push(Attachment { node: rail + 1, part: Part::Camera });
    add_track(scene, rail, Property::Translation, |t| vec![0.25 * (TAU * t).sin(), 0.0, 0.0]);
}

/// A tapered body whose joints bend one after the other.
fn add_tentacle(scene: &mut Scene, foot: DVec3) {
    let violet = scene.add_material(plastic("tentacle", [0.42, 0.2, 0.5], 0.35));
    let radius = |s: f64| 0.17 * (1.0 - s) + 0.04;
    let rings = (0..=48).map(|ring| f64::from(ring) / 48.0);
    let side = rings.map(|s| [radius(s) * (1.0 + 0.06 * (s * 60.0).sin()), s * HEIGHT]);
    let profile: Vec<[f64; 2]> =
        [[0.0, 0.0]].into_iter().chain(side).chain([[0.025, HEIGHT + 0.03], [0.0, HEIGHT + 0.04]]).collect();
    let mesh = Mesh::lathe(&profile, 32);
    let influences = influences(&mesh);
    let mut joints: Vec<usize> = Vec::new();
    for joint in 0..JOINTS {
        let place = if joint == 0 { foot } else { DVec3::Y * BONE };
        let node = add_node(scene, "joint", joints.last().copied(), place);
        let delay = 0.12 * f64::from(joint);
        let angle = 0.22 + 0.18 * f64::from(joint);
        add_track(scene, node, Property::Rotation, |t| {
            let [across, along] = [(TAU * (t - delay)).sin(), (2.0 * TAU * (t - delay)).sin()];
            (DQuat::from_rotation_z(angle * across) * DQuat::from_rotation_x(0.5 * angle * along)).to_array().to_vec()
        });
        joints.push(node);
    }
    let inverse_bind = (0..JOINTS).map(|joint| {
        let height = (BONE * f64::from(joint)) as f32;
        [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [0.0, -height, 0.0]]
    });
    let index = scene.add_mesh("tentacle", violet, mesh);
    let rig = &mut scene.animation.rig;
    let skinning = Skinning { skin: rig.skins.len(), sets: vec![influences] };
    let node = joints[0];
    rig.skins.push(Skin { name: "tentacle".to_owned(), joints, inverse_bind: inverse_bind.collect() });
    rig.deformations.push(Arc::new(Deformation { mesh: index, node, targets: Vec::new(), skinning: Some(skinning) }));
}

/// Between the middles of two bones a vertex goes over from one to the next.
fn influences(mesh: &Mesh) -> Influences {
    let of = |&[_, height, _]: &[f32; 3]| {
        let at = (f64::from(height) / BONE - 0.5).clamp(0.0, f64::from(JOINTS - 1));
        let below = (at as u16).min(JOINTS - 2);
        let share = (at - f64::from(below)) as f32;
        ([below, below + 1, 0, 0], [1.0 - share, share, 0.0, 0.0])
    };
    let (joints, weights) = mesh.positions.iter().map(of).unzip();
    Influences { joints, weights }
}

/// A ball that is squashed and grows bumps, each as its weight says.
fn add_ball(scene: &mut Scene, centre: DVec3) {
    let orange = scene.add_material(plastic("ball", [0.75, 0.32, 0.08], 0.3));
    let mesh = Mesh::sphere(DVec3::ZERO, 0.4, 4);
    let squashed = |p: DVec3| p * DVec3::new(1.35, 0.5, 1.35);
    let bumpy = |p: DVec3| {
        let [x, y, z] = (p * 16.0).to_array();
        p * (1.0 + 0.3 * x.sin() * y.sin() * z.sin())
    };
    let targets = vec![target(&mesh, squashed), target(&mesh, bumpy)];
    let node = add_node(scene, "ball", None, centre);
    let mesh = carry(scene, node, "ball", orange, mesh);
    let rig = &mut scene.animation.rig;
    rig.nodes[node].weights = vec![0.0; 2];
    rig.deformations.push(Arc::new(Deformation { mesh, node, targets, skinning: None }));
    // slopes of 0 at the ends: each weight comes and goes softly
    let weights = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [0.6, 1.0], [0.0, 0.0]];
    let values = weights.into_iter().flat_map(|value| [[0.0; 2], value, [0.0; 2]]).flatten().collect();
    let times = (0..5).map(|key| (PERIOD * f64::from(key) / 4.0) as f32).collect();
    let interpolation = Interpolation::CubicSpline;
    rig.tracks.push(Track { node, property: Property::Weights, interpolation, times, values });
}

/// What makes a smooth mesh a map of itself, normals included.
fn target(mesh: &Mesh, map: impl Fn(DVec3) -> DVec3) -> MorphTarget {
    let own = |p: &[f32; 3]| double(*p);
    let moved: Vec<DVec3> = mesh.positions.iter().map(|p| map(own(p))).collect();
    let mut normals = vec![DVec3::ZERO; moved.len()];
    for corners in &mesh.indices {
        let [a, b, c] = corners.map(|i| moved[i as usize]);
        corners.iter().for_each(|&i| normals[i as usize] += (b - a).cross(c - a));
    }
    let positions = moved.iter().zip(&mesh.positions).map(|(moved, p)| single(*moved - own(p))).collect();
    let normals = normals.iter().zip(&mesh.normals).map(|(moved, n)| single(moved.normalize() - own(n))).collect();
    MorphTarget { positions, normals, tangents: Vec::new() }
}

/// A mast that turns, an arm that rises and sinks on it, and a lantern and a plate that swing from its ends.
fn add_carousel(scene: &mut Scene, foot: DVec3) {
    let teal = scene.add_material(plastic("carousel", [0.1, 0.38, 0.4], 0.4));
    let glow = scene.add_material(Material::emitter("lantern", [0.2; 3], [9.0, 5.0, 2.0]));
    let block = |half: DVec3| Mesh::cuboid(-half, half);
    let mast = add_node(scene, "mast", None, foot);
    carry(scene, mast, "mast", teal, Mesh::cuboid(DVec3::new(-0.04, 0.0, -0.04), DVec3::new(0.04, 1.2, 0.04)));
    add_track(scene, mast, Property::Rotation, |t| {
        DQuat::from_rotation_y(0.6 * (TAU * t).sin() - 0.6).to_array().to_vec()
    });
    let arm = add_node(scene, "arm", Some(mast), DVec3::Y * 1.05);
    carry(scene, arm, "arm", teal, block(DVec3::new(0.6, 0.03, 0.03)));
    add_track(scene, arm, Property::Translation, |t| vec![0.0, 1.0 + 0.12 * (2.0 * TAU * t).sin(), 0.0]);
    for (name, side, material) in [("lantern", -0.55, glow), ("plate", 0.55, teal)] {
        let hook = add_node(scene, name, Some(arm), DVec3::X * side);
        let hanging = Mesh::cuboid(DVec3::new(-0.09, -0.45, -0.09), DVec3::new(0.09, -0.25, 0.09));
        carry(scene, hook, name, material, hanging);
        add_track(scene, hook, Property::Rotation, |t| {
            DQuat::from_rotation_x(0.5 * (2.0 * TAU * t + PI * side).sin()).to_array().to_vec()
        });
    }
}

fn single(v: DVec3) -> [f32; 3] {
    v.as_vec3().to_array()
}
