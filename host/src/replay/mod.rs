//! What native replays run over ([`CpuExecutor::run_over`](crate::exec::CpuExecutor::run_over)): a scene that writes down what it is
//! asked, and one in two frames.

mod recording;
mod two_frames;

pub use recording::{Counts, Event, Recording};
pub(crate) use two_frames::TwoFrames;
