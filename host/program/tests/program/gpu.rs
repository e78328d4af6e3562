//! The program on a GPU. Without an adapter these tests are skipped, visibly; with `RESTIR_REQUIRE_GPU=1` they fail.

use std::path::Path;
use std::process::Command;

use restir::image::{read_exr, read_exr_metadata};
use restir::{exec::gpu::adapters, kernels::spirv::FILES};
use tempfile::{TempDir, tempdir};

use crate::adapter::adapter_is_there;
use crate::support::{Workplace, finish, program};

/// A place to work at with an adapter.
struct Gpu {
    workplace: Workplace,
    /// Without it wayland complains.
    runtime: TempDir,
}

impl Gpu {
    /// None if there is no adapter to test on.
    fn new() -> Option<Self> {
        adapter_is_there().then(|| Self { workplace: Workplace::new(), runtime: tempdir().unwrap() })
    }

    /// The command with the embedded kernels.
    fn prepared(&self, mut command: Command) -> Command {
        command.env("XDG_RUNTIME_DIR", self.runtime.path()).env_remove("RESTIR_SHADERS");
        command
    }

    /// A small render of the Cornell box.
    fn render(&self, name: &str, device: &str) -> Command {
        let more = ["--device", device, "--size", "33x17", "--spp", "7", "--seed", "5", "--jitter"];
        self.prepared(self.workplace.render(name, "cornell", &more))
    }

    /// The same with the kernels of a folder.
    fn render_with(&self, modules: &TempDir) -> Command {
        let mut command = self.render("image.exr", "gpu");
        command.env("RESTIR_SHADERS", modules.path());
        command
    }
}

/// Frames and their layers, and the mean of scrambles: all channels of all files have the same bits.
#[test]
#[cfg_attr(first_tier, ignore = "left to `cargo test --release`")]
fn frames_layers_and_scrambles_are_those_of_the_cpu() {
    let Some(gpu) = Gpu::new() else { return };
    let renders: [&[&str]; 3] = [
        &["moving", "--technique", "restir-di", "--frames", "1..2", "--aov", "albedo,normal,depth,position,motion,id"],
        &["toys", "--spp", "2", "--frames", "1..2", "--aov", "motion"],
        &["cornell", "--spp", "2", "--noise", "100"],
    ];
    for arguments in renders {
        let is_numbered = arguments.contains(&"--frames");
        let channels = |device: &str| {
            let name = if is_numbered { format!("{device}#.exr") } else { format!("{device}.exr") };
            let more = [&arguments[1..], &["--device", device, "--size", "17x13"]].concat();
            finish(&mut gpu.prepared(gpu.workplace.render(&name, arguments[0], &more))).done();
            let files = if is_numbered { vec![format!("{device}1.exr"), format!("{device}2.exr")] } else { vec![name] };
            let of = |file: String| {
                let image = exr::prelude::read_first_flat_layer_from_file(gpu.workplace.output(&file)).unwrap();
                let channels = image.layer_data.channel_data.list.into_iter();
                channels.map(|channel| (channel.name.to_string(), bits(&channel.sample_data))).collect::<Vec<_>>()
            };
            files.into_iter().map(of).collect::<Vec<_>>()
        };
        assert!(channels("cpu") == channels("gpu"), "{arguments:?}");
    }
}

fn bits(samples: &exr::prelude::FlatSamples) -> Vec<u32> {
    samples.values_as_f32().map(f32::to_bits).collect()
}

#[test]
#[cfg_attr(first_tier, ignore = "left to `cargo test --release`")]
fn the_gpu_gives_the_picture_of_the_cpu() {
    let Some(gpu) = Gpu::new() else { return };
    let [on_cpu, on_gpu] = ["cpu", "gpu"].map(|device| {
        let name = format!("{device}.exr");
        finish(&mut gpu.render(&name, device)).done();
        gpu.workplace.output(&name)
    });
    let bits = |path: &str| -> Vec<u32> {
        let image = read_exr(Path::new(path)).unwrap();
        image.pixels.as_flattened().iter().map(|value| value.to_bits()).collect()
    };
    assert!(bits(&on_cpu) == bits(&on_gpu), "the pictures differ");
    let metadata = |path: &str, key: &str| {
        let pairs = read_exr_metadata(Path::new(path)).unwrap();
        pairs.into_iter().find(|(name, _)| name == key).unwrap().1
    };
    let adapter = metadata(&on_gpu, "adapter");
    assert!(adapters().iter().any(|a| adapter.starts_with(&a.name)), "{adapter}");
    assert_eq!(["executor", "parity"].map(|key| metadata(&on_gpu, key)), ["gpu", "exact"]);
    assert_eq!(metadata(&on_gpu, "dispatches"), metadata(&on_cpu, "dispatches"));
    assert_eq!(metadata(&on_cpu, "adapter"), "none");
}

#[test]
#[cfg_attr(first_tier, ignore = "left to `cargo test --release`")]
fn reservoirs_of_the_gpu_have_the_genealogy_of_the_cpu() {
    let Some(gpu) = Gpu::new() else { return };
    let arguments =
        "explain moving --technique restir-di --frames 6 --size 32x20 --pixel 10,13 --camera-path pan --json --device";
    let [on_cpu, on_gpu] =
        ["cpu", "gpu"].map(|device| finish(&mut gpu.prepared(program(arguments.split(' ').chain([device])))).done());
    assert_eq!(on_gpu.says(&["\"identical\":true", "initial candidates"]).stdout, on_cpu.stdout);
}

/// The embedded modules in a folder of their own.
fn copied_modules() -> TempDir {
    let copy = tempdir().unwrap();
    ["exact", "fast"].iter().for_each(|flavour| std::fs::create_dir(copy.path().join(flavour)).unwrap());
    FILES.iter().for_each(|(name, bytes)| std::fs::write(copy.path().join(name), bytes).unwrap());
    copy
}

#[test]
#[cfg_attr(first_tier, ignore = "left to `cargo test --release`")]
fn modules_from_a_folder_are_used() {
    let Some(gpu) = Gpu::new() else { return };
    finish(&mut gpu.render_with(&copied_modules())).done();
    assert_eq!(gpu.workplace.outputs(), ["image.exr"]);
}

#[test]
#[cfg_attr(first_tier, ignore = "left to `cargo test --release`")]
fn damaged_modules() {
    let Some(gpu) = Gpu::new() else { return };
    let refused = |name: &str, words: &[&str], damage: &dyn Fn(&mut Vec<u8>)| {
        let modules = copied_modules();
        let path = modules.path().join(name);
        let mut bytes = std::fs::read(&path).unwrap();
        damage(&mut bytes);
        std::fs::write(&path, bytes).unwrap();
        gpu.workplace.refuses(&mut gpu.render_with(&modules), words);
    };
    let changed = ["path", "damaged", "shader build"];
    refused("exact/path.spv", &changed, &|bytes| bytes[0] ^= 1);
    refused("exact/path.spv", &changed, &|bytes| *bytes.last_mut().unwrap() ^= 0x80);
    refused("exact/path.spv", &changed, &|bytes| bytes[40_001] ^= 4);
    for length in [0, 3, 40_000] {
        refused("exact/path.spv", &["path", "damaged"], &|bytes| bytes.truncate(length));
    }
    refused("manifest.json", &["self_check", "manifest"], &|bytes| *bytes = b"}{ \xff".to_vec());
    refused("manifest.json", &["self_check"], &|bytes| *bytes = b"[]".to_vec());
    gpu.workplace.refuses(&mut gpu.render_with(&tempdir().unwrap()), &["self_check", "cannot read"]);
}
