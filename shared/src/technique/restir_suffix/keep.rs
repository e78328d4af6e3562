//! Supporting prefixes that outlive their frame.
//!
//! A supporting prefix is only where suffixes are found: what the gather makes of them is unbiased wherever that is, as long as no suffix was
//! asked. So it need not be resampled, as the paper has it: a pixel takes over the last frame's prefix of where its surface was seen, and now and
//! then begins a new one. Suffixes of two frames then begin at the same vertex, and nothing has to be shifted.

use super::SuffixParams;
use crate::resample::mutual::ShiftRequest;
use crate::resample::params::Flags;
use crate::rng::{stream, unit};
use crate::shift::PathOrigin;

/// The stream that says which prefixes are kept.
const KEEPS: u32 = stream(6);

/// What a pixel goes on with.
#[derive(Clone, Copy, Debug)]
pub struct Kept {
    /// The end of its supporting prefix.
    pub origin: PathOrigin,
    /// For the suffix of the last frame that begins there; none if the prefix is new.
    pub request: ShiftRequest,
}

/// The supporting prefix of the pixel `at`, which has a `fresh` one: in one of [`SuffixParams::kept_for`] frames that one, else that which `request`
/// finds in the last frame, whose origins are the `others`; in a view that stands still, its own.
#[inline(always)]
pub fn keep(
    params: &SuffixParams,
    request: ShiftRequest,
    fresh: PathOrigin,
    others: &[PathOrigin],
    at: [u32; 2],
) -> Kept {
    let pixel = params.grid().index(at);
    let request = if params.flags.contains(Flags::STILL) { ShiftRequest { sample: pixel, pixel } } else { request };
    let u = unit(params.supporting(at).hash(KEEPS).x);
    if request.exists() & (u * params.kept_for >= 1.0) {
        let kept = others[request.sample as usize];
        if kept.segments() != 0 {
            return Kept { origin: kept, request };
        }
    }
    Kept { origin: fresh, request: ShiftRequest::NONE }
}
