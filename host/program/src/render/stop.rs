//! When a render stops, other than by its number of samples or frames.

use std::time::Duration;

use restir::Error;

use super::super::parse::{number, require};
use super::super::scrambles::{FEWEST, Until};

/// The longest time, in seconds: some thirty years.
const MOST_SECONDS: f64 = 1.0e9;

/// The image is then the mean of renders with the seeds from --seed on.
#[derive(clap::Args)]
pub(super) struct Stop {
    /// Render independent passes (at least 8) until the time is over, and write their mean. --spp or --frames is then
    /// the length of each pass; if not given, --spp suits the time. On Ctrl-C nothing is written.
    #[arg(long, value_name = "SECONDS", conflicts_with_all = ["layers", "resume"], value_parser = number::<f64>, allow_hyphen_values = true)]
    pub(super) seconds: Option<f64>,
    /// Render independent passes (at least 8) until the estimated RMS error is this fraction of the mean, as in 0.01,
    /// and write their mean.
    #[arg(long, value_name = "ERROR", conflicts_with_all = ["layers", "resume"], value_parser = number::<f64>, allow_hyphen_values = true)]
    pub(super) noise: Option<f64>,
}

impl Stop {
    /// Whether anything was asked for.
    pub(super) fn is_asked(&self) -> bool {
        self.seconds.is_some() || self.noise.is_some()
    }

    pub(super) fn check(&self) -> Result<(), Error> {
        let seconds = self.seconds.unwrap_or(1.0);
        let problem = format_args!("--seconds {seconds} is out of range; give more than 0, up to {MOST_SECONDS}");
        require(seconds > 0.0 && seconds <= MOST_SECONDS, problem)?;
        let noise = self.noise.unwrap_or(1.0);
        let problem = format_args!("--noise {noise} is out of range; give a positive number, as in 0.01 for 1 %");
        require(noise > 0.0 && noise.is_finite(), problem)
    }

    /// As the library has it.
    pub(super) fn until(&self) -> Until {
        debug_assert_eq!(FEWEST, 8, "the help says so");
        Until { time: self.seconds.map(Duration::from_secs_f64), noise: self.noise }
    }
}
