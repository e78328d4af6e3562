//! Suffix ReSTIR: what no preset has.

use super::{Cases, Known, Matrix, NOTHING, Row, row};

/// See [`Known`].
pub(super) const KNOWN: Known = Known {
    lengths: &["min_distance"],
    rows: &[
        ("a canonical suffix each, four borrowed, jitter", "canonical=1,borrowed=4,prefixes=2,jitter=on"),
        ("prefixes of one segment", "min_segments=1,borrowed=1,spatial=0"),
        ("direct light by restir-di", "direct=restir-di,prefixes=2"),
    ],
    cases: Cases { common: "prefixes=2,max_depth=6", rows: &ROWS, ..NOTHING.cases },
    matrix: Matrix {
        scenes: &[("cornell", ""), ("tower", ""), ("glass", ""), ("glossy", ""), ("ajar", ""), ("moving", "jitter=on")],
        goals: &[("ajar", 3.0)],
        tile_goal: f64::INFINITY,
        beyond: &[],
        common: "max_depth=6",
        cells: || CELLS.map(str::to_owned).to_vec(),
    },
    ..NOTHING
};

/// Fresh suffixes, time alone, all with lenders that have to agree, and with direct light by another technique.
const CELLS: [&str; 4] = [
    "preset=mmis",
    "spatial=0,borrowed=1,canonical=1,prefixes=2",
    "borrowed=3,feedback=off,kept_for=4",
    "feedback=on,direct=restir-di",
];

/// Every kind of light and of surface.
const ROWS: [Row; 7] = [
    row("defaults", "cornell", 3, ""),
    row("an environment", "tower", 2, "borrowed=1"),
    row("long prefixes", "glass", 3, "borrowed=3,canonical=1"),
    row("all lights, hybrid", "all-lights", 2, "shift=hybrid,jitter=on"),
    row("blended, short prefixes", "sheets", 2, "min_segments=1"),
    row("things move", "moving", 6, "kept_for=3,spatial=2,feedback=on"),
    row("a lens", "cornell-lens", 2, "min_segments=1,sampler=independent"),
];
