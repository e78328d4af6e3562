//! How far a render is: a bar on a terminal, else a line about every ten percent, and one every five seconds where these take long.

use std::io::{IsTerminal, stderr};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressStyle};
use restir::Error;
use restir::render::Progress;

use super::{console, interrupt};

const BAR: &str = "{bar:40} {percent:>3} %, {eta} left";
const STEP_PERCENT: u64 = 10;

/// After so long without a word a user wonders.
const A_WHILE: Duration = Duration::from_secs(5);
/// How often is looked whether it is so long.
const MOMENT: Duration = Duration::from_secs(1);

/// Does work that cannot say how far it is: how long it takes is said as long as it takes long.
pub fn patiently<T>(what: &str, work: impl FnOnce() -> T) -> T {
    let start = Instant::now();
    let tell = || console::note(&format!("{what}: {:.0} s", start.elapsed().as_secs_f64()));
    telling(A_WHILE, &tell, work)
}

/// Does work, and calls `tell` again and again; it does not, where no thread can be started for that.
fn telling<T>(every: Duration, tell: &(dyn Fn() + Sync), work: impl FnOnce() -> T) -> T {
    let (working, done) = channel::<()>();
    std::thread::scope(|scope| {
        let teller = move || {
            while done.recv_timeout(every) == Err(RecvTimeoutError::Timeout) {
                tell();
            }
        };
        let _ = std::thread::Builder::new().spawn_scoped(scope, teller);
        // gone with the work, also where it panics
        let _working = working;
        work()
    })
}

/// Does work that says how far it is, and ends it when the user wants the program to stop. Lines begin with `what`.
pub fn reported<T>(what: &'static str, work: impl FnOnce(&mut dyn FnMut(Progress) -> Result<(), Error>) -> T) -> T {
    let reporter = Reporter::new(what);
    let observe = &mut |progress| {
        reporter.update(progress);
        interrupt::check()
    };
    let heard = || {
        // once this is read, a signal is heard
        reporter.begin();
        work(observe)
    };
    let done = telling(MOMENT, &|| reporter.remind(), || interrupt::listening(heard));
    reporter.finish();
    done
}

enum Reporter {
    Bar(ProgressBar),
    Lines(Mutex<Lines>),
}

/// What lines tell.
struct Lines {
    what: &'static str,
    /// When what was first told of had been done, and how much that was: a reference that is continued has begun before.
    begun: Option<(Instant, u64)>,
    last: Progress,
    next_percent: u64,
    /// When the last line was written.
    said: Instant,
}

impl Reporter {
    fn new(what: &'static str) -> Self {
        if stderr().is_terminal() {
            let style = ProgressStyle::with_template(BAR).unwrap_or_else(|_| ProgressStyle::default_bar());
            return Self::Bar(ProgressBar::new(1).with_style(style));
        }
        let last = Progress { done: 0, total: 1 };
        Self::Lines(Mutex::new(Lines { what, begun: None, last, next_percent: STEP_PERCENT, said: Instant::now() }))
    }

    fn begin(&self) {
        if let Self::Lines(lines) = self {
            lines.lock().unwrap_or_else(PoisonError::into_inner).say();
        }
    }

    fn update(&self, progress: Progress) {
        match self {
            Self::Bar(bar) => {
                bar.set_length(progress.total);
                bar.set_position(progress.done);
            }
            Self::Lines(lines) => lines.lock().unwrap_or_else(PoisonError::into_inner).update(progress),
        }
    }

    /// Work that does not get on is not silent.
    fn remind(&self) {
        if let Self::Lines(lines) = self {
            let mut lines = lines.lock().unwrap_or_else(PoisonError::into_inner);
            if lines.said.elapsed() >= A_WHILE {
                lines.say();
            }
        }
    }

    fn finish(self) {
        if let Self::Bar(bar) = self {
            bar.finish_and_clear();
        }
    }
}

impl Lines {
    fn update(&mut self, progress: Progress) {
        self.begun.get_or_insert_with(|| (Instant::now(), progress.done));
        self.last = progress;
        if percent(&progress) >= self.next_percent {
            self.say();
        }
    }

    fn say(&mut self) {
        let Self { what, begun, last, .. } = self;
        let percent = percent(last);
        let left = begun.and_then(|(start, before)| seconds_left(start.elapsed().as_secs_f64(), last, before));
        let left = left.map_or_else(String::new, |left| format!(", {left:.0} s left"));
        console::note(&format!("{what}: {percent} %{left}"));
        self.next_percent = (percent / STEP_PERCENT + 1) * STEP_PERCENT;
        self.said = Instant::now();
    }
}

fn percent(progress: &Progress) -> u64 {
    progress.done.saturating_mul(100).checked_div(progress.total).unwrap_or(100)
}

/// None while nothing has been done beyond what was `before`.
fn seconds_left(elapsed: f64, progress: &Progress, before: u64) -> Option<f64> {
    let done = progress.done.saturating_sub(before);
    (done > 0).then(|| elapsed * progress.total.saturating_sub(progress.done) as f64 / done as f64)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn work_that_takes_long_is_told_and_other_is_not() {
        let told = Mutex::new(0);
        let tell = || *told.lock().expect("a number") += 1;
        let every = Duration::from_millis(20);
        assert_eq!(telling(Duration::from_secs(3600), &tell, || 7), 7);
        assert_eq!(*told.lock().expect("a number"), 0);
        telling(every, &tell, || std::thread::sleep(10 * every));
        assert!(*told.lock().expect("a number") >= 2);
    }

    /// A line comes with every tenth of the work, and after a while without one.
    #[test]
    fn lines_come_in_time() {
        let lines = |seconds_ago: u64| {
            let said =
                Instant::now().checked_sub(Duration::from_secs(seconds_ago)).expect("the machine runs that long");
            let last = Progress { done: 0, total: 100 };
            Lines { what: "test", begun: None, last, next_percent: STEP_PERCENT, said }
        };
        let mut fast = lines(0);
        fast.update(Progress { done: 9, total: 100 });
        assert_eq!(fast.next_percent, 10);
        fast.update(Progress { done: 25, total: 100 });
        assert_eq!(fast.next_percent, 30);
        let is_reminded = |seconds_ago| {
            let reporter = Reporter::Lines(Mutex::new(lines(seconds_ago)));
            reporter.remind();
            let Reporter::Lines(lines) = reporter else { unreachable!("made above") };
            lines.into_inner().expect("no panic").said.elapsed() < Duration::from_secs(1)
        };
        assert!(is_reminded(6) && !is_reminded(3));
    }
}
