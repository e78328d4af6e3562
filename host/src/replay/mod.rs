//! Native replay: any plan over any scene, among them one that writes down what it is asked.

mod recording;
mod two_frames;

pub use recording::{Counts, Event, Recording};
pub(crate) use two_frames::TwoFrames;

use crate::Error;
use crate::exec::{CpuExecutor, Step, shown};
use crate::plan::FramePlan;
use restir_shared::scene::AnyFrames;

/// Runs a plan natively over a scene of any type, instead of the one in the plan's arenas: one that counts what it is
/// asked, writes it down, or answers differently. `show` sees each pass when it is done, and may end the work with an error.
///
/// # Errors
/// As of [`CpuExecutor::run_over`] and of `show`.
pub fn run(
    frames: &dyn AnyFrames,
    plan: FramePlan<'_>,
    show: &mut dyn FnMut(&Step<'_>) -> Result<(), Error>,
) -> Result<(), Error> {
    shown(|observe| CpuExecutor::run_over(frames, plan, observe).map(drop), show)
}
