//! The program on a GPU. Without an adapter these tests are skipped, visibly; with `RESTIR_REQUIRE_GPU=1` they fail.

use std::io::Write;
use std::path::Path;
use std::process::Command;

use restir::exec::gpu::adapters;
use restir::image::{read_exr, read_exr_metadata};
use restir::kernels::spirv::FILES;
use tempfile::TempDir;

use crate::support::{Workplace, assert_done, assert_refused, finish, program};

/// Whether there is an adapter to test on.
fn has_adapter() -> bool {
    if !adapters().is_empty() {
        return true;
    }
    let required = std::env::var("RESTIR_REQUIRE_GPU").is_ok_and(|value| value == "1");
    assert!(!required, "RESTIR_REQUIRE_GPU is 1 and there is no adapter");
    // not by `eprintln!`, which the test harness hides
    let _ = writeln!(std::io::stderr(), "skipped: there is no GPU adapter");
    false
}

/// A small render of the Cornell box, without wayland's own complaint about a missing folder.
fn render(device: &str, output: &str, runtime: &TempDir) -> Command {
    let mut command = program([
        "render", "cornell", "-o", output, "--device", device, "--size", "33x17", "--spp", "7", "--seed", "5",
        "--jitter",
    ]);
    command.env("XDG_RUNTIME_DIR", runtime.path()).env_remove("RESTIR_SHADERS");
    command
}

#[test]
fn the_gpu_gives_the_picture_of_the_cpu() {
    if !has_adapter() {
        return;
    }
    let (workplace, runtime) = (Workplace::new(), tempfile::tempdir().unwrap());
    let [cpu, gpu] = ["cpu", "gpu"].map(|device| {
        let output = workplace.output(&format!("{device}.exr"));
        assert_done(&finish(&mut render(device, &output, &runtime)));
        output
    });
    let bits = |path: &str| -> Vec<u32> {
        let image = read_exr(Path::new(path)).unwrap();
        image.pixels.as_flattened().iter().map(|value| value.to_bits()).collect()
    };
    assert!(bits(&cpu) == bits(&gpu), "the pictures differ");
    let metadata = |path: &str, key: &str| {
        let pairs = read_exr_metadata(Path::new(path)).unwrap();
        pairs.into_iter().find(|(name, _)| name == key).unwrap().1
    };
    let adapter = metadata(&gpu, "adapter");
    assert!(adapters().iter().any(|a| adapter.starts_with(&a.name)), "{adapter}");
    assert_eq!(metadata(&gpu, "executor"), "gpu");
    assert_eq!(metadata(&gpu, "parity"), "exact");
    assert_eq!(metadata(&gpu, "dispatches"), metadata(&cpu, "dispatches"));
    assert_eq!(metadata(&cpu, "adapter"), "none");
}

#[test]
fn reservoirs_of_the_gpu_have_the_genealogy_of_the_cpu() {
    if !has_adapter() {
        return;
    }
    let runtime = tempfile::tempdir().unwrap();
    let [cpu, gpu] = ["cpu", "gpu"].map(|device| {
        let arguments =
            "explain moving --technique restir-di --frames 6 --size 32x20 --pixel 10,13 --camera-path pan --json";
        let mut command = program(arguments.split(' ').chain(["--device", device]));
        let outcome = finish(command.env("XDG_RUNTIME_DIR", runtime.path()).env_remove("RESTIR_SHADERS"));
        assert_done(&outcome);
        outcome.stdout
    });
    assert!(gpu.contains("\"identical\":true") && gpu.contains("initial candidates"), "{gpu}");
    assert_eq!(cpu, gpu);
}

/// The embedded modules in a folder of their own.
fn copied_modules() -> TempDir {
    let copy = tempfile::tempdir().unwrap();
    ["exact", "fast"].iter().for_each(|flavour| std::fs::create_dir(copy.path().join(flavour)).unwrap());
    FILES.iter().for_each(|(name, bytes)| std::fs::write(copy.path().join(name), bytes).unwrap());
    copy
}

/// A render with the file `name` of the modules changed is refused, with all of `words`.
fn assert_damage_refused(name: &str, damage: impl Fn(&mut Vec<u8>), words: &[&str]) {
    let (workplace, runtime, modules) = (Workplace::new(), tempfile::tempdir().unwrap(), copied_modules());
    let path = modules.path().join(name);
    let mut bytes = std::fs::read(&path).unwrap();
    damage(&mut bytes);
    std::fs::write(&path, bytes).unwrap();
    let mut command = render("gpu", &workplace.output("image.exr"), &runtime);
    assert_refused(&finish(command.env("RESTIR_SHADERS", modules.path())), words);
    assert_eq!(workplace.outputs(), [""; 0]);
}

#[test]
fn modules_from_a_folder_are_used() {
    if !has_adapter() {
        return;
    }
    let (workplace, runtime, modules) = (Workplace::new(), tempfile::tempdir().unwrap(), copied_modules());
    let mut command = render("gpu", &workplace.output("image.exr"), &runtime);
    assert_done(&finish(command.env("RESTIR_SHADERS", modules.path())));
    assert_eq!(workplace.outputs(), ["image.exr"]);
}

#[test]
fn a_changed_byte_of_a_module() {
    if !has_adapter() {
        return;
    }
    let words = ["path", "damaged", "shader build"];
    assert_damage_refused("exact/path.spv", |bytes| bytes[0] ^= 1, &words);
    assert_damage_refused("exact/path.spv", |bytes| *bytes.last_mut().unwrap() ^= 0x80, &words);
    assert_damage_refused("exact/path.spv", |bytes| bytes[40_001] ^= 4, &words);
}

#[test]
fn a_truncated_module() {
    if !has_adapter() {
        return;
    }
    for length in [0, 3, 40_000] {
        assert_damage_refused("exact/path.spv", |bytes| bytes.truncate(length), &["path", "damaged"]);
    }
}

#[test]
fn a_manifest_that_is_none() {
    if !has_adapter() {
        return;
    }
    assert_damage_refused("manifest.json", |bytes| *bytes = b"}{ \xff".to_vec(), &["self_check", "manifest"]);
    assert_damage_refused("manifest.json", |bytes| *bytes = b"[]".to_vec(), &["self_check"]);
}

#[test]
fn a_missing_module() {
    if !has_adapter() {
        return;
    }
    let (workplace, runtime, empty) = (Workplace::new(), tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    let mut command = render("gpu", &workplace.output("image.exr"), &runtime);
    assert_refused(&finish(command.env("RESTIR_SHADERS", empty.path())), &["self_check", "cannot read"]);
    assert_eq!(workplace.outputs(), [""; 0]);
}
