//! Small glTF files in which something moves, and where it is at a time, worked out by angles, matrices and Bézier curves in
//! double precision: independently of the host, which has quaternions, cofactors and Hermite splines.

use crate::gltf_files::{File, lamp};
use glam::{DMat4, DVec3};
use libtest_mimic::Failed;
use restir_host::scene::{Scene, gltf};
use serde_json::{Value, json};
use std::f64::consts::PI;

/// A file, and where its movers are.
#[derive(Clone, Copy)]
pub struct Motion {
    /// Name.
    pub name: &'static str,
    /// The bytes of the file.
    pub file: fn() -> Vec<u8>,
    /// What moves, at a time in seconds, perhaps with something done wrongly.
    pub at: fn(f64, Option<Mistake>) -> Moved,
    /// The mistakes that change it.
    pub mistakes: &'static [Mistake],
}

impl Motion {
    /// The scene of the file.
    ///
    /// # Errors
    /// As of [`gltf::load`].
    pub fn scene(&self) -> Result<Scene, Failed> {
        imported(self.name, &(self.file)())
    }
}

/// The scene of a file of these bytes.
///
/// # Errors
/// As of [`gltf::load`].
pub fn imported(name: &str, file: &[u8]) -> Result<Scene, Failed> {
    let folder = tempfile::tempdir()?;
    let path = folder.path().join(format!("{name}.glb"));
    std::fs::write(&path, file)?;
    Ok(gltf::load(&path)?)
}

/// What moves, in world space.
#[derive(Clone, Debug, Default)]
pub struct Moved {
    /// For each instance that moves, in their order, the name of its mesh, its vertices and their normals.
    pub meshes: Vec<(&'static str, Vec<[DVec3; 2]>)>,
    /// Position of the camera, and where it looks to.
    pub camera: Option<[DVec3; 2]>,
    /// Position of the first light.
    pub light: Option<DVec3>,
}

/// What a program may get wrong.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mistake {
    /// The node of a skinned mesh moves it, too.
    NodeOfTheSkin,
    /// Joints move vertices before morph targets do.
    SkinFirst,
    /// The second set of joints is left out.
    OneSet,
    /// Weights are not divided by their sum.
    UnequalSum,
    /// Splines are straight lines.
    StraightSplines,
    /// The second morph target has the weight of the first.
    OneWeight,
    /// Children do not follow their parents.
    NoParents,
    /// A step comes at the key after it.
    LateStep,
}

/// All of them.
pub const MOTIONS: [Motion; 3] = [
    Motion {
        name: "skinned",
        file: skinned,
        at: skinned_at,
        mistakes: &[Mistake::NodeOfTheSkin, Mistake::SkinFirst, Mistake::OneSet, Mistake::UnequalSum],
    },
    Motion {
        name: "morphed",
        file: morphed,
        at: morphed_at,
        mistakes: &[Mistake::StraightSplines, Mistake::OneWeight],
    },
    Motion {
        name: "animated",
        file: animated,
        at: animated_at,
        mistakes: &[Mistake::StraightSplines, Mistake::NoParents, Mistake::LateStep],
    },
];

/// Moments of the files, in seconds: all begin at 0 and stand still from 2 on.
pub const TIMES: [f64; 3] = [0.0, 0.75, 1.6];

fn stage() -> File {
    let subject = json!({ "pbrMetallicRoughness": {
        "baseColorFactor": [0.8, 0.55, 0.3, 1.0], "metallicFactor": 0.0, "roughnessFactor": 0.8 } });
    File::stage(json!([subject, lamp()]))
}

fn single(v: DVec3) -> [f32; 3] {
    v.as_vec3().to_array()
}

