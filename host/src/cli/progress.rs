//! How far a render is: a bar on a terminal, else a line about every ten percent.

use std::io::{IsTerminal, stderr};
use std::time::Instant;

use indicatif::{ProgressBar, ProgressStyle};

use super::console;
use crate::render::Progress;

const BAR: &str = "{bar:40} {percent:>3} %, {eta} left";
const STEP_PERCENT: u64 = 10;

pub(super) enum Reporter {
    Bar(ProgressBar),
    /// The first update prints a line, too: it shows that the work has begun.
    Lines {
        start: Instant,
        next_percent: u64,
    },
}

impl Reporter {
    pub(super) fn new() -> Self {
        if stderr().is_terminal() {
            let style = ProgressStyle::with_template(BAR).unwrap_or_else(|_| ProgressStyle::default_bar());
            return Self::Bar(ProgressBar::new(1).with_style(style));
        }
        console::note("rendering: 0 %");
        Self::Lines { start: Instant::now(), next_percent: STEP_PERCENT }
    }

    pub(super) fn update(&mut self, progress: &Progress) {
        match self {
            Self::Bar(bar) => {
                bar.set_length(progress.total);
                bar.set_position(progress.done);
            }
            Self::Lines { start, next_percent } => {
                let percent = percent(progress);
                if percent >= *next_percent {
                    let left = seconds_left(start.elapsed().as_secs_f64(), progress);
                    console::note(&format!("rendering: {percent} %, {left:.0} s left"));
                    *next_percent = (percent / STEP_PERCENT + 1) * STEP_PERCENT;
                }
            }
        }
    }

    pub(super) fn finish(self) {
        if let Self::Bar(bar) = self {
            bar.finish_and_clear();
        }
    }
}

fn percent(progress: &Progress) -> u64 {
    progress.done.saturating_mul(100).checked_div(progress.total).unwrap_or(100)
}

fn seconds_left(elapsed: f64, progress: &Progress) -> f64 {
    elapsed * progress.total.saturating_sub(progress.done) as f64 / progress.done.max(1) as f64
}
