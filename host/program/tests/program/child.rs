//! Programs that are sent signals. The suite of the laboratory has this file, too.

use std::io::{BufRead, BufReader, Read};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::time::{Duration, Instant};

/// A child that does not outlive a failing test.
pub(crate) struct Guarded(pub(crate) Child);

impl Drop for Guarded {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

impl Guarded {
    pub(crate) fn wait_for(&mut self, limit: Duration) -> Option<ExitStatus> {
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
pub(crate) fn interrupt(command: &mut Command, signal: &str) -> String {
    interrupt_at("rendering:", command, signal)
}

/// As [`interrupt`], after a line that begins in this way.
pub(crate) fn interrupt_at(begin: &str, command: &mut Command, signal: &str) -> String {
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
