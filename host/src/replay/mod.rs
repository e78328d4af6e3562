//! Native replay: any plan over any scene, among them one that writes down what it is asked.

mod asked;
mod frames;
mod recording;
mod still;
mod two_frames;

pub use asked::{Asked, asked, asked_after};
pub use frames::Frames;
pub use recording::{Counts, Event, Recording};
pub use still::Still;
pub(crate) use two_frames::TwoFrames;
