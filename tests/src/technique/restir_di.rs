//! ReSTIR DI: the matrix of forms of MIS by uses of visibility, and what no preset has.

use super::{Known, Matrix};

/// See [`Known`].
pub(super) const KNOWN: Known = Known {
    as_path: &["transmittance=off"],
    rows: &[
        (
            "several passes, no feedback, jitter, red",
            &["spatial=3", "feedback=off", "jitter=on", "target=red", "mis=talbot", "neighbours=2", "shaded=2"],
        ),
        (
            "fused, jitter, blue",
            &["temporal=fused", "spatial=0", "jitter=on", "target=blue", "mis=talbot", "neighbours=2", "shaded=2"],
        ),
    ],
    matrix: Matrix {
        scenes: &[
            ("many-lights", &["candidates=32"]),
            ("cornell", &["candidates=4"]),
            ("statue-by-night", &["candidates=4"]),
            ("all-lights", &["candidates=4"]),
        ],
        common: &["neighbours=3", "radius=8", "confidence_cap=3", "still=off", "shaded=0"],
        cells,
    },
};

/// Unbiased forms of MIS.
const FORMS: [&str; 6] = ["1/z", "contribution", "talbot", "pairwise", "pairwise-defensive", "pairwise-counted"];
/// Unbiased uses of visibility, with each of the forms.
const USES: [&str; 4] = [
    "visibility_reuse=off,visibility=ray,scatter=off",
    "visibility_reuse=weights,visibility=ray",
    "visibility_reuse=weights,visibility=selected",
    "visibility_reuse=selection,visibility=selected",
];
/// Unbiased settings beside.
const MORE: [&str; 16] = [
    "mis=talbot,visibility_reuse=off,visibility=ray,scatter=off,jitter=on",
    "visibility_reuse=selection,visibility=selected,jitter=on",
    "mis=talbot,visibility_reuse=off,visibility=ray,scatter=off,temporal=fused",
    "mis=contribution,visibility_reuse=weights,visibility=ray,temporal=fused",
    "visibility_reuse=selection,visibility=selected,temporal=fused",
    "mis=1/z,visibility_reuse=weights,visibility=ray,spatial=2",
    "mis=pairwise-counted-defensive,visibility_reuse=selection,visibility=selected",
    "mis=pairwise,visibility_reuse=weights,visibility=ray,scatter=off",
    "mis=talbot,visibility_reuse=off,visibility=ray,scatter=off,shaded=4",
    "mis=pairwise,visibility_reuse=selection,visibility=selected,initial_rays=4,shaded=4",
    "mis=pairwise,visibility_reuse=selection,visibility=selected,still=on,shaded=20",
    "mis=contribution,visibility_reuse=weights,visibility=ray,still=on",
    "visibility_reuse=weights,visibility=ray,spatial=2,feedback=off",
    "mis=pairwise,visibility_reuse=selection,visibility=selected,tiles=4x64",
    "mis=pairwise,visibility_reuse=selection,visibility=selected,tiles=4x64,initial_rays=4,spatial=0,still=on,shaded=20",
    "mis=pairwise,visibility_reuse=selection,visibility=selected,tiles=4x64,initial_rays=4,temporal=off,shaded=20",
];
/// Settings that make pictures darker.
const DARKER: [&str; 7] = [
    "mis=1/m,visibility_reuse=off,visibility=ray,scatter=off",
    "mis=1/m,visibility_reuse=candidates,visibility=ray",
    "mis=constant,visibility_reuse=off,visibility=ray,scatter=off",
    "mis=constant,visibility_reuse=candidates,visibility=ray",
    "visibility_reuse=candidates,visibility=ray",
    "mis=talbot,visibility_reuse=off,visibility=ray",
    "mis=talbot,visibility_reuse=candidates,visibility=averaged",
];

fn cells() -> Vec<String> {
    let forms = FORMS.iter().flat_map(|form| USES.map(|uses| format!("mis={form},{uses}")));
    forms.chain(MORE.map(str::to_owned)).chain(DARKER.map(str::to_owned)).collect()
}
