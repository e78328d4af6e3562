//! How far a render is: a bar on a terminal, else a line about every ten percent.

use std::io::{IsTerminal, stderr};
use std::time::Instant;

use indicatif::{ProgressBar, ProgressStyle};
use restir::Error;
use restir::render::Progress;

use super::{console, interrupt};

const BAR: &str = "{bar:40} {percent:>3} %, {eta} left";
const STEP_PERCENT: u64 = 10;

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
    },
}

impl Reporter {
    fn new(what: &'static str) -> Self {
        if stderr().is_terminal() {
            let style = ProgressStyle::with_template(BAR).unwrap_or_else(|_| ProgressStyle::default_bar());
            return Self::Bar(ProgressBar::new(1).with_style(style));
        }
        console::note(&format!("{what}: 0 %"));
        Self::Lines { what, begun: None, next_percent: STEP_PERCENT }
    }

    fn update(&mut self, progress: &Progress) {
        match self {
            Self::Bar(bar) => {
                bar.set_length(progress.total);
                bar.set_position(progress.done);
            }
            Self::Lines { what, begun, next_percent } => {
                let percent = percent(progress);
                let (start, before) = *begun.get_or_insert_with(|| (Instant::now(), progress.done));
                if percent >= *next_percent {
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