impl File {
    /// Attributes and indices of a mesh.
    fn surface(&mut self, vertices: &[[DVec3; 2]], triangles: &[[u16; 3]]) -> Value {
        let [positions, normals] = [0, 1].map(|k| vertices.iter().map(|vertex| single(vertex[k])).collect::<Vec<_>>());
        let [positions, normals] = [positions, normals].map(|values| self.floats(values.as_flattened(), 3));
        let bytes: Vec<u8> = triangles.as_flattened().iter().flat_map(|index| index.to_le_bytes()).collect();
        let view = self.view(&bytes);
        let indices =
            json!({ "bufferView": view, "componentType": 5123, "count": 3 * triangles.len(), "type": "SCALAR" });
        let indices = self.add("accessors", indices);
        json!({ "attributes": { "POSITION": positions, "NORMAL": normals }, "indices": indices, "material": 0 })
    }

    /// Adds a channel to the last animation, of the node, with `width` numbers a value.
    fn channel(&mut self, node: usize, [path, interpolation]: [&str; 2], times: &[f32], values: &[f32], width: usize) {
        let (input, output) = (self.floats(times, 1), self.floats(values, width));
        let animation = match self.document["animations"].as_array() {
            Some(animations) => animations.len() - 1,
            None => self.add("animations", json!({ "channels": [], "samplers": [] })),
        };
        let animation = &mut self.document["animations"][animation];
        let samplers = animation["samplers"].as_array_mut().expect("just made");
        samplers.push(json!({ "input": input, "output": output, "interpolation": interpolation }));
        let sampler = samplers.len() - 1;
        let channel = json!({ "sampler": sampler, "target": { "node": node, "path": path } });
        animation["channels"].as_array_mut().expect("just made").push(channel);
    }
}

/// A straight line between keys that are (time, value).
fn linear(keys: &[(f64, f64)], time: f64) -> f64 {
    let next = keys.iter().position(|key| key.0 > time);
    match next {
        Some(0) => keys[0].1,
        None => keys[keys.len() - 1].1,
        Some(next) => {
            let ((t0, a), (t1, b)) = (keys[next - 1], keys[next]);
            a * (t1 - time) / (t1 - t0) + b * (time - t0) / (t1 - t0)
        }
    }
}

/// A key of a spline: time, derivative from before, value, derivative from there on.
type Key<const N: usize> = (f64, [f64; N], [f64; N], [f64; N]);

/// A cubic spline, as Bézier curves by de Casteljau's algorithm; straight lines if it is done wrongly.
fn spline<const N: usize>(keys: &[Key<N>], time: f64, straight: bool) -> [f64; N] {
    std::array::from_fn(|k| {
        let next = keys.iter().position(|key| key.0 > time);
        let Some(next) = next.filter(|next| *next > 0) else {
            return if next == Some(0) { keys[0].2[k] } else { keys[keys.len() - 1].2[k] };
        };
        let ((t0, _, a, leaving), (t1, arriving, b, _)) = (keys[next - 1], keys[next]);
        let (span, s) = (t1 - t0, (time - t0) / (t1 - t0));
        let mut points = [a[k], a[k] + leaving[k] * span / 3.0, b[k] - arriving[k] * span / 3.0, b[k]];
        if straight {
            points = [a[k], (2.0 * a[k] + b[k]) / 3.0, (a[k] + 2.0 * b[k]) / 3.0, b[k]];
        }
        for length in (1..4).rev() {
            for i in 0..length {
                points[i] += (points[i + 1] - points[i]) * s;
            }
        }
        points[0]
    })
}

fn spline_numbers<const N: usize>(keys: &[Key<N>]) -> (Vec<f32>, Vec<f32>) {
    let values = keys.iter().flat_map(|key| [key.1, key.2, key.3]).flatten().map(|x| x as f32).collect();
    (keys.iter().map(|key| key.0 as f32).collect(), values)
}

/// The quaternion of a turn about an axis.
fn turn(axis: DVec3, angle: f64) -> [f32; 4] {
    let [x, y, z] = single(axis * (0.5 * angle).sin());
    [x, y, z, (0.5 * angle).cos() as f32]
}

