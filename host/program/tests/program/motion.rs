//! glTF files in which something moves, at times in seconds: skins, morph targets, nodes and cameras, whole and broken.

use serde_json::{Value, json};

use crate::support::{TRIANGLE, Workplace, finish, glb, run, triangles};

/// The triangle in a file that more is added to.
struct File {
    document: Value,
    bytes: Vec<u8>,
}

impl File {
    fn new() -> Self {
        let (document, bytes) = triangles(&TRIANGLE);
        Self { document, bytes }
    }

    /// Adds an accessor of the given type and component type over little-endian bytes.
    fn data(&mut self, kind: &str, component: u32, count: usize, bytes: &[u8]) -> usize {
        let offset = self.bytes.len();
        self.bytes.extend(bytes);
        self.bytes.resize(self.bytes.len().next_multiple_of(4), 0);
        let add = |array: &mut Value, member: Value| {
            let members = array.as_array_mut().unwrap();
            members.push(member);
            members.len() - 1
        };
        let view = json!({ "buffer": 0, "byteOffset": offset, "byteLength": bytes.len() });
        let view = add(&mut self.document["bufferViews"], view);
        self.document["buffers"][0]["byteLength"] = json!(self.bytes.len());
        let accessor = json!({ "bufferView": view, "componentType": component, "count": count, "type": kind });
        add(&mut self.document["accessors"], accessor)
    }

    fn floats(&mut self, kind: &str, count: usize, values: &[f32]) -> usize {
        self.data(kind, 5126, count, &values.iter().flat_map(|x| x.to_le_bytes()).collect::<Vec<u8>>())
    }

    /// From time 0 to 2 in a straight line.
    fn animate(&mut self, node: usize, path: &str, kind: &str, count: usize, values: &[f32]) {
        let (input, output) = (self.floats("SCALAR", 2, &[0.0, 2.0]), self.floats(kind, count, values));
        self.document["animations"] = json!([{ "name": "walk", "samplers": [{ "input": input, "output": output }],
            "channels": [{ "sampler": 0, "target": { "node": node, "path": path } }] }]);
    }

    fn attribute(&mut self, name: &str, accessor: usize) {
        self.document["meshes"][0]["primitives"][0]["attributes"][name] = json!(accessor);
    }

    /// The triangle on a joint, node 1, that goes from 0 to 1 along x, and a node that it does not follow.
    fn skinned() -> Self {
        let mut file = Self::new();
        let joints = file.data("VEC4", 5121, 3, &[0; 12]);
        let weights = file.floats("VEC4", 3, &[1.0, 0.0, 0.0, 0.0].repeat(3));
        file.attribute("JOINTS_0", joints);
        file.attribute("WEIGHTS_0", weights);
        file.document["nodes"] = json!([{ "mesh": 0, "skin": 0, "translation": [7.0, 7.0, 7.0] }, { "name": "hip" }]);
        file.document["scenes"] = json!([{ "nodes": [0, 1] }]);
        file.document["skins"] = json!([{ "name": "bones", "joints": [1] }]);
        file.animate(1, "translation", "VEC3", 2, &[0.0, 0.0, 0.0, 1.0, 0.0, 0.0]);
        file
    }

    /// The triangle with a target that moves it by 1 along x, and a weight from 0 to 1.
    fn morphed() -> Self {
        let mut file = Self::new();
        let deltas = file.floats("VEC3", 3, &[1.0, 0.0, 0.0].repeat(3));
        file.document["meshes"][0]["primitives"][0]["targets"] = json!([{ "POSITION": deltas }]);
        file.animate(0, "weights", "SCALAR", 2, &[0.0, 1.0]);
        file
    }

    /// The triangle on a node within one that goes from 0 to 1 along x, beside the camera, which stays.
    fn animated() -> Self {
        let mut file = Self::new();
        file.document["nodes"] = json!([{ "children": [1] }, { "mesh": 0 }]);
        file.animate(0, "translation", "VEC3", 2, &[0.0, 0.0, 0.0, 1.0, 0.0, 0.0]);
        file
    }

    /// The triangle, moved by so much along x.
    fn still(x: f32) -> Self {
        let (document, bytes) = triangles(&TRIANGLE.map(|[a, b, c]| [a + x, b, c]));
        Self { document, bytes }
    }

    fn glb(self) -> Vec<u8> {
        glb(&(self.document, self.bytes))
    }
}

/// Small files with each kind of motion.
pub(crate) fn moving_files() -> [Vec<u8>; 3] {
    [File::skinned(), File::morphed(), File::animated()].map(File::glb)
}

/// A view of the triangle wherever it is, and what a path tracer takes.
const LIT: [&str; 4] = ["--camera", "0.7,0.5,3:0.7,0.5,0", "--spp", "2"];

