//! `restir export-plan`.

use std::path::Path;

use restir::advanced::plan_file::Plan;
use restir::exec::{CpuExecutor, Executor};
use restir::image::read_exr;

use crate::support::{Workplace, finish, program};

/// From the command line to a plan that renders what the command line renders.
#[test]
fn a_plan_renders_what_the_command_renders() {
    let workplace = Workplace::new();
    let options = ["--technique", "restir-di", "--frames", "3", "--size", "16x12", "--seed", "5"];
    let folder = workplace.output("plan");
    finish(program(["export-plan", "cornell", "-o", &folder]).args(options)).done();
    let picture = workplace.output("picture.exr");
    finish(program(["render", "cornell", "-o", &picture]).args(options)).done();
    let image = read_exr(Path::new(&picture)).unwrap();
    let plan = Plan::open(Path::new(&folder)).unwrap();
    assert_eq!(plan.document.about["scene"], "cornell");
    let words = CpuExecutor::inline().run(plan.frames().unwrap()).unwrap().swap_remove(0);
    let pixels: Vec<[f32; 4]> = bytemuck::pod_collect_to_vec(&words);
    assert!(pixels.iter().zip(&image.pixels).all(|(pixel, rgb)| pixel[..3] == rgb[..]));
}

#[test]
fn what_cannot_be_exported_is_refused() {
    let workplace = Workplace::new();
    let folder = workplace.output("plan");
    let refused = |more: &[&str], words: &[&str]| {
        finish(program(["export-plan", "cornell", "-o", &folder]).args(more)).refused(words);
        assert!(!Path::new(&folder).join("plan.json").exists());
    };
    refused(&["--to", "cuda"], &["cuda", "wgsl"]);
    refused(&["--turntable", "0", "--technique", "restir-di"], &["--turntable at least 1"]);
    refused(&["--turntable", "8"], &["--turntable is for", "path repeats samples"]);
    refused(&["--frames", "0..3", "--technique", "restir-di"], &["--frames 4"]);
    refused(&["--size", "0x4"], &["0x4"]);
    let file = workplace.input("file", b"no folder");
    finish(&mut program(["export-plan", "cornell", "-o", &file])).refused(&["file"]);
}