// ---- a bar that bends at two joints, moves with a third, and swells

const HEIGHT: f64 = 1.6;
const RINGS: u16 = 17;
/// Heights of the joints, along the bar.
const JOINTS: [f64; 3] = [0.0, 0.5, 1.0];
const BEND: [(f64, f64); 3] = [(0.0, 0.0), (1.0, 0.9), (2.0, -0.5)];
const NOD: [(f64, f64); 2] = [(0.5, 0.0), (1.5, 1.1)];
const SLIDE: [(f64, f64); 2] = [(0.0, 0.2), (2.0, -0.3)];
const SWELL: [(f64, f64); 3] = [(0.0, 0.0), (1.0, 1.0), (2.0, 0.25)];
/// Of the upper joint: normals do not turn as positions do.
const STRETCH: DVec3 = DVec3::new(1.5, 1.0, 0.6);

/// A vertex with its normal, what is added to both, and its height.
struct BarVertex {
    vertex: [DVec3; 2],
    swelling: [DVec3; 2],
    height: f64,
}

fn bar() -> (Vec<BarVertex>, Vec<[u16; 3]>) {
    let (mut vertices, mut triangles) = (Vec::new(), Vec::new());
    for normal in [DVec3::X, DVec3::Z, DVec3::NEG_X, DVec3::NEG_Z] {
        let across = DVec3::Y.cross(normal);
        for ring in 0..RINGS {
            let height = HEIGHT * f64::from(ring) / f64::from(RINGS - 1);
            let phase = PI * height / HEIGHT;
            for side in [-0.12, 0.12] {
                let first = vertices.len() as u16;
                vertices.push(BarVertex {
                    vertex: [normal * 0.12 + across * side + DVec3::Y * height, normal],
                    swelling: [normal * 0.15 * phase.sin(), DVec3::Y * -0.3 * phase.cos()],
                    height,
                });
                if ring > 0 && side > 0.0 {
                    let [a, b, c, d] = [first - 3, first - 2, first, first - 1];
                    triangles.extend([[a, b, c], [a, c, d]]);
                }
            }
        }
    }
    (vertices, triangles)
}

/// Joints and weights of a vertex: four as floats, of which three count, and one in units of 1/255.
fn influences(height: f64) -> ([f32; 3], u8) {
    let ramp = |from: f64| ((height - from) / 0.4).clamp(0.0, 1.0);
    let (a, b) = (ramp(0.3), ramp(0.8));
    ([(1.0 - a) as f32, (a - b) as f32, b as f32], (90.0 * a * (1.0 - b)) as u8)
}

