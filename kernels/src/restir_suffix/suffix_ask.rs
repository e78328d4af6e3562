//! Requests of a gather.

use restir_shared::resample::mutual::ShiftRequest;
use restir_shared::technique::restir_suffix::{self, Nearest, SuffixParams};

kernel! {
    /// Asks for the shifts of one kind that a gather needs.
    pub fn suffix_ask(8, 8) {
        constants {}
        params 0: SuffixParams,
        read { 1: nearest: Nearest },
        own { 2: requests: ShiftRequest },
    }
    |x, y, at, p| requests[at] = restir_suffix::ask(&p, nearest, [x, y])
}