#[test]
#[cfg_attr(first_tier, ignore = "left to `cargo test --release`")]
fn what_moves_is_where_it_is_at_a_time() {
    let workplace = Workplace::new();
    let film = |file: &str, time: &str| {
        let more = [&LIT[..], &["--default-light", "--time", time]].concat();
        workplace.picture("image.exr", file, &more).pixels
    };
    // the light is placed about what is there at that time
    let still = |x: f32| {
        let file = workplace.input("still.glb", &File::still(x).glb());
        let more = [&LIT[..], &["--default-light"]].concat();
        workplace.picture("image.exr", &file, &more).pixels
    };
    let stills = [still(0.0), still(0.25), still(1.0)];
    assert!(stills[0] != stills[1] && stills[1] != stills[2]);
    for (name, file) in [("skinned", File::skinned()), ("morphed", File::morphed()), ("animated", File::animated())] {
        let file = workplace.input("moving.glb", &file.glb());
        let back = workplace.output("back.glb");
        run(["export", &file, &back, "--camera", "0,0,3:0,0,0"]).done();
        for (time, still) in ["0", "0.5", "9"].into_iter().zip(&stills) {
            assert!(film(&file, time) == *still, "{name} at {time}");
            assert!(film(&back, time) == *still, "the export of {name} at {time}");
        }
        std::fs::remove_file(back).unwrap();
    }
}

#[test]
#[cfg_attr(first_tier, ignore = "left to `cargo test --release`")]
fn frames_begin_at_the_time() {
    let workplace = Workplace::new();
    let mut file = File::animated();
    file.document["materials"][0]["emissiveFactor"] = json!([1.0, 0.5, 0.2]);
    let file = workplace.input("moving.glb", &file.glb());
    let film = |more: &[&str]| {
        let more = [&LIT[..2], &["--technique", "restir-di", "--set", "preset=biased-2020"], more].concat();
        workplace.picture("image.exr", &file, &more).pixels
    };
    // of independent frames the last one has its own time alone
    let at = |frames: &str, time: &str, rate: &str| {
        film(&["--set", "temporal=off", "--frames", frames, "--time", time, "--frame-rate", rate])
    };
    assert!(at("4", "0.25", "4") == at("4", "0.625", "8"), "both end at 1");
    assert!(at("4", "0.25", "4") != at("4", "0.25", "8"));
}

#[test]
#[cfg_attr(first_tier, ignore = "left to `cargo test --release`")]
fn a_camera_moves_too() {
    let workplace = Workplace::new();
    let scene = |place: [f32; 3], moves: bool| {
        let mut file = File::new();
        file.document["cameras"] = json!([{ "type": "perspective", "perspective": { "yfov": 0.7, "znear": 0.1 } }]);
        file.document["nodes"] = json!([{ "mesh": 0 }, { "camera": 0, "translation": place }]);
        file.document["scenes"] = json!([{ "nodes": [0, 1] }]);
        if moves {
            file.animate(1, "translation", "VEC3", 2, &[0.0, 0.0, 3.0, 1.0, 0.0, 3.0]);
        }
        workplace.input("scene.glb", &file.glb())
    };
    let film = |scene: &str, more: &[&str]| {
        workplace.picture("image.exr", scene, &[&["--default-light", "--spp", "2"], more].concat()).pixels
    };
    let still = film(&scene([0.25, 0.0, 3.0], false), &[]);
    let moving = scene([9.0, 9.0, 9.0], true);
    assert!(film(&moving, &["--time", "0.5"]) == still);
    let own = ["--camera", "0,0,3:0,0,0"];
    assert!(film(&moving, &own) == film(&moving, &[&own[..], &["--time", "0.5"]].concat()), "the given one stays");
}

#[test]
#[cfg_attr(first_tier, ignore = "left to `cargo test --release`")]
fn times_that_are_none() {
    let workplace = Workplace::new();
    let refuses =
        |more: &[&str], words: &[&str]| workplace.refuses(&mut workplace.render("image.exr", "moving", more), words);
    refuses(&["--time", "nan"], &["--time", "finite"]);
    refuses(&["--time", "soon"], &["--time"]);
    refuses(&["--frame-rate", "0"], &["--frame-rate", "positive"]);
    refuses(&["--frame-rate", "inf"], &["--frame-rate", "positive"]);
    let still = finish(&mut workplace.render("image.exr", "cornell", &["--time", "3", "--spp", "1"])).done();
    assert!(still.stderr.contains("nothing moves"), "{}", still.stderr);
}

