//! Ctrl-C during a render.

use std::io::{BufRead, BufReader, Read};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::time::{Duration, Instant};

use crate::support::{Workplace, program};

/// A child that does not outlive a failing test.
struct Guarded(Child);

impl Drop for Guarded {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

impl Guarded {
    fn wait_for(&mut self, limit: Duration) -> Option<ExitStatus> {
        let start = Instant::now();
        let mut status = None;
        while status.is_none() && start.elapsed() < limit {
            std::thread::sleep(Duration::from_millis(10));
            status = self.0.try_wait().unwrap();
        }
        status
    }
}

/// Starts the program, sends it a signal once it renders, and expects it to end as interrupted.
fn interrupt(command: &mut Command, signal: &str) -> String {
    interrupt_at("rendering:", command, signal)
}

/// As [`interrupt`], after a line that begins in this way.
fn interrupt_at(begin: &str, command: &mut Command, signal: &str) -> String {
    let mut child = Guarded(command.stderr(Stdio::piped()).stdout(Stdio::null()).spawn().unwrap());
    let mut stderr = BufReader::new(child.0.stderr.take().unwrap());
    let mut line = String::new();
    while !line.starts_with(begin) {
        line.clear();
        assert_ne!(stderr.read_line(&mut line).unwrap(), 0, "it ended before");
    }
    let sent = Command::new("kill").args([signal, &child.0.id().to_string()]).status().unwrap();
    assert!(sent.success());
    let status = child.wait_for(Duration::from_secs(60)).expect("it did not stop within a minute");
    let mut rest = String::new();
    stderr.read_to_string(&mut rest).unwrap();
    assert_eq!(status.code(), Some(130), "{rest}");
    assert_eq!(rest.lines().filter(|line| line.starts_with("error:")).count(), 1, "{rest}");
    assert!(!rest.contains("panicked"), "{rest}");
    rest
}

#[test]
fn an_interrupted_render_leaves_no_file() {
    for signal in ["-INT", "-TERM"] {
        let workplace = Workplace::new();
        let more = ["--png", &workplace.output("image.png"), "--size", "32x32", "--spp", "100000000"];
        interrupt(&mut workplace.render("image.exr", "cornell", &more), signal);
        assert_eq!(workplace.outputs(), [""; 0]);
    }
}

#[test]
fn an_interrupted_benchmark_leaves_no_file() {
    let (workplace, cache) = (Workplace::new(), tempfile::tempdir().unwrap());
    let mut command = program(["bench", "cornell", "--device", "cpu", "--seconds", "1000000"]);
    command.args(["--size", "16x16", "--reference-spp", "100000000"]).arg("--cache").arg(cache.path());
    let said = interrupt(command.args(["--out", &workplace.output("")]), "-INT");
    assert!(said.contains("kept in"), "{said}");
    assert_eq!(workplace.outputs(), [""; 0]);
}

/// Two million triangles take seconds to build, and the first signal ends that.
#[test]
fn a_scene_that_is_built_can_be_interrupted() {
    let workplace = Workplace::new();
    let mut command = workplace.render("image.exr", "cornell", &["--subdivide", "8", "--spp", "1"]);
    let said = interrupt_at("building a scene of", &mut command, "-INT");
    assert!(!said.contains("rendering:"), "{said}");
    assert_eq!(workplace.outputs(), [""; 0]);
}
