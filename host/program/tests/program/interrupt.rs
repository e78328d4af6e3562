//! Ctrl-C during a render.

use std::io::{BufRead, BufReader};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use crate::child::{Guarded, interrupt, interrupt_at};
use crate::support::{Workplace, program};

#[test]
#[cfg_attr(first_tier, ignore = "left to `cargo test --release`")]
fn an_interrupted_render_leaves_no_file() {
    for signal in ["-INT", "-TERM"] {
        let workplace = Workplace::new();
        let more = ["--png", &workplace.output("image.png"), "--size", "32x32", "--spp", "100000000"];
        interrupt(&mut workplace.render("image.exr", "cornell", &more), signal);
        assert_eq!(workplace.outputs(), [""; 0]);
    }
}

/// What is left of a reference is whole halves of it, or nothing at all; never an empty folder.
#[test]
#[cfg_attr(first_tier, ignore = "left to `cargo test --release`")]
fn an_interrupted_reference_leaves_whole_halves() {
    let command = |cache: &std::path::Path, spp: &str| {
        let mut command = program(["reference", "cornell", "--size", "16x12", "--device", "cpu", "--threads", "1"]);
        command.args(["--spp", spp, "--cache"]).arg(cache);
        command
    };
    let cache = tempfile::tempdir().unwrap();
    let said = interrupt(&mut command(cache.path(), "100000000"), "-INT");
    assert!(said.contains("kept in"), "{said}");
    for delay in (0..120).step_by(8) {
        let cache = tempfile::tempdir().unwrap();
        let mut asked = command(cache.path(), "1000000");
        let mut child = Guarded(asked.stderr(Stdio::null()).stdout(Stdio::null()).spawn().unwrap());
        std::thread::sleep(Duration::from_millis(delay));
        // what runs in the background may have been started with -INT ignored, and loses it until it listens
        Command::new("kill").args(["-TERM", &child.0.id().to_string()]).status().unwrap();
        child.wait_for(Duration::from_secs(60)).expect("it did not stop within a minute");
        for folder in std::fs::read_dir(cache.path()).unwrap() {
            let files: Vec<_> = std::fs::read_dir(folder.unwrap().path()).unwrap().map(|file| file.unwrap()).collect();
            assert!(!files.is_empty(), "an empty folder after {delay} ms");
            for file in files {
                restir::image::read_exr(&file.path()).unwrap();
            }
        }
    }
}

/// Two million triangles take seconds to build, and the first signal ends that.
#[test]
#[cfg_attr(first_tier, ignore = "left to `cargo test --release`")]
fn a_scene_that_is_built_can_be_interrupted() {
    let workplace = Workplace::new();
    let mut command = workplace.render("image.exr", "cornell", &["--subdivide", "8", "--spp", "1"]);
    let said = interrupt_at("building a scene of", &mut command, "-INT");
    assert!(!said.contains("rendering:"), "{said}");
    assert_eq!(workplace.outputs(), [""; 0]);
}

/// What is rendered, and how often it is interrupted and goes on.
const RENDERS: [(&str, &[&str], u64); 5] = [
    ("cornell", &["--size", "48x36", "--spp", "1500", "--max-depth", "4", "--set", "dispatch_samples=1"], 2),
    ("cornell", &["--size", "40x30", "--technique", "restir-di", "--frames", "250", "--accumulate"], 2),
    ("moving", &["--size", "32x24", "--technique", "restir-di", "--frames", "180", "--set", "preset=quality"], 2),
    (
        "moving",
        &[
            "--size",
            "32x24",
            "--technique",
            "restir-di",
            "--frames",
            "120",
            "--set",
            "spatial=2",
            "--set",
            "feedback=off",
        ],
        2,
    ),
    ("moving", &["--size", "24x18", "--technique", "restir-pt", "--frames", "60", "--set", "direct=restir-di"], 2),
];

/// Renders that are interrupted at random, each at least once, and go on until they are done: the bits are those of one that was not.
#[test]
#[cfg_attr(first_tier, ignore = "left to `cargo test --release`")]
fn interrupted_renders_go_on_with_the_same_bits() {
    let (mut renders, mut interruptions) = (0, 0);
    for (scene, more, rounds) in RENDERS {
        let workplace = Workplace::new();
        let arguments = [more, &["--threads", "1"]].concat();
        let start = Instant::now();
        assert!(workplace.render("whole.exr", scene, &arguments).output().unwrap().status.success());
        for round in 0..rounds {
            interruptions += goes_on(&workplace, scene, &arguments, round, start.elapsed());
            renders += 1;
        }
    }
    println!("{interruptions} interruptions of {renders} renders");
    assert!(renders >= 10);
}

