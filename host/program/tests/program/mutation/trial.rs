//! Running the program on a case, and judging how it ends: with code 0, and all that it was to write, or with code 2, one line of
//! error and nothing written; by a signal with code 130. Never by a panic or an abort, never silent for long, and never with
//! a part of a file.

use std::collections::BTreeMap;
use std::io::Read;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::time::{Duration, Instant};

use restir::image::read_exr_metadata;
use tempfile::TempDir;

use crate::PROGRAM;

/// The program may be silent so long.
const PATIENCE: Duration = Duration::from_secs(10);
/// After so long it is interrupted: it may have been told to go on for ever, as by an error that no picture reaches.
const LONGEST: Duration = Duration::from_secs(60);
/// Addresses that a process may have, in KiB: an allocation beyond them aborts.
const ADDRESSES: u64 = 6_000_000;

/// A command line and the files that it reads.
pub(super) struct Case {
    pub(super) files: Vec<(String, Vec<u8>)>,
    /// The name of the changed one.
    pub(super) file: String,
    pub(super) command: Vec<String>,
    /// When it is sent a signal.
    pub(super) interrupted: Option<Duration>,
}

/// How a case ended.
pub(super) enum End {
    Done,
    Refused,
    Interrupted,
    Fault(String),
}

/// How often each.
#[derive(Default)]
pub(super) struct Tally {
    pub(super) cases: u64,
    pub(super) done: u64,
    pub(super) refused: u64,
    interrupted: u64,
    pub(super) faults: Vec<String>,
    slowest: Duration,
}

impl Tally {
    pub(super) fn add(&mut self, (end, time): (End, Duration)) {
        self.cases += 1;
        self.slowest = self.slowest.max(time);
        match end {
            End::Done => self.done += 1,
            End::Refused => self.refused += 1,
            End::Interrupted => self.interrupted += 1,
            End::Fault(fault) => self.faults.push(fault),
        }
    }

    pub(super) fn merge(&mut self, other: Self) {
        self.cases += other.cases;
        self.done += other.done;
        self.refused += other.refused;
        self.interrupted += other.interrupted;
        self.faults.extend(other.faults);
        self.slowest = self.slowest.max(other.slowest);
    }

    pub(super) fn summary(&self) -> String {
        let Self { cases, done, refused, interrupted, faults, slowest } = self;
        format!(
            "{cases} cases: {done} done, {refused} refused, {interrupted} interrupted, {} faults; the longest took {:.1} s",
            faults.len(),
            slowest.as_secs_f64()
        )
    }
}

/// Folders for the files of one case after another.
pub(super) struct Place {
    folder: TempDir,
}

impl Place {
    pub(super) fn new() -> Self {
        Self { folder: tempfile::tempdir().unwrap() }
    }

    fn cleared(&self, name: &str) -> PathBuf {
        let folder = self.folder.path().join(name);
        std::fs::remove_dir_all(&folder).ok();
        std::fs::create_dir(&folder).unwrap();
        folder
    }

    /// Runs the case, and keeps its files if something is wrong.
    pub(super) fn run(&self, case: u64, of: Case) -> (End, Duration) {
        let [inputs, outputs] = ["in", "out"].map(|name| self.cleared(name));
        for (name, bytes) in &of.files {
            let path = inputs.join(name);
            std::fs::create_dir_all(path.parent().unwrap()).unwrap();
            std::fs::write(path, bytes).unwrap();
        }
        let before = listed(&inputs);
        let start = Instant::now();
        let ran = of.run(&inputs, &outputs);
        let time = start.elapsed();
        let end = judged(&of, ran, &outputs).unwrap_or_else(|fault| {
            let kept = kept(case, &inputs);
            End::Fault(format!("case {case}: {fault}\n  of {:?}, with files in {kept}", of.command))
        });
        let left: Vec<_> = listed(&inputs).into_iter().filter(|name| !before.contains(name)).collect();
        let is_part = |name: &PathBuf| name.to_string_lossy().contains(".tmp");
        match left.iter().find(|name| is_part(name)) {
            Some(name) => (End::Fault(format!("case {case}: {} is left of {:?}", name.display(), of.command)), time),
            None => (end, time),
        }
    }
}

