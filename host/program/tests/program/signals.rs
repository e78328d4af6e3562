//! Ctrl-C at any moment of any command.

use std::process::{Command, Stdio};
use std::time::Duration;

use crate::support::{Outcome, Workplace, program};

/// Commands that end by themselves or not, with the files that they write as `%`.
const COMMANDS: [&str; 9] = [
    "advise cornell --size 48x36 --seconds 1000",
    "explain moving --technique restir-di --frames 12 --size 64x48 --pixel 3,4",
    "explain cornell --technique restir-pt --frames 3 --size 64x48 --pixel 3,4",
    "info statue",
    "info %image.exr",
    "compare %image.exr %image.exr",
    "reference cornell --size 64x48 --spp 1000000 --cache %cache",
    "export tower %tower.glb",
    "render cornell --size 64x48 --spp 1000000 -o %new.exr --png %new.png",
];

/// The commands that a device does something for, by their beginnings.
#[cfg(feature = "gpu")]
const ON_A_DEVICE: [&str; 4] = ["advise", "explain", "reference", "render"];

/// It ends as interrupted or by itself, with at most one error, and with nothing half done.
fn judge(outcome: &Outcome, outputs: &[String]) -> Result<(), String> {
    let errors = outcome.stderr.lines().filter(|line| line.starts_with("error:")).count();
    let said = outcome.stderr.lines().last().unwrap_or_default();
    match outcome.code {
        Some(130) if errors == 1 => (),
        Some(0) if errors == 0 => (),
        // before it listens
        None if outcome.stdout.is_empty() && outcome.stderr.is_empty() => (),
        code => return Err(format!("{code:?}, {errors} errors: {said}")),
    }
    let is_whole = |name: &String| name == "image.exr" || name == "cache" || outcome.code == Some(0);
    outputs.iter().find(|name| !is_whole(name)).map_or(Ok(()), |name| Err(format!("{name} is left")))
}

#[test]
#[cfg_attr(first_tier, ignore = "left to `cargo test --release`")]
fn every_command_can_be_interrupted_at_any_moment() {
    let mut interrupted = 0;
    for asked in COMMANDS {
        let renders = !["info", "compare", "export"].iter().any(|name| asked.starts_with(name));
        let more = if renders { &["--device", "cpu", "--threads", "1"][..] } else { &[] };
        interrupted += (0..40).step_by(3).filter(|&delay| is_interrupted(asked, more, delay)).count();
    }
    assert!(interrupted > 60, "only {interrupted} were interrupted");
}

/// On a device: before its adapter is there, while kernels are compiled, and during dispatches.
#[cfg(feature = "gpu")]
#[test]
#[cfg_attr(first_tier, ignore = "left to `cargo test --release`")]
fn commands_on_a_device_can_be_interrupted_at_any_moment() {
    if !crate::adapter::adapter_is_there() {
        return;
    }
    let delays = [5, 100, 301, 500, 801, 1400];
    let [mut interrupted, mut all] = [0; 2];
    for asked in COMMANDS.iter().filter(|asked| ON_A_DEVICE.iter().any(|name| asked.starts_with(name))) {
        all += delays.len();
        interrupted += delays.iter().filter(|&&delay| is_interrupted(asked, &["--device", "gpu"], delay)).count();
    }
    assert!(2 * interrupted > all, "only {interrupted} of {all} were interrupted");
}

/// Starts a command, sends it a signal after `delay` milliseconds and again every second until it ends, and looks at what it leaves; whether
/// the signal was before its end.
fn is_interrupted(asked: &str, more: &[&str], delay: u64) -> bool {
    let workplace = Workplace::new();
    workplace.picture("image.exr", "cornell", &["--size", "4x3", "--spp", "1"]);
    let named = asked.split(' ').map(|word| word.strip_prefix('%').map_or(word.to_owned(), |n| workplace.output(n)));
    let mut command = program(named);
    // without it a library for windows writes a line of its own
    command.env("XDG_RUNTIME_DIR", workplace.output(""));
    let mut child = command.args(more).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    std::thread::sleep(Duration::from_millis(delay));
    // what runs in the background may have been started with -INT ignored, and loses it until it listens
    let signal = if delay.is_multiple_of(2) { "-TERM" } else { "-INT" };
    let mut sent = 0;
    while child.try_wait().unwrap().is_none() {
        // the second request, too
        if sent % 100 == 0 {
            Command::new("kill").args([signal, &child.id().to_string()]).stderr(Stdio::null()).status().unwrap();
        }
        sent += 1;
        assert!(sent < 6000, "{asked} does not end");
        std::thread::sleep(Duration::from_millis(10));
    }
    let output = child.wait_with_output().unwrap();
    let [stdout, stderr] = [output.stdout, output.stderr].map(|text| String::from_utf8(text).unwrap());
    let outcome = Outcome { code: output.status.code(), stdout, stderr };
    judge(&outcome, &workplace.outputs()).unwrap_or_else(|fault| panic!("{asked} after {delay} ms: {fault}"));
    for file in whole_or_none(&workplace.output("cache")) {
        restir::image::read_exr(&file).unwrap();
    }
    outcome.code != Some(0)
}

/// The files of a cache, none of whose folders is empty.
fn whole_or_none(cache: &str) -> Vec<std::path::PathBuf> {
    let listed =
        |folder: &std::path::Path| std::fs::read_dir(folder).into_iter().flatten().map(|entry| entry.unwrap().path());
    let folders: Vec<_> = listed(cache.as_ref()).collect();
    assert!(folders.len() <= 1 && folders.iter().all(|folder| listed(folder).next().is_some()), "an empty folder");
    folders.iter().flat_map(|folder| listed(folder).collect::<Vec<_>>()).collect()
}
