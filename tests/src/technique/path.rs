//! Path tracing: the reference of all others, and so tested against the oracle, and Russian roulette against it.

use super::{Known, Matrix, NOTHING};

/// See [`Known`].
pub(super) const KNOWN: Known = Known {
    matrix: Matrix {
        scenes: &[("cornell", &[]), ("furnace", &[])],
        common: &["max_depth=6", "jitter=on"],
        cells: || ["roulette=off", "roulette=on"].map(str::to_owned).to_vec(),
    },
    ..NOTHING
};