/// Copies the inputs of a case to where they stay, if `RESTIR_MUTATION_KEEP` names a folder.
fn kept(case: u64, inputs: &Path) -> String {
    let Some(folder) = std::env::var_os("RESTIR_MUTATION_KEEP") else { return "RESTIR_MUTATION_KEEP".to_owned() };
    let folder = Path::new(&folder).join(case.to_string());
    std::fs::create_dir_all(&folder).unwrap();
    for file in listed(inputs).into_iter().filter(|file| inputs.join(file).is_file()) {
        std::fs::copy(inputs.join(&file), folder.join(file.file_name().unwrap())).unwrap();
    }
    folder.display().to_string()
}

/// All files below a folder, and folders that are empty.
fn listed(folder: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for entry in std::fs::read_dir(folder).unwrap() {
        let entry = entry.unwrap();
        let name = PathBuf::from(entry.file_name());
        let is_folder = entry.file_type().unwrap().is_dir();
        let below = if is_folder { listed(&entry.path()) } else { Vec::new() };
        match below.is_empty() {
            true => found.push(name),
            false => found.extend(below.into_iter().map(|below| name.join(below))),
        }
    }
    found
}

/// What a run left behind.
struct Ran {
    code: Option<i32>,
    text: String,
    /// It was silent for too long.
    hangs: bool,
    /// It was told to end.
    interrupted: bool,
}

impl Case {
    fn run(&self, inputs: &Path, outputs: &Path) -> Ran {
        let named = |argument: &String| match argument.split_at_checked(1) {
            Some(("@", "")) => inputs.join(&self.file).into_os_string(),
            Some(("%", name)) => outputs.join(name).into_os_string(),
            Some(("$", name)) => inputs.join(name).into_os_string(),
            _ => argument.into(),
        };
        let limited = format!("ulimit -v {ADDRESSES}; exec \"$0\" \"$@\"");
        let mut command = Command::new("sh");
        command.args(["-c", &limited, PROGRAM]).args(self.command.iter().map(named)).stdin(Stdio::null());
        command.current_dir(outputs).env("RESTIR_CACHE", inputs.join("cache"));
        let (mut reader, writer) = std::io::pipe().unwrap();
        let mut child = command.stdout(writer.try_clone().unwrap()).stderr(writer).spawn().unwrap();
        // it holds the other ends
        drop(command);
        let (sender, receiver) = channel();
        let listening = std::thread::spawn(move || {
            let mut part = [0; 4096];
            while let Ok(length @ 1..) = reader.read(&mut part) {
                sender.send(part[..length].to_vec()).ok();
            }
        });
        let interrupt = |child: &Child| {
            Command::new("kill").args(["-INT", &child.id().to_string()]).stderr(Stdio::null()).status().unwrap()
        };
        let start = Instant::now();
        if let Some(wait) = self.interrupted {
            std::thread::sleep(wait);
            interrupt(&child);
        }
        let mut heard = Vec::new();
        let mut interrupted = self.interrupted.is_some();
        let hangs = loop {
            if !interrupted && start.elapsed() > LONGEST {
                interrupt(&child);
                interrupted = true;
            }
            match receiver.recv_timeout(PATIENCE) {
                Ok(part) => heard.extend(part),
                Err(RecvTimeoutError::Disconnected) => break false,
                Err(RecvTimeoutError::Timeout) => {
                    child.kill().unwrap();
                    break true;
                }
            }
        };
        let status = child.wait().unwrap();
        listening.join().unwrap();
        Ran { code: status.code(), text: String::from_utf8_lossy(&heard).into_owned(), hangs, interrupted }
    }
}

