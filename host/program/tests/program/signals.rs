//! Ctrl-C at any moment of any command.

use std::process::{Command, Stdio};
use std::time::Duration;

use crate::support::{Outcome, Workplace, program};

/// Commands that end by themselves or not, with the files that they write as `%`.
const COMMANDS: [&str; 12] = [
    "advise cornell --size 48x36 --seconds 1000",
    "explain moving --technique restir-di --frames 12 --size 64x48 --pixel 3,4",
    "explain cornell --technique restir-pt --frames 3 --size 64x48 --pixel 3,4",
    "figure tokuyoshi-fig1 --quick --out %figure",
    "figure zhang2025-grid --quick --out %figure",
    "info statue",
    "info %image.exr",
    "compare %image.exr %image.exr",
    "bench cornell --size 64x48 --seconds 1000 --cache %cache --out %bench",
    "reference cornell --size 64x48 --spp 1000000 --cache %cache",
    "export tower %tower.glb",
    "render cornell --size 64x48 --spp 1000000 -o %new.exr --png %new.png",
];

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
fn every_command_can_be_interrupted_at_any_moment() {
    let mut interrupted = 0;
    for asked in COMMANDS {
        for delay in (0..40).step_by(3) {
            let workplace = Workplace::new();
            workplace.picture("image.exr", "cornell", &["--size", "4x3", "--spp", "1"]);
            let named =
                asked.split(' ').map(|word| word.strip_prefix('%').map_or(word.to_owned(), |n| workplace.output(n)));
            let mut command = program(named);
            if !asked.starts_with("info") && !asked.starts_with("compare") && !asked.starts_with("export") {
                command.args(["--device", "cpu", "--threads", "1"]);
            }
            let mut child = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
            std::thread::sleep(Duration::from_millis(delay));
            // what runs in the background may have been started with -INT ignored, and loses it until it listens
            let signal = if delay % 2 == 0 { "-TERM" } else { "-INT" };
            let mut sent = 0;
            while child.try_wait().unwrap().is_none() {
                // the second request, too
                if sent % 100 == 0 {
                    Command::new("kill")
                        .args([signal, &child.id().to_string()])
                        .stderr(Stdio::null())
                        .status()
                        .unwrap();
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
            interrupted += usize::from(outcome.code != Some(0));
        }
    }
    assert!(interrupted > 80, "only {interrupted} were interrupted");
}

/// The files of a cache, none of whose folders is empty.
fn whole_or_none(cache: &str) -> Vec<std::path::PathBuf> {
    let listed =
        |folder: &std::path::Path| std::fs::read_dir(folder).into_iter().flatten().map(|entry| entry.unwrap().path());
    let folders: Vec<_> = listed(cache.as_ref()).collect();
    assert!(folders.len() <= 1 && folders.iter().all(|folder| listed(folder).next().is_some()), "an empty folder");
    folders.iter().flat_map(|folder| listed(folder).collect::<Vec<_>>()).collect()
}