fn skinned() -> Vec<u8> {
    let mut file = stage();
    let (vertices, triangles) = bar();
    let mut primitive = file.surface(&vertices.iter().map(|v| v.vertex).collect::<Vec<_>>(), &triangles);
    let influences: Vec<_> = vertices.iter().map(|v| influences(v.height)).collect();
    let weights: Vec<f32> = influences.iter().flat_map(|([a, b, c], _)| [*a, *b, *c, 0.0]).collect();
    // the fourth has no weight: what it refers to does not matter
    let joints: Vec<u8> = influences.iter().flat_map(|_| [0, 1, 2, 9]).collect();
    let more_weights: Vec<u8> = influences.iter().flat_map(|(_, weight)| [*weight, 0, 0, 0]).collect();
    let more_joints: Vec<u8> = influences.iter().flat_map(|_| [2_u16, 0, 0, 0]).flat_map(u16::to_le_bytes).collect();
    let weights = file.floats(&weights, 4);
    let mut bytes = |bytes: &[u8], kind: u32, normalized: bool| {
        let view = file.view(bytes);
        file.add(
            "accessors",
            json!({ "bufferView": view, "componentType": kind, "count": vertices.len(), "type": "VEC4",
            "normalized": normalized }),
        )
    };
    let [joints, more_joints] = [bytes(&joints, 5121, false), bytes(&more_joints, 5123, false)];
    let more_weights = bytes(&more_weights, 5121, true);
    primitive["attributes"]["JOINTS_0"] = json!(joints);
    primitive["attributes"]["WEIGHTS_0"] = json!(weights);
    primitive["attributes"]["JOINTS_1"] = json!(more_joints);
    primitive["attributes"]["WEIGHTS_1"] = json!(more_weights);
    let [positions, normals] = [0, 1].map(|k| vertices.iter().map(|v| single(v.swelling[k])).collect::<Vec<_>>());
    let [positions, normals] = [positions, normals].map(|values| file.floats(values.as_flattened(), 3));
    primitive["targets"] = json!([{ "POSITION": positions, "NORMAL": normals }]);
    let mesh = file.add("meshes", json!({ "name": "bar", "primitives": [primitive], "weights": [0.0] }));
    let inverse = |height: &f64| DMat4::from_translation(DVec3::NEG_Y * *height).as_mat4().to_cols_array();
    let matrices = file.floats(JOINTS.map(|height| inverse(&height)).as_flattened(), 16);
    let upper =
        file.add("nodes", json!({ "name": "upper", "translation": [0.0, 0.5, 0.0], "scale": STRETCH.to_array() }));
    let lower = file.add("nodes", json!({ "name": "lower", "translation": [0.0, 0.5, 0.0], "children": [upper] }));
    let root = file.add("nodes", json!({ "name": "root", "translation": [0.2, 0.0, 0.1], "children": [lower] }));
    file.document["skins"] =
        json!([{ "inverseBindMatrices": matrices, "joints": [root, lower, upper], "skeleton": root }]);
    let node = json!({ "name": "bar", "mesh": mesh, "skin": 0, "translation": NODE_OF_THE_SKIN.to_array(), "scale": [0.5, 1.5, 1.0] });
    let node = file.add("nodes", node);
    let turns = |axis: DVec3, keys: &[(f64, f64)]| keys.iter().flat_map(|key| turn(axis, key.1)).collect::<Vec<f32>>();
    let times = |keys: &[(f64, f64)]| keys.iter().map(|key| key.0 as f32).collect::<Vec<f32>>();
    file.channel(lower, ["rotation", "LINEAR"], &times(&BEND), &turns(DVec3::Z, &BEND), 4);
    file.channel(upper, ["rotation", "LINEAR"], &times(&NOD), &turns(DVec3::X, &NOD), 4);
    let places: Vec<f32> = SLIDE.iter().flat_map(|key| [key.1 as f32, 0.0, 0.1]).collect();
    file.channel(root, ["translation", "LINEAR"], &times(&SLIDE), &places, 3);
    let weights: Vec<f32> = SWELL.iter().map(|key| key.1 as f32).collect();
    file.channel(node, ["weights", "LINEAR"], &times(&SWELL), &weights, 1);
    file.glb()
}

/// Where the skinned mesh would be if its node moved it.
const NODE_OF_THE_SKIN: DVec3 = DVec3::new(-0.4, 0.1, 0.2);