/// Whether all is as it should be, or what is not.
fn judged(case: &Case, ran: Ran, outputs: &Path) -> Result<End, String> {
    let Ran { code, text, hangs, interrupted } = ran;
    let last = text.lines().last().unwrap_or_default().to_owned();
    let fault = |what: &str| Err(format!("{what}: {last}"));
    let names = listed(outputs);
    let errors = text.lines().filter(|line| line.starts_with("error:")).count();
    if hangs {
        return fault("it was silent for 10 s");
    }
    if text.contains("panicked") {
        return Err(text.lines().skip_while(|line| !line.contains("panicked")).take(2).collect::<Vec<_>>().join(" "));
    }
    if text.chars().any(|c| c.is_control() && c != '\n' && c != '\t' || "\u{202e}\u{61c}".contains(c)) {
        return fault("it printed what a terminal takes for more than text");
    }
    if let Some(name) = names.iter().find(|name| name.to_string_lossy().contains(".tmp")) {
        return Err(format!("{} is left", name.display()));
    }
    for name in names.iter().filter(|name| name.extension().is_some_and(|ending| ending == "exr")) {
        read_exr_metadata(&outputs.join(name)).map_err(|error| format!("a part of a file: {error}"))?;
    }
    let clean = names.is_empty() || keeps_files(case);
    match code {
        Some(0) if errors == 0 => Ok(End::Done),
        Some(2) if errors == 1 && clean => Ok(End::Refused),
        Some(130) if interrupted && errors == 1 && clean => Ok(End::Interrupted),
        // before it listens
        None if interrupted && text.is_empty() && names.is_empty() => Ok(End::Interrupted),
        code => Err(format!("it ended with {code:?}, {errors} errors and {names:?}: {last}")),
    }
}

/// Commands that write several files, or go on with them, may have written some of them before one is refused.
fn keeps_files(case: &Case) -> bool {
    let kinds: BTreeMap<&str, &[&str]> =
        BTreeMap::from([("render", ["--frames", "--turntable", "--resume"].as_slice()), ("reference", &["--cache"])]);
    let of = kinds.iter().filter(|(command, _)| case.command.iter().any(|argument| argument == *command));
    of.flat_map(|(_, options)| options.iter()).any(|option| case.command.iter().any(|argument| argument == option))
}

/// What is wrong is seen: each of these ends is a fault, and none of those beside it.
#[test]
fn faults_are_seen() {
    let case = |command: &str, interrupted: bool| Case {
        files: Vec::new(),
        file: String::new(),
        command: command.split(' ').map(str::to_owned).collect(),
        interrupted: interrupted.then_some(Duration::ZERO),
    };
    let render = "render cornell -o %a.exr";
    let ends = |case: &Case, code: Option<i32>, text: &str, hangs: bool, file: &str| {
        let folder = tempfile::tempdir().unwrap();
        if file.ends_with('/') {
            std::fs::create_dir(folder.path().join(file)).unwrap();
        } else if !file.is_empty() {
            std::fs::write(folder.path().join(file), "text").unwrap();
        }
        judged(case, Ran { code, text: text.to_owned(), hangs, interrupted: case.interrupted.is_some() }, folder.path())
            .is_ok()
    };
    let usual = case(render, false);
    let error = "warning: something\nerror: no such file\n";
    assert!(ends(&usual, Some(0), "wrote it\n", false, "") && ends(&usual, Some(2), error, false, ""));
    assert!(!ends(&usual, Some(0), "wrote it\n", true, ""), "a hang");
    assert!(!ends(&usual, Some(0), "wrote it\n", false, ".restir-1.tmp"), "a temporary file");
    assert!(!ends(&usual, Some(0), "wrote it\n", false, "a.exr"), "a part of a file");
    assert!(!ends(&usual, Some(2), error, false, "a.png"), "a file in spite of an error");
    assert!(!ends(&usual, Some(2), error, false, "a/"), "a folder in spite of an error");
    assert!(!ends(&usual, Some(2), "", false, ""), "an error without a word");
    assert!(!ends(&usual, Some(2), &error.repeat(2), false, ""), "two errors");
    assert!(!ends(&usual, Some(2), "error: \u{1b}[2J\n", false, ""), "control characters");
    assert!(!ends(&usual, Some(101), "thread 'main' panicked at src", false, ""), "a panic");
    assert!(!ends(&usual, None, "", false, ""), "an abort");
    assert!(!ends(&usual, Some(130), "error: interrupted\n", false, ""), "an interruption that was not");
    let interrupted = case(render, true);
    assert!(
        ends(&interrupted, Some(130), "error: interrupted\n", false, "") && ends(&interrupted, None, "", false, "")
    );
    assert!(!ends(&interrupted, Some(130), "error: interrupted\n", false, "a.png"), "a file of an interrupted render");
    assert!(ends(&case("render --frames 1..2", false), Some(2), error, false, "a.png"), "an earlier frame");
}
