//! Pixels whose supporting prefixes end near each other.

use restir_shared::resample::mutual::ShiftRequest;
use restir_shared::technique::restir_suffix::{PrefixGrid, PrefixPoint, SuffixParams};

kernel! {
    /// Asks for the suffix of the pixel with which each is a pair.
    pub fn suffix_pair(8, 8) {
        constants {}
        params 0: SuffixParams,
        read { 1: points: PrefixPoint, 2: order: u32, 3: starts: u32 },
        own { 4: requests: ShiftRequest },
    }
    |x, y, at, p| requests[at] = PrefixGrid { points, order, starts }.pair(&p, [x, y])
}
