//! What the camera sees, in further channels.

use std::collections::BTreeMap;

use exr::prelude::read_first_flat_layer_from_file;
use restir::image::{Image, read_exr, read_exr_metadata};
use restir::technique;

use crate::support::{Workplace, finish, program};

const ALL: &str = "albedo,normal,depth,position,motion,id";

/// The names that Blender's compositor and its denoiser look for.
const CHANNELS: [&str; 18] = [
    "B",
    "Denoising Albedo.B",
    "Denoising Albedo.G",
    "Denoising Albedo.R",
    "Denoising Normal.X",
    "Denoising Normal.Y",
    "Denoising Normal.Z",
    "Depth.Z",
    "G",
    "IndexOB.X",
    "Position.X",
    "Position.Y",
    "Position.Z",
    "R",
    "Vector.W",
    "Vector.X",
    "Vector.Y",
    "Vector.Z",
];

/// The channels of a file.
fn channels(file: &str) -> BTreeMap<String, Vec<f32>> {
    let channels = read_first_flat_layer_from_file(file).unwrap().layer_data.channel_data.list;
    channels.into_iter().map(|c| (c.name.to_string(), c.sample_data.values_as_f32().collect())).collect()
}

/// Layers have the names above, leave the picture as it is, and do not depend on the technique, but for where its rays go.
#[test]
#[cfg_attr(first_tier, ignore = "left to `cargo test --release`")]
fn every_technique_writes_layers() {
    let workplace = Workplace::new();
    let mut of_centres = Vec::new();
    for technique in technique::all() {
        let name = technique.about().name;
        let common = ["--technique", name, "--no-jitter"];
        let plain = workplace.picture("plain.exr", "cornell", &common);
        let layered = workplace.picture("layers.exr", "cornell", &[&common[..], &["--aov", ALL]].concat());
        assert_eq!(plain, layered, "{name}");
        let channels = channels(&workplace.output("layers.exr"));
        assert!(channels.keys().eq(CHANNELS), "{name}: {:?}", channels.keys());
        assert!(channels.values().flatten().all(|value| value.is_finite()));
        let seen = channels["Denoising Normal.Y"].iter().filter(|y| **y != 0.0).count();
        assert!(seen > 50, "{seen} pixels have a normal");
        of_centres.push(["Denoising Albedo.R", "Denoising Normal.Z", "IndexOB.X"].map(|name| channels[name].clone()));
    }
    assert!(of_centres.windows(2).all(|pair| pair[0] == pair[1]));
}

/// What scatters inside of things has a colour there, and nothing else has.
#[test]
#[cfg_attr(first_tier, ignore = "left to `cargo test --release`")]
fn what_scatters_inside_has_a_colour() {
    let workplace = Workplace::new();
    let scattering = |scene: &str| {
        workplace.picture("image.exr", scene, &["--aov", "scattering", "--spp", "1"]);
        let channels = channels(&workplace.output("image.exr"));
        ["R", "G", "B"].map(|name| channels[&format!("Scattering Albedo.{name}")].clone()).concat()
    };
    let seen = |values: &[f32]| values.iter().filter(|&&value| value > 0.0).count();
    let values = scattering("candles");
    assert!(values.iter().all(|value| (0.0..=1.0).contains(value)));
    assert!(seen(&values) > 30, "{} values", seen(&values));
    assert_eq!(seen(&scattering("cornell")), 0);
}

/// Of an animation the layers are those of the frame that is shown, and its points move.
#[test]
#[cfg_attr(first_tier, ignore = "left to `cargo test --release`")]
fn motion_is_that_of_the_frame() {
    let workplace = Workplace::new();
    let moved = |more: &[&str]| {
        let common = ["--aov", "motion", "--spp", "1"];
        workplace.picture("image.exr", "toys", &[&common, more].concat());
        let channels = channels(&workplace.output("image.exr"));
        ["Vector.X", "Vector.Z"].map(|name| channels[name].iter().map(|x| x.abs()).fold(0.0, f32::max))
    };
    let [from, to] = moved(&["--time", "1.5"]);
    assert!(from > 0.01 && to > 0.01, "{from} {to}");
    let [slower, _] = moved(&["--time", "1.5", "--frame-rate", "240"]);
    assert!(slower < 0.2 * from, "{slower} {from}");
}

#[test]
#[cfg_attr(first_tier, ignore = "left to `cargo test --release`")]
fn layers_that_there_are_not() {
    let workplace = Workplace::new();
    let refused = |layers: &str, words: &[&str]| {
        workplace.refuses(&mut workplace.render("image.exr", "cornell", &["--aov", layers]), words);
    };
    refused("albedo,beauty", &["beauty", "albedo | normal"]);
    refused("id,id", &["id twice"]);
    assert!(read_exr(workplace.output("image.exr").as_ref()).is_err());
}

/// What was rendered before is denoised by its layers, and says so of itself; without them, or over its input, it is not.
#[test]
#[cfg_attr(first_tier, ignore = "left to `cargo test --release`")]
fn images_are_denoised_afterwards() {
    let workplace = Workplace::new();
    let [noisy, plain, denoised] = ["noisy.exr", "plain.exr", "denoised.exr"].map(|name| workplace.output(name));
    workplace.picture("plain.exr", "cornell", &["--spp", "4"]);
    let before = workplace.picture("noisy.exr", "cornell", &["--spp", "4", "--aov", "albedo,normal,depth,id"]);
    let denoise = |from: &str, to: &str| finish(&mut program(["denoise", from, "-o", to, "--device", "cpu"]));
    denoise(&noisy, &denoised).says(&["wrote"]);
    let after = read_exr(denoised.as_ref()).unwrap();
    let mean = |image: &Image| image.pixels.as_flattened().iter().sum::<f32>();
    assert!(before != after && (mean(&before) / mean(&after) - 1.0).abs() < 1e-3);
    let metadata = read_exr_metadata(denoised.as_ref()).unwrap();
    assert!(metadata.iter().any(|(key, value)| key == "denoise" && value.contains("rounds=5")), "{metadata:?}");
    denoise(&plain, &denoised).refused(&["no channel \"Denoising Albedo.R\"", "--aov"]);
    denoise(&noisy, &noisy).refused(&["is also read"]);
    denoise(&noisy, &workplace.output("denoised.png")).refused(&["has to end in .exr"]);
    denoise("nowhere.exr", &denoised).refused(&["cannot read nowhere.exr"]);
    assert_eq!(read_exr(denoised.as_ref()).unwrap(), after);
}

/// Open Image Denoise is not in this program, which says so.
#[test]
fn what_is_not_built_in_is_refused() {
    let workplace = Workplace::new();
    let mut render = workplace.render("image.exr", "cornell", &["--denoise=oidn"]);
    workplace.refuses(&mut render, &["--features oidn"]);
}