fn skinned_at(time: f64, mistake: Option<Mistake>) -> Moved {
    let root = DMat4::from_translation(DVec3::new(linear(&SLIDE, time), 0.0, 0.1));
    let up = DMat4::from_translation(DVec3::Y * 0.5);
    let lower = root * up * DMat4::from_rotation_z(linear(&BEND, time));
    let upper = lower * up * DMat4::from_rotation_x(linear(&NOD, time)) * DMat4::from_scale(STRETCH);
    let joints = [root, lower, upper];
    let matrices: [DMat4; 3] =
        std::array::from_fn(|k| joints[k] * DMat4::from_translation(DVec3::Y * JOINTS[k]).inverse());
    let swell = linear(&SWELL, time);
    let place = |vertex: &BarVertex| {
        let (first, second) = influences(vertex.height);
        let mut weights = first.map(f64::from);
        if mistake != Some(Mistake::OneSet) {
            weights[2] += f64::from(second) / 255.0;
        }
        let sum = if mistake == Some(Mistake::UnequalSum) { 1.0 } else { weights.iter().sum() };
        let matrix = (0..3).fold(DMat4::ZERO, |sum, k| sum + matrices[k] * weights[k]) * (1.0 / sum);
        let [mut position, normal] = vertex.vertex;
        let [swelling, leaning] = vertex.swelling.map(|delta| delta * swell);
        if mistake == Some(Mistake::SkinFirst) {
            position = (matrix * position.extend(1.0)).truncate() + swelling;
        } else {
            position = (matrix * (position + swelling).extend(1.0)).truncate();
        }
        if mistake == Some(Mistake::NodeOfTheSkin) {
            position += NODE_OF_THE_SKIN;
        }
        let normal = matrix.inverse().transpose().transform_vector3(normal + leaning);
        [position, normal.normalize()]
    };
    Moved { meshes: vec![("bar", bar().0.iter().map(place).collect())], ..Moved::default() }
}

// ---- two sails of one mesh with two morph targets, one with weights in straight lines and one in splines

const SIDE: u16 = 7;
const STRAIGHT: [(f64, [f64; 2]); 3] = [(0.0, [0.2, 0.0]), (1.0, [1.0, 0.5]), (2.0, [0.0, 1.0])];
const CURVED: [Key<2>; 3] = [
    (0.0, [0.0, 0.0], [0.0, 0.1], [2.0, -1.0]),
    (1.0, [-1.5, 0.5], [0.9, 0.4], [-1.5, 0.5]),
    (2.0, [3.0, 1.0], [0.3, 1.0], [0.0, 0.0]),
];
const SAILS: [DVec3; 2] = [DVec3::new(-0.5, 0.6, 0.2), DVec3::new(0.5, 0.6, 0.2)];

/// Vertices with their normals, and the two displacements of each.
fn sail() -> Vec<([DVec3; 2], [[DVec3; 2]; 2])> {
    let vertex = |index: u16| {
        let at = |i: u16| f64::from(i) / f64::from(SIDE - 1) * 2.0 - 1.0;
        let (x, y) = (at(index % SIDE), at(index / SIDE));
        let bulge =
            [DVec3::Z * 0.3 * (1.0 - x * x) * (1.0 - y * y), DVec3::new(x * (1.0 - y * y), y * (1.0 - x * x), 0.0)];
        let top = index / SIDE == SIDE - 1;
        let lean = if top { [DVec3::new(0.15, 0.2, 0.0), DVec3::X * 0.2] } else { [DVec3::ZERO; 2] };
        ([DVec3::new(0.4 * x, 0.4 * y, 0.0), DVec3::Z], [bulge, lean])
    };
    (0..SIDE * SIDE).map(vertex).collect()
}

