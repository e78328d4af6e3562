//! ReSTIR SSS: what no preset has, and the scenes in which it is compared with path tracing.

use super::{Cases, Known, Matrix, NOTHING, Row, row};

/// See [`Known`].
pub(super) const KNOWN: Known = Known {
    rows: &[
        ("single scattering traced, two passes, defensive, jitter", "traced=single,spatial=2,mis=pairwise-defensive,jitter=on"),
        ("one crossing of three segments", "crossings=one,segments=3,radius_channel=albedo,shading=selected"),
        ("delayed, no feedback", "shift=delayed,feedback=off,neighbours=2,temporal_mis=pairwise-defensive"),
    ],
    cases: Cases { rows: &ROWS, ..NOTHING.cases },
    matrix: Matrix {
        scenes: &[("slab", ""), ("candles", "")],
        goals: &[("candles", 4.0)],
        common: "",
        cells: || CELLS.map(str::to_owned).to_vec(),
        ..NOTHING.matrix
    },
    ..NOTHING
};

/// Every shift, sharing alone and with time, and the hybrid whose profile part reuses.
const CELLS: [&str; 6] = [
    "shift=reconnection,temporal=off",
    "shift=delayed,spatial=0",
    "shift=hybrid",
    "shift=hybrid,feedback=off,mis=pairwise-defensive",
    "shift=sequential,spatial=2,neighbours=4",
    "shift=hybrid,traced=single",
];

/// Every shift, kind of light and of surface.
const ROWS: [Row; 10] = [
    row("hybrid", "slab", 3, ""),
    row("reconnection, lights in wax, milk", "candles", 3, "shift=reconnection,spatial=2"),
    row("delayed, lights in wax, milk", "candles", 2, "shift=delayed,feedback=off,max_depth=6"),
    row("things move, textures", "moving-media", 5, "traced=single,jitter=on,max_depth=5"),
    row("things move, delayed", "moving-media", 4, "shift=delayed,lambert_below=0.2,sampler=independent"),
    row("one crossing, published support", "slab", 2, "crossings=one,support=published,segments=2,shading=selected"),
    row("signed profiles", "slab", 2, "traced=single,profile=searchlight,radius_channel=albedo"),
    row("clamped profiles", "candles", 2, "traced=single,profile=clamped,mis=pairwise-counted-defensive"),
    row("sequential", "candles", 3, "shift=sequential,spatial=2,neighbours=3"),
    row("no bodies", "cornell", 2, ""),
];