/// The same on a device, of paths and of chains.
#[cfg(feature = "gpu")]
#[test]
#[cfg_attr(first_tier, ignore = "left to `cargo test --release`")]
fn interrupted_renders_go_on_with_the_same_bits_on_a_device() {
    if !crate::adapter::adapter_is_there() {
        return;
    }
    for (scene, more) in [
        ("cornell", &["--size", "32x24", "--spp", "600", "--max-depth", "4", "--set", "dispatch_samples=1"][..]),
        ("moving", &["--size", "24x18", "--technique", "restir-pt", "--frames", "60"]),
    ] {
        let workplace = Workplace::new();
        let arguments = [more, &["--device", "gpu"]].concat();
        let start = Instant::now();
        assert!(workplace.render("whole.exr", scene, &arguments).output().unwrap().status.success());
        assert!(goes_on(&workplace, scene, &arguments, 0, start.elapsed()) > 0);
    }
}

/// Interrupts a render at random, at least once, and lets it go on until it is done, which takes about as long as `whole` without that; gives
/// how often it was interrupted.
fn goes_on(workplace: &Workplace, scene: &str, arguments: &[&str], round: u64, whole: Duration) -> u32 {
    let (name, kept) = (format!("parts{round}.exr"), workplace.output(&format!("kept{round}")));
    let arguments = [arguments, &["--resume", &kept]].concat();
    let mut interruptions = 0;
    for attempt in 0..100_u32 {
        let mut render = workplace.render(&name, scene, &arguments);
        let mut child = Guarded(render.stderr(Stdio::null()).stdout(Stdio::null()).spawn().unwrap());
        // a Weyl sequence: up to half of a render, and more with every interruption, so that it ends
        let part = (round * 31 + u64::from(attempt) * 7 + 1) * 0x9e37_79b9 % 1000;
        let wait = whole * part as u32 * (1 + interruptions) / 2000;
        let done = child.wait_for(wait).or_else(|| {
            assert!(Command::new("kill").args(["-INT", &child.0.id().to_string()]).status().unwrap().success());
            child.wait_for(Duration::from_secs(60))
        });
        let status = done.expect("it did not stop within a minute");
        // one that was over before it was interrupted is not of interest
        if status.success() && interruptions > 0 {
            assert!(!std::path::Path::new(&kept).exists(), "the checkpoint is deleted");
            let bytes = |name: &str| std::fs::read(workplace.output(name)).unwrap();
            assert!(bytes(&name) == bytes("whole.exr"), "{scene}, {arguments:?}, round {round}");
            return interruptions;
        }
        // before it listens the signal ends it, which leaves nothing
        assert!(matches!(status.code(), Some(0 | 130) | None), "{status}");
        interruptions += u32::from(status.code() == Some(130));
    }
    panic!("{scene}, round {round}: {interruptions} interruptions, and it is not done");
}

/// Files of frames that were written are whole, and those that are missing can be added: all have the bits of a run that was not
/// interrupted.
#[test]
#[cfg_attr(first_tier, ignore = "left to `cargo test --release`")]
fn interrupted_frames_are_whole() {
    for technique in ["path", "restir-di"] {
        let workplace = Workplace::new();
        let common = ["--technique", technique, "--turntable", "60", "--size", "64x48", "--threads", "1"];
        let arguments = [&common[..], &["--skip-existing"]].concat();
        let spend = if technique == "path" { &["--spp", "16"][..] } else { &[] };
        let arguments = [&arguments[..], spend].concat();
        for wait in [150, 250, 400] {
            let mut command = workplace.render("f###.exr", "cornell", &arguments);
            let mut child = Guarded(command.stderr(Stdio::null()).stdout(Stdio::null()).spawn().unwrap());
            if child.wait_for(Duration::from_millis(wait)).is_none() {
                Command::new("kill").args(["-INT", &child.0.id().to_string()]).status().unwrap();
            }
            let status = child.wait_for(Duration::from_secs(60)).expect("it did not stop within a minute");
            assert!(matches!(status.code(), Some(0 | 130)), "{status}");
            for name in workplace.outputs() {
                assert!(name.starts_with('f'), "{name}");
                restir::image::read_exr(workplace.output(&name).as_ref()).unwrap();
            }
        }
        assert!(workplace.render("f###.exr", "cornell", &arguments).output().unwrap().status.success());
        let whole = [&common[..], spend].concat();
        assert!(workplace.render("w###.exr", "cornell", &whole).output().unwrap().status.success());
        for frame in 0..60 {
            let bytes = |kind: &str| std::fs::read(workplace.output(&format!("{kind}{frame:03}.exr"))).unwrap();
            assert!(bytes("f") == bytes("w"), "{technique}, frame {frame}");
        }
    }
}

