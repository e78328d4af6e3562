//! How far a render is: a bar on a terminal, else a line about every ten percent, and one every five seconds where these take long.

use std::io::{IsTerminal, stderr};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressStyle};
use restir::Error;
use restir::render::Progress;

use super::{console, interrupt};

const BAR: &str = "{bar:40} {percent:>3} %, {eta} left";
const STEP_PERCENT: u64 = 10;

/// After so long without a word a user wonders.
const A_WHILE: Duration = Duration::from_secs(5);

/// Does work that cannot say how far it is: how long it takes is said as long as it takes long.
pub(super) fn patiently<T>(what: &str, work: impl FnOnce() -> T) -> T {
    telling(A_WHILE, &|text| console::note(&format!("{what}: {text}")), work)
}

/// Does work, and tells its time again and again.
fn telling<T>(every: Duration, tell: &(dyn Fn(&str) + Sync), work: impl FnOnce() -> T) -> T {
    let (working, done) = channel::<()>();
    std::thread::scope(|scope| {
        scope.spawn(move || {
            let start = Instant::now();
            while done.recv_timeout(every) == Err(RecvTimeoutError::Timeout) {
                tell(&format!("{:.0} s", start.elapsed().as_secs_f64()));
            }
        });
        // gone with the work, also where it panics
        let _working = working;
        work()
    })
}

/// Does work that says how far it is, and ends it when the user wants the program to stop. Lines begin with `what`.
pub(super) fn reported<T>(
    what: &'static str,
    work: impl FnOnce(&mut dyn FnMut(Progress) -> Result<(), Error>) -> T,
) -> T {
    interrupt::begin_listening();
    let mut reporter = Reporter::new(what);
    let done = work(&mut |progress| {
        reporter.update(&progress);
        interrupt::check()
    });
    reporter.finish();
    done
}

enum Reporter {
    Bar(ProgressBar),
    /// When what was first told of had been done, and how much that was: a reference that is continued has begun before.
    Lines {
        what: &'static str,
        begun: Option<(Instant, u64)>,
        next_percent: u64,
        /// When the last line was written.
        said: Instant,
    },
}

impl Reporter {
    fn new(what: &'static str) -> Self {
        if stderr().is_terminal() {
            let style = ProgressStyle::with_template(BAR).unwrap_or_else(|_| ProgressStyle::default_bar());
            return Self::Bar(ProgressBar::new(1).with_style(style));
        }
        console::note(&format!("{what}: 0 %"));
        Self::Lines { what, begun: None, next_percent: STEP_PERCENT, said: Instant::now() }
    }

    fn update(&mut self, progress: &Progress) {
        match self {
            Self::Bar(bar) => {
                bar.set_length(progress.total);
                bar.set_position(progress.done);
            }
            Self::Lines { what, begun, next_percent, said } => {
                let percent = percent(progress);
                let (start, before) = *begun.get_or_insert_with(|| (Instant::now(), progress.done));
                if percent >= *next_percent || said.elapsed() >= A_WHILE {
                    *said = Instant::now();
                    let left = seconds_left(start.elapsed().as_secs_f64(), progress, before);
                    let left = left.map_or_else(String::new, |left| format!(", {left:.0} s left"));
                    console::note(&format!("{what}: {percent} %{left}"));
                    *next_percent = (percent / STEP_PERCENT + 1) * STEP_PERCENT;
                }
            }
        }
    }

    fn finish(self) {
        if let Self::Bar(bar) = self {
            bar.finish_and_clear();
        }
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
    use std::sync::Mutex;

    #[test]
    fn work_that_takes_long_is_told_and_other_is_not() {
        let told = Mutex::new(0);
        let tell = |_: &str| *told.lock().expect("a number") += 1;
        let every = Duration::from_millis(20);
        assert_eq!(telling(Duration::from_secs(3600), &tell, || 7), 7);
        assert_eq!(*told.lock().expect("a number"), 0);
        telling(every, &tell, || std::thread::sleep(10 * every));
        assert!(*told.lock().expect("a number") >= 2);
    }
}