#[test]
#[cfg_attr(first_tier, ignore = "left to `cargo test --release`")]
fn what_cannot_move_is_refused() {
    let workplace = Workplace::new();
    let refused = |file: File, words: &[&str]| {
        let scene = workplace.input("broken.glb", &file.glb());
        workplace.refuses(&mut workplace.render("image.exr", &scene, &["--default-light"]), words);
        run(["info", &scene]).refused(words);
    };
    type Break = fn(&mut File);
    let skins: [(Break, &[&str]); 9] = [
        (|f| f.document["skins"][0]["joints"] = json!([7]), &["bones", "7", "not in the scene"]),
        (|f| f.document["skins"][0]["joints"] = json!([]), &["bones", "no joints"]),
        (|f| f.document["nodes"][0]["skin"] = json!(3), &["skin 3", "does not exist"]),
        (
            |f| {
                let joints = f.data("VEC4", 5121, 3, &[[0; 8], [5; 8]].concat()[..12]);
                f.attribute("JOINTS_0", joints);
            },
            &["shape", "vertex 2", "joint 5", "bones"],
        ),
        (
            |f| {
                let weights = f.floats("VEC4", 3, &[[0.5; 8], [0.0; 8]].concat()[..12]);
                f.attribute("WEIGHTS_0", weights);
            },
            &["shape", "vertex 2", "weights are all 0", "bones"],
        ),
        (
            |f| {
                let weights = f.floats("VEC4", 3, &[f32::NAN; 12]);
                f.attribute("WEIGHTS_0", weights);
            },
            &["shape", "vertex 0", "weight of NaN"],
        ),
        (
            |f| {
                let weights = f.floats("VEC4", 2, &[1.0; 8]);
                f.attribute("WEIGHTS_0", weights);
            },
            &["shape", "3 vertices", "weights", "2"],
        ),
        (
            |f| {
                let matrices = f.floats("MAT4", 0, &[]);
                f.document["skins"][0]["inverseBindMatrices"] = json!(matrices);
            },
            &["bones", "1 joints", "matrices for 0"],
        ),
        (
            |f| {
                let attributes = &mut f.document["meshes"][0]["primitives"][0]["attributes"];
                attributes.as_object_mut().unwrap().remove("JOINTS_0");
            },
            &["shape", "JOINTS_0"],
        ),
    ];
    for (change, words) in skins {
        let mut file = File::skinned();
        change(&mut file);
        refused(file, words);
    }
    let targets: [(Break, &[&str]); 5] = [
        (
            |f| {
                let deltas = f.floats("VEC3", 2, &[1.0; 6]);
                f.document["meshes"][0]["primitives"][0]["targets"][0]["POSITION"] = json!(deltas);
            },
            &["shape", "3 vertices", "morph target 0", "for 2"],
        ),
        (
            |f| {
                let deltas = f.floats("VEC3", 3, &[f32::INFINITY; 9]);
                f.document["meshes"][0]["primitives"][0]["targets"][0]["POSITION"] = json!(deltas);
            },
            &["shape", "morph target 0", "not finite"],
        ),
        (|f| f.document["meshes"][0]["weights"] = json!([0.0, 1.0]), &["2 weights", "1 morph targets"]),
        (|f| f.animate(0, "weights", "SCALAR", 3, &[0.0; 3]), &["weights", "need 2", "have 3"]),
        (|f| f.animate(0, "weights", "SCALAR", 2, &[f32::NAN; 2]), &["weights", "not finite"]),
    ];
    for (change, words) in targets {
        let mut file = File::morphed();
        change(&mut file);
        refused(file, words);
    }
    let tracks: [(Break, &[&str]); 7] = [
        (|f| f.document["animations"][0]["channels"][0]["target"]["node"] = json!(9), &["walk", "channel 0", "node 9"]),
        (|f| f.document["animations"][0]["channels"][0]["sampler"] = json!(9), &["walk", "channel 0", "sampler 9"]),
        (|f| f.document["animations"][0]["samplers"][0]["output"] = json!(99), &["walk", "accessor 99"]),
        (|f| f.document["animations"][0]["samplers"][0]["interpolation"] = json!("WAVY"), &["walk", "interpolation"]),
        (
            |f| {
                let times = f.floats("SCALAR", 2, &[2.0, 1.0]);
                f.document["animations"][0]["samplers"][0]["input"] = json!(times);
            },
            &["translation", "ascend"],
        ),
        (
            |f| f.document["nodes"][0]["matrix"] = json!([1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]),
            &["translation", "matrix"],
        ),
        (|f| f.animate(0, "translation", "VEC3", 2, &[0.0, 0.0, 0.0, 0.0, 0.0, 3e38]), &["shape", "moves beyond"]),
    ];
    let last = tracks.len() - 1;
    for (change, words) in &tracks[..last] {
        let mut file = File::animated();
        change(&mut file);
        refused(file, words);
    }
    // it is seen at the time at which it happens
    let mut file = File::animated();
    tracks[last].0(&mut file);
    let scene = workplace.input("far.glb", &file.glb());
    let more = ["--default-light", "--technique", "restir-di", "--frames", "40"];
    workplace.refuses(&mut workplace.render("image.exr", &scene, &more), tracks[last].1);
}