/// A second Ctrl-C, while the first one has what is done written down, waits for the file.
#[test]
#[cfg_attr(first_tier, ignore = "left to `cargo test --release`")]
fn a_second_interruption_leaves_no_part_of_a_checkpoint() {
    for round in 0..4_u64 {
        let workplace = Workplace::new();
        let kept = workplace.output("kept");
        let more = ["--size", "768x512", "--spp", "1000000", "--resume", &kept];
        let mut command = workplace.render("image.exr", "cornell", &more);
        let mut child = Guarded(command.stderr(Stdio::piped()).stdout(Stdio::null()).spawn().unwrap());
        let mut stderr = BufReader::new(child.0.stderr.take().unwrap());
        let mut line = String::new();
        while !line.starts_with("rendering:") {
            line.clear();
            assert_ne!(stderr.read_line(&mut line).unwrap(), 0, "it ended before");
        }
        let signal = |child: &Guarded| Command::new("kill").args(["-INT", &child.0.id().to_string()]).status().unwrap();
        signal(&child);
        // until the file is begun, or is there
        let start = Instant::now();
        while workplace.outputs().is_empty() && start.elapsed() < Duration::from_secs(20) {
            std::thread::sleep(Duration::from_micros(200));
        }
        std::thread::sleep(Duration::from_millis(round));
        signal(&child);
        let status = child.wait_for(Duration::from_secs(60)).expect("it did not stop within a minute");
        assert_eq!(status.code(), Some(130));
        assert_eq!(workplace.outputs(), ["kept"], "round {round}");
    }
}

/// As above, of the halves of a reference: they are whole, or there is no folder for them.
#[test]
#[cfg_attr(first_tier, ignore = "left to `cargo test --release`")]
fn a_second_interruption_leaves_no_part_of_a_reference() {
    let mut written = 0;
    for round in 0..4_u64 {
        let workplace = Workplace::new();
        let cache = workplace.output("cache");
        let mut command = program(["reference", "cornell", "--size", "192x144", "--spp", "1000000", "--device", "cpu"]);
        command.args(["--threads", "1", "--max-depth", "2", "--cache", &cache]);
        let mut child = Guarded(command.stderr(Stdio::piped()).stdout(Stdio::null()).spawn().unwrap());
        let mut stderr = BufReader::new(child.0.stderr.take().unwrap());
        let mut line = String::new();
        while !line.starts_with("rendering:") {
            line.clear();
            assert_ne!(stderr.read_line(&mut line).unwrap(), 0, "it ended before");
        }
        let files = || {
            let folders = std::fs::read_dir(&cache).into_iter().flatten().map(|folder| folder.unwrap().path());
            folders
                .flat_map(|folder| std::fs::read_dir(folder).unwrap())
                .map(|file| file.unwrap().path())
                .collect::<Vec<_>>()
        };
        let signal = |child: &Guarded| Command::new("kill").args(["-INT", &child.0.id().to_string()]).status().unwrap();
        // a batch later
        std::thread::sleep(Duration::from_millis(3000));
        signal(&child);
        while files().is_empty() && child.0.try_wait().unwrap().is_none() {
            std::thread::sleep(Duration::from_micros(200));
        }
        std::thread::sleep(Duration::from_millis(round));
        signal(&child);
        let status = child.wait_for(Duration::from_secs(60)).expect("it did not stop within a minute");
        assert_eq!(status.code(), Some(130));
        for file in files() {
            restir::image::read_exr(&file).unwrap_or_else(|error| panic!("round {round}: {error}"));
            written += 1;
        }
    }
    assert!(written > 0, "no half was done when it was interrupted");
}

/// What is kept is of one render, and of no other; what is damaged is not believed.
#[test]
#[cfg_attr(first_tier, ignore = "left to `cargo test --release`")]
fn checkpoints_of_other_renders_are_refused() {
    let workplace = Workplace::new();
    let kept = workplace.output("kept");
    let of = |spp: &str| {
        let more = ["--size", "32x32", "--spp", spp, "--resume", &kept];
        workplace.render("image.exr", "cornell", &more)
    };
    interrupt(&mut of("100000000"), "-INT");
    let refused = |command: &mut Command| {
        let output = command.output().unwrap();
        let said = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(2), "{said}");
        said
    };
    let other = refused(&mut of("100000001"));
    assert!(other.contains("another scene, of other settings") && other.contains("delete it"), "{other}");
    let mut bytes = std::fs::read(&kept).unwrap();
    for at in [0, 30, 60, bytes.len() / 2, bytes.len() - 1] {
        bytes[at] ^= 4;
        std::fs::write(&kept, &bytes).unwrap();
        let damaged = refused(&mut of("100000000"));
        assert!(damaged.contains("no whole checkpoint"), "{at}: {damaged}");
        bytes[at] ^= 4;
    }
    std::fs::write(&kept, &bytes[..bytes.len() / 3]).unwrap();
    refused(&mut of("100000000"));
}