fn morphed() -> Vec<u8> {
    let mut file = stage();
    let sail = sail();
    let cell = |cell: u16| {
        let a = cell / (SIDE - 1) * SIDE + cell % (SIDE - 1);
        let [b, c, d] = [a + 1, a + 1 + SIDE, a + SIDE];
        [[a, b, c], [a, c, d]]
    };
    let triangles: Vec<[u16; 3]> = (0..(SIDE - 1) * (SIDE - 1)).flat_map(cell).collect();
    let mut primitive = file.surface(&sail.iter().map(|(vertex, _)| *vertex).collect::<Vec<_>>(), &triangles);
    let bulge = [0, 1].map(|k| sail.iter().map(|(_, deltas)| single(deltas[0][k])).collect::<Vec<_>>());
    let [bulge, leaning] = bulge.map(|values| file.floats(values.as_flattened(), 3));
    // the upper row alone
    let top: Vec<u16> = (SIDE * (SIDE - 1)..SIDE * SIDE).collect();
    let indices: Vec<u8> = top.iter().flat_map(|index| index.to_le_bytes()).collect();
    let indices = file.view(&indices);
    let lean = [0, 1].map(|k| {
        let values: Vec<f32> = top.iter().flat_map(|&index| single(sail[usize::from(index)].1[1][k])).collect();
        let bytes: Vec<u8> = values.iter().flat_map(|x| x.to_le_bytes()).collect();
        let values = file.view(&bytes);
        file.add(
            "accessors",
            json!({ "componentType": 5126, "count": sail.len(), "type": "VEC3", "sparse": {
            "count": top.len(), "indices": { "bufferView": indices, "componentType": 5123 },
            "values": { "bufferView": values } } }),
        )
    });
    primitive["targets"] =
        json!([{ "POSITION": bulge, "NORMAL": leaning }, { "POSITION": lean[0], "NORMAL": lean[1] }]);
    let mesh = file.add("meshes", json!({ "name": "sail", "primitives": [primitive], "weights": [0.7, 0.7] }));
    let [straight, curved] = SAILS.map(|place| {
        file.add(
            "nodes",
            json!({ "name": "mast", "mesh": mesh, "translation": place.to_array(), "weights": [0.1, 0.2] }),
        )
    });
    let times = STRAIGHT.map(|key| key.0 as f32);
    let values: Vec<f32> = STRAIGHT.iter().flat_map(|key| key.1).map(|x| x as f32).collect();
    file.channel(straight, ["weights", "LINEAR"], &times, &values, 1);
    let (times, values) = spline_numbers(&CURVED);
    file.channel(curved, ["weights", "CUBICSPLINE"], &times, &values, 1);
    file.glb()
}

fn morphed_at(time: f64, mistake: Option<Mistake>) -> Moved {
    let straight = [0, 1].map(|k| linear(&STRAIGHT.map(|(time, weights)| (time, weights[k])), time));
    let curved = spline(&CURVED, time, mistake == Some(Mistake::StraightSplines));
    let posed = |mut weights: [f64; 2], place: DVec3| {
        if mistake == Some(Mistake::OneWeight) {
            weights[1] = weights[0];
        }
        let vertex = |([position, normal], [bulge, lean]): &([DVec3; 2], [[DVec3; 2]; 2])| {
            let add = |value: DVec3, k: usize| value + bulge[k] * weights[0] + lean[k] * weights[1];
            [add(*position, 0) + place, add(*normal, 1).normalize()]
        };
        ("sail", sail().iter().map(vertex).collect())
    };
    Moved { meshes: vec![posed(straight, SAILS[0]), posed(curved, SAILS[1])], ..Moved::default() }
}

// ---- a turntable with an arm that goes up and down, a sign on it, a light, and a camera

const TABLE: [(f64, f64); 3] = [(0.0, 0.3), (1.0, 2.0), (2.0, 3.5)];
const ARM: [Key<3>; 2] =
    [(0.0, [0.0; 3], [0.2, 0.3, 0.0], [0.5, 2.0, 0.0]), (1.5, [0.0, -1.0, 0.3], [0.3, 0.9, 0.1], [0.0; 3])];
/// Of the sign: from each time on.
const SIZES: [(f64, [f64; 3]); 2] = [(0.0, [1.0, 1.0, 1.0]), (0.5, [0.5, 1.5, 1.0])];
/// Of the light, in front of the sign.
const LAMP: DVec3 = DVec3::new(0.125, 0.125, 0.25);
const CAMERA: [(f64, f64); 2] = [(0.0, 0.0), (2.0, 1.2)];
const PAN: [(f64, f64); 2] = [(0.0, 0.0), (2.0, 0.3)];

fn board() -> Vec<[DVec3; 2]> {
    [[-0.3, 0.0], [0.3, 0.0], [0.3, 0.3], [-0.3, 0.3]].map(|[x, y]| [DVec3::new(x, y, 0.0), DVec3::Z]).into()
}

