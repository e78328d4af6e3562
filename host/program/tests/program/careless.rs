//! What careless or hostile use must not do: to a terminal, to files that are read, to a machine.

use std::process::{Command, Stdio};
use std::time::Duration;

use serde_json::json;

use crate::PROGRAM;
use crate::support::{Outcome, TRIANGLE, Workplace, changed, finish, program, run, triangles, zeros};

/// What a terminal would take for more than a name: a title, a line, a reversal, an escape in one character.
const HOSTILE: &str = "a\u{1b}]0;title\u{7}\nerror: forged\u{202e}\u{9b}31m";

/// The most threads that the program has in its first half second.
#[cfg(target_os = "linux")]
fn most_threads(command: &mut Command) -> usize {
    let mut child = command.stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
    let threads = |_| {
        std::thread::sleep(Duration::from_millis(20));
        std::fs::read_dir(format!("/proc/{}/task", child.id())).map_or(0, Iterator::count)
    };
    let most = (0..25).map(threads).max();
    child.kill().unwrap();
    child.wait().unwrap();
    most.unwrap()
}

#[test]
fn names_from_files_are_only_names() {
    let workplace = Workplace::new();
    let [long, sentence] = ["x".repeat(5000), "long name ".repeat(500)];
    let scene = workplace.scene(&changed(|d| d["extensionsUsed"] = json!([HOSTILE, long, sentence])));
    let outcomes = [run(["info", &scene]), finish(&mut workplace.render("image.exr", &scene, &["--spp", "1"]))];
    for outcome in outcomes.map(Outcome::done_whatever_it_says) {
        let text = outcome.stdout + &outcome.stderr;
        assert!(text.contains("forged") && text.contains("xx[...]xx") && text.contains("long name"), "{text}");
        assert!(!text.contains(|c: char| c != '\n' && c.is_control() || c == '\u{202e}'), "{text:?}");
        assert!(text.lines().all(|line| line.len() < 1000 && !line.starts_with("error:")), "{text}");
    }
}

/// As above, of what goes to standard output: the names of materials that a path meets, and what an export leaves out.
#[test]
fn results_hold_only_names() {
    let workplace = Workplace::new();
    let name = format!("{HOSTILE}\u{61c}{}{}", "x".repeat(5000), "long name ".repeat(500));
    let mut scene = triangles(&[TRIANGLE, TRIANGLE.map(|[x, y, z]| [x, y + 2.0, z])].concat());
    scene.0["materials"][0]["name"] = json!(name);
    scene.0["meshes"][0]["name"] = json!(name);
    scene.0["animations"] = json!([]);
    let scene = workplace.scene(&scene);
    let explain = ["explain", &scene, "--pixel", "8,6", "--size", "16x12", "--default-light", "--device", "cpu"];
    for text in [run(explain).done().stdout, run(["export", &scene, &workplace.output("b.glb")]).done().stdout] {
        assert!(!text.contains(|c: char| c != '\n' && c.is_control() || "\u{202e}\u{61c}".contains(c)), "{text:?}");
        assert!(text.lines().all(|line| line.chars().count() < 1000), "{text}");
    }
}

/// A name may hold what a terminal would take for more: what was written is told without it.
#[test]
fn names_of_what_was_written_are_only_names() {
    let workplace = Workplace::new();
    let image = workplace.output("a\u{1b}]0;title\u{7}\u{202e}.exr");
    let outcome = run(["render", "cornell", "--spp", "1", "-o", &image]).done();
    let text = outcome.stdout + &outcome.stderr;
    assert!(text.contains("wrote") && text.contains("title"), "{text}");
    assert!(!text.contains(|c: char| c != '\n' && c.is_control() || c == '\u{202e}'), "{text:?}");
}

#[test]
fn threads_of_the_environment_are_limited_too() {
    let workplace = Workplace::new();
    for variable in ["RAYON_NUM_THREADS", "RAYON_RS_NUM_CPUS"] {
        let mut command = workplace.render("image.exr", "cornell", &["--spp", "1"]);
        workplace.refuses(command.env(variable, "30000"), &[variable, "30000", "1024"]);
    }
    for (variable, number, threads) in [("RAYON_NUM_THREADS", "7", 7), ("RAYON_RS_NUM_CPUS", "5", 5)] {
        let mut command = workplace.render("image.exr", "cornell", &["--spp", "1000000"]);
        let most = most_threads(command.env(variable, number));
        assert!((threads..threads + 6).contains(&most), "{variable} {number}: {most} threads");
    }
}

#[test]
#[cfg(unix)]
fn an_interrupted_export_leaves_a_whole_file_or_none() {
    let workplace = Workplace::new();
    let file = workplace.output("glass.glb");
    run(["export", "glass", &file]).done();
    let whole = std::fs::read(&file).unwrap();
    for delay in 0..40 {
        std::fs::remove_file(&file).ok();
        let mut child =
            program(["export", "glass", &file]).stderr(Stdio::null()).stdout(Stdio::null()).spawn().unwrap();
        std::thread::sleep(Duration::from_millis(delay));
        Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap();
        child.wait().unwrap();
        let written = std::fs::read(&file).ok();
        assert!(written.is_none_or(|bytes| bytes == whole), "a part of a file after {delay} ms");
        assert!(workplace.outputs().iter().all(|name| name.starts_with("glass.")), "{:?}", workplace.outputs());
    }
}

#[test]
#[cfg(target_os = "linux")]
fn help_that_cannot_be_printed_is_an_error() {
    let full = std::fs::OpenOptions::new().write(true).open("/dev/full").unwrap();
    let status = program(["--help"]).stdout(full).stderr(Stdio::null()).status().unwrap();
    assert_eq!(status.code(), Some(2));
}

