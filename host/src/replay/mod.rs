//! Native replay: any plan over any scene, among them one that writes down what it is asked.

mod asked;
mod recording;
mod two_frames;

pub use asked::{Asked, asked, asked_after};
pub use recording::{Counts, Event, Recording};
pub(crate) use two_frames::TwoFrames;