fn animated() -> Vec<u8> {
    let mut file = stage();
    let mut mesh = |name: &str| {
        let primitive = file.surface(&board(), &[[0, 1, 2], [0, 2, 3]]);
        file.add("meshes", json!({ "name": name, "primitives": [primitive] }))
    };
    let [arm, sign] = [mesh("arm"), mesh("sign")];
    file.document["extensions"] =
        json!({ "KHR_lights_punctual": { "lights": [{ "type": "point", "intensity": 0.4 }] } });
    let lamp = json!({ "translation": LAMP.to_array(), "extensions": { "KHR_lights_punctual": { "light": 0 } } });
    let lamp = file.add("nodes", lamp);
    let sign = json!({ "name": "sign", "mesh": sign, "translation": [0.0, 0.3, 0.1], "children": [lamp] });
    let sign = file.add("nodes", sign);
    let arm = file.add("nodes", json!({ "name": "arm", "mesh": arm, "children": [sign] }));
    let table = file.add("nodes", json!({ "name": "table", "translation": [0.0, 0.0, 0.2], "children": [arm] }));
    let turns: Vec<f32> = TABLE.iter().flat_map(|key| turn(DVec3::Y, key.1)).collect();
    file.channel(table, ["rotation", "LINEAR"], &TABLE.map(|key| key.0 as f32), &turns, 4);
    let (times, values) = spline_numbers(&ARM);
    file.channel(arm, ["translation", "CUBICSPLINE"], &times, &values, 3);
    let sizes: Vec<f32> = SIZES.iter().flat_map(|key| key.1).map(|x| x as f32).collect();
    file.channel(sign, ["scale", "STEP"], &SIZES.map(|key| key.0 as f32), &sizes, 3);
    let nodes = file.document["nodes"].as_array().expect("a stage has nodes");
    let camera = nodes.iter().position(|node| !node["camera"].is_null()).expect("a stage has a camera");
    let places: Vec<f32> = CAMERA.iter().flat_map(|key| [key.1 as f32, 1.0, 4.0]).collect();
    file.channel(camera, ["translation", "LINEAR"], &CAMERA.map(|key| key.0 as f32), &places, 3);
    let turns: Vec<f32> = PAN.iter().flat_map(|key| turn(DVec3::Y, key.1)).collect();
    file.channel(camera, ["rotation", "LINEAR"], &PAN.map(|key| key.0 as f32), &turns, 4);
    file.glb()
}

fn animated_at(time: f64, mistake: Option<Mistake>) -> Moved {
    let table = DMat4::from_translation(DVec3::Z * 0.2) * DMat4::from_rotation_y(linear(&TABLE, time));
    let place = spline(&ARM, time, mistake == Some(Mistake::StraightSplines));
    let mut arm = DMat4::from_translation(DVec3::from_array(place));
    if mistake != Some(Mistake::NoParents) {
        arm = table * arm;
    }
    let step = if mistake == Some(Mistake::LateStep) { time - 0.5 } else { time };
    let size = SIZES.iter().rev().find(|key| key.0 <= step).map_or(SIZES[0].1, |key| key.1);
    let sign = arm * DMat4::from_translation(DVec3::new(0.0, 0.3, 0.1)) * DMat4::from_scale(DVec3::from_array(size));
    let placed = |matrix: DMat4| {
        let normal = |n: DVec3| matrix.inverse().transpose().transform_vector3(n).normalize();
        board().iter().map(|[p, n]| [matrix.transform_point3(*p), normal(*n)]).collect()
    };
    let angle = linear(&PAN, time);
    let position = DVec3::new(linear(&CAMERA, time), 1.0, 4.0);
    Moved {
        meshes: vec![("arm", placed(arm)), ("sign", placed(sign))],
        camera: Some([position, DVec3::new(-angle.sin(), 0.0, -angle.cos())]),
        light: Some(sign.transform_point3(LAMP)),
    }
}