#[test]
#[cfg(target_os = "linux")]
fn a_limit_on_files_is_an_error_of_the_write() {
    let workplace = Workplace::new();
    let output = workplace.output("image.exr");
    let command = format!("ulimit -f 8; exec {PROGRAM} render cornell --size 256x256 --spp 1 -o {output} --device cpu");
    workplace.refuses(Command::new("sh").args(["-c", &command]), &["cannot write", "image.exr", "too large"]);
}

#[test]
#[cfg(target_os = "linux")]
fn a_limit_on_addresses_is_a_limit_of_memory() {
    let workplace = Workplace::new();
    let command = format!(
        "ulimit -v 8000000; exec {} render cornell --subdivide 10 -o {} --device cpu",
        env!("CARGO_BIN_EXE_restir"),
        workplace.output("image.exr")
    );
    workplace.refuses(Command::new("sh").args(["-c", &command]), &["would take", "limit"]);
}

/// Images are judged by their headers: these of 8192 x 8192 pixels have 800 MB, and the files less than one.
#[test]
#[cfg(target_os = "linux")]
fn images_are_judged_before_they_are_decoded() {
    let workplace = Workplace::new();
    let [sky, other] = ["sky.exr", "other.exr"].map(|name| workplace.input(name, &zeros(8192)));
    let mut render = workplace.render("image.exr", "cornell", &["--env", &sky]);
    workplace.refuses(render.env("RESTIR_MEMORY_LIMIT_BYTES", "600000000"), &["sky.exr would take", "smaller image"]);
    let mut compare = program(["compare", &sky, &other]);
    // one of them would fit
    let words = ["both images would take 1.5", "smaller ones"];
    finish(compare.env("RESTIR_MEMORY_LIMIT_BYTES", "1200000000")).refused(&words);
    let limited = format!("ulimit -v 1500000; exec {PROGRAM} compare {sky} {other}");
    finish(Command::new("sh").args(["-c", &limited])).refused(&words);
}

#[test]
fn what_moves_and_is_left_out_is_named() {
    let workplace = Workplace::new();
    let channel = json!({ "sampler": 0, "target": { "node": 0, "path": "translation" } });
    let walk = |name: &str| json!({ "name": name, "channels": [channel], "samplers": [{ "input": 0, "output": 0 }] });
    let same = changed(|d| {
        d["accessors"] = json!([d["accessors"][0], { "componentType": 5126, "count": 3, "type": "SCALAR" }]);
        let mut walks = json!([walk("walk"), walk("run")]);
        walks.as_array_mut().unwrap().iter_mut().for_each(|walk| walk["samplers"][0]["input"] = json!(1));
        d["animations"] = walks;
    });
    run(["info", &workplace.scene(&same)]).says(&["animation run", "an animation before it", "ignored"]);
    let words = ["go out", "single precision", "period"];
    run(["export", "moving", &workplace.output("moving.glb")]).says(&words);
}

/// A picture that lacks light looks like any other.
#[test]
fn light_that_a_technique_leaves_out_is_named() {
    let workplace = Workplace::new();
    for (scene, lacks) in [("candles", true), ("cornell", false)] {
        for technique in ["restir-di", "restir-pt"] {
            let output = workplace.output(&format!("{scene}-{technique}.exr"));
            let size = ["--size", "8x6", "--frames", "1", "--device", "cpu"];
            let mut command = program(["render", scene, "--technique", technique, "-o", &output]);
            let outcome = finish(command.args(size));
            let said = outcome.stderr.contains(&format!("warning: {technique} does not follow light inside of things"));
            assert!(outcome.code == Some(0) && said == lacks, "{scene}, {technique}: {}", outcome.stderr);
        }
    }
}

/// Settings that change nothing, and frames that are made and not shown.
#[test]
fn what_is_set_in_vain_is_named() {
    let workplace = Workplace::new();
    let outcome = |arguments: &[&str]| {
        let output = workplace.output("image.exr");
        let mut command = program(["render", "-o", &output, "--size", "8x6", "--device", "cpu"]);
        finish(command.args(arguments))
    };
    let walk = "has no use for parts, lambert_below with subsurface=walk";
    let profile = "has no use for orders with profiles";
    let nothing = "has no use for segments where no light is followed inside";
    let alone = "restir-di makes 4 frames, each without the others";
    let progressive = ["--technique", "restir-di", "--set", "preset=progressive", "--frames", "4"];
    let cases: [(&[&str], Option<&str>); 9] = [
        (&["slab", "--spp", "1", "--set", "parts=rest", "--set", "lambert_below=2"], Some(walk)),
        (&["slab", "--spp", "1", "--set", "subsurface=hybrid", "--set", "orders=0..1"], Some(profile)),
        (&["cornell", "--spp", "1", "--set", "segments=1"], Some(nothing)),
        (&["slab", "--spp", "1", "--set", "orders=0..1"], None),
        (&["slab", "--spp", "1", "--set", "subsurface=hybrid", "--set", "parts=rest"], None),
        (&[&["cornell"], progressive.as_slice()].concat(), Some(alone)),
        (&[&["cornell", "--accumulate"], progressive.as_slice()].concat(), None),
        (&[&["moving"], progressive.as_slice()].concat(), None),
        (&["cornell", "--technique", "restir-di", "--frames", "4"], None),
    ];
    for (arguments, remark) in cases {
        let outcome = outcome(arguments);
        let said = remark.map_or(!outcome.stderr.contains("warning"), |remark| outcome.stderr.contains(remark));
        assert!(outcome.code == Some(0) && said, "{arguments:?}: {}", outcome.stderr);
    }
}
