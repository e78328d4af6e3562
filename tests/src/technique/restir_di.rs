//! ReSTIR DI: the matrix of forms of MIS by uses of visibility, and what no preset has.

use super::{Cases, Known, Matrix, Row, configure_by, row};
use restir_host::technique::restir_di::DiSettings;

/// The settings that differ from the default ones as the text says, `key=value` joined by commas.
///
/// # Panics
/// If it says something else.
pub fn settings(text: &str) -> DiSettings {
    let mut settings = DiSettings::default();
    configure_by(&mut settings, text).expect("the harness knows the settings");
    settings
}

/// See [`Known`].
pub(super) const KNOWN: Known = Known {
    as_path: "transmittance=off",
    lengths: &[],
    rows: &[
        (
            "several passes, no feedback, jitter, red",
            "spatial=3,feedback=off,jitter=on,target=red,mis=talbot,neighbours=2,shaded=2",
        ),
        ("fused, jitter, blue", "temporal=fused,spatial=0,jitter=on,target=blue,mis=talbot,neighbours=2,shaded=2"),
    ],
    cases: Cases {
        common: "mis=talbot,candidates=8,initial_rays=2,scatter=off,temporal=off,still=off,spatial=1,radius=6,\
                 near_radius=2,shading_radius=6,max_plane_distance=0.05,visibility_reuse=selection,visibility=selected",
        // in two passes, and without neighbours
        variants: &["shaded=10", "shaded=0"],
        rows: &ROWS,
    },
    matrix: Matrix {
        scenes: &[
            ("many-lights", "candidates=32"),
            ("cornell", "candidates=4"),
            ("statue-by-night", "candidates=4"),
            ("all-lights", "candidates=4"),
            ("moving-fast", "candidates=4"),
        ],
        // in statue-by-night light is rare in some tiles: few restarts of them are far from a normal distribution
        goals: &[("many-lights", 2.0), ("statue-by-night", 0.3)],
        tile_goal: f64::INFINITY,
        beyond: &[],
        common: "neighbours=3,radius=8,confidence_cap=3,still=off,shaded=0",
        cells,
    },
};

/// All forms of MIS and uses of visibility, in time, in space and both at once.
const ROWS: [Row; 31] = [
    row("1/M, temporal", "cornell", 2, "mis=1/m,temporal=on,visibility_reuse=candidates,visibility=ray,spatial=0"),
    row("1/Z, spatial", "cornell", 2, "mis=1/z,neighbours=4,visibility_reuse=weights,visibility=ray"),
    row(
        "contribution, temporal",
        "many-lights",
        2,
        "mis=contribution,temporal=on,visibility_reuse=weights,jitter=on,spatial=0",
    ),
    row("contribution, spatial", "glossy", 2, "mis=contribution,neighbours=3,scatter=on"),
    row("talbot, spatial", "cornell", 2, "neighbours=4,visibility_reuse=weights,scatter=on,visibility=ray"),
    row("averaged", "many-lights", 2, "neighbours=1,visibility_reuse=candidates,visibility=averaged"),
    row("averaged in time", "cornell", 2, "temporal=on,jitter=on,visibility=averaged,spatial=0,visibility_reuse=off"),
    row("pairwise, both at once", "tower", 2, "mis=pairwise,temporal=fused,neighbours=4"),
    row("defensive, spatial", "glass", 2, "mis=pairwise-defensive,neighbours=5,scatter=on"),
    row("counted", "tower", 2, "mis=pairwise-counted,neighbours=7,scatter=on,visibility=ray,visibility_reuse=off"),
    row("counted, defensive", "cornell", 2, "mis=pairwise-counted-defensive,neighbours=5"),
    row("a still view", "cornell", 2, "temporal=on,still=on,spatial=0"),
    row("constant, no light", "unlit", 2, "mis=constant,neighbours=2,scatter=on,visibility=ray,visibility_reuse=off"),
    row("tiles", "many-lights", 2, "mis=pairwise-defensive,neighbours=3,scatter=on,tiles=3x50"),
    row("independent numbers", "many-lights", 2, "neighbours=3,scatter=on,tiles=3x50,jitter=on,sampler=independent"),
    row("more rays for what is seen", "tower", 2, "neighbours=2,jitter=on,seen_rays=5"),
    row("more rays for lamps, in time", "cornell", 3, "temporal=on,jitter=on,seen_rays=16,spatial=0"),
    row("tiles of all kinds of lights", "tower", 2, "neighbours=2,visibility_reuse=weights,scatter=on,tiles=3x50"),
    row("tiles of an environment", "statue", 2, "temporal=on,visibility_reuse=weights,tiles=3x50,spatial=0"),
    row("tiles, no light", "unlit", 2, "mis=constant,neighbours=2,visibility=ray,tiles=3x50,visibility_reuse=off"),
    row("lights go out", "moving", 6, "mis=pairwise-defensive,temporal=fused,neighbours=3"),
    row("1/Z, lights return", "moving", 10, "mis=1/z,temporal=fused,neighbours=2,visibility_reuse=weights,scatter=on"),
    row("glass, a final ray", "panes", 2, "neighbours=3,visibility=ray,visibility_reuse=off"),
    row("glass, averaged", "panes", 2, "mis=pairwise,neighbours=3,visibility=averaged,visibility_reuse=off"),
    row("glass, averaged in time", "panes", 2, "temporal=on,visibility_reuse=candidates,visibility=averaged,spatial=0"),
    row("glass, selected", "panes", 2, "mis=pairwise-defensive,neighbours=4,scatter=on"),
    row("masks", "masks", 3, "mis=pairwise,temporal=on,neighbours=3,scatter=on,still=on"),
    row("coats with textures", "coats", 2, "mis=pairwise,temporal=on,neighbours=3,scatter=on"),
    row("blended, glass", "sheets", 3, "mis=contribution,temporal=on,neighbours=3,scatter=on,tiles=3x50"),
    row(
        "blended, weights",
        "sheets",
        2,
        "neighbours=3,scatter=on,visibility_reuse=weights,visibility=ray,transmittance=off",
    ),
    row("masks and blending that move", "moving-alpha", 10, "mis=pairwise-defensive,temporal=fused,neighbours=3"),
];

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
const MORE: [&str; 18] = [
    "sampler=independent,mis=pairwise,visibility_reuse=selection,visibility=selected,jitter=on",
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
    "gloss_fade=1e6,visibility_reuse=selection,visibility=selected",
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
