//! Scenes far from the origin, which are rendered relative to an origin of their own: users know coordinates of the world alone.

use restir::image::read_exr_metadata;
use serde_json::json;

use crate::support::{Workplace, changed, finish, run, value_of};

/// A power of two: what is moved by it has the bits that it had.
const FAR: f64 = 1_048_576.0;

/// The triangle at this x.
fn scene(workplace: &Workplace, x: f64) -> String {
    workplace.scene(&changed(|document| document["nodes"][0]["translation"] = json!([x, 0, 0])))
}

#[test]
#[cfg_attr(first_tier, ignore = "left to `cargo test --release`")]
fn cameras_and_positions_are_those_of_the_world() {
    let workplace = Workplace::new();
    let [near, far] = [0.0, FAR].map(|x| {
        let scene = scene(&workplace, x);
        let camera = format!("{},0.5,3:{},0.5,0", x + 0.75, x + 0.75);
        let path = json!([{ "frame": 0, "position": [x + 0.5, 0.5, 3.0], "target": [x + 0.5, 0.5, 0.0], "fov": 40 }]);
        let path = workplace.input(&format!("path-{x}.json"), path.to_string().as_bytes());
        let of_frames = ["--technique", "restir-di", "--frames", "2", "--default-light", "--camera-path", &path];
        let looks: [&[&str]; 2] = [&["--camera", &camera, "--spp", "2", "--default-light"], &of_frames];
        looks.map(|more| workplace.picture("image.exr", &scene, more).pixels)
    });
    assert!(near == far);
    assert!(near.iter().all(|pixels| pixels.iter().any(|pixel| pixel[0] > 0.0)));
    let metadata = read_exr_metadata(workplace.output("image.exr").as_ref()).unwrap();
    assert_eq!(value_of(&metadata, "origin"), Some("1048576,0,0"));
}

#[test]
fn the_origin_is_told() {
    let workplace = Workplace::new();
    let near = run(["info", &scene(&workplace, 0.0)]).says(&["that of the world"]);
    assert!(near.stdout.contains("bounds           [0.0, 0.0, 0.0] to [1.0, 1.0, 0.0]"), "{}", near.stdout);
    let far = scene(&workplace, FAR);
    run(["info", &far]).says(&["[1048576.0, 0.0, 0.0] to [1048577.0, 1.0, 0.0]", "relative to which"]);
    let explained =
        run(["explain", &far, "--default-light", "--size", "4x4", "--pixel", "2,2"]).done_whatever_it_says();
    assert!(explained.stderr.contains("positions are relative to 1048576,0,0"), "{}", explained.stderr);
    let json = ["explain", &far, "--default-light", "--size", "4x4", "--pixel", "2,2", "--json"];
    assert!(run(json).done_whatever_it_says().stdout.contains("\"origin\":[1048576.0,0.0,0.0]"));
}

#[test]
fn dim_light_is_warned_of() {
    let workplace = Workplace::new();
    let dim = changed(|document| document["materials"][0]["emissiveFactor"] = json!([1e-28, 1e-30, 0]));
    let outcome =
        finish(&mut workplace.render("image.exr", &workplace.scene(&dim), &["--spp", "1"])).done_whatever_it_says();
    assert!(outcome.stderr.contains("the brightest light of the scene is 1e-28"), "{}", outcome.stderr);
}
