//! Rows of path tracing.

use super::{of_row, scene};
use restir_host::Error;
use restir_host::render::{PathSettings, RenderSettings, path_plan};
use restir_kernels::Case;

const PLAIN: PathSettings = PathSettings { max_depth: 8, jitter: false, roulette: false };
const JITTER: PathSettings = PathSettings { jitter: true, ..PLAIN };

/// Name, scene, size, samples, seed, settings: the last block of the samples is the case.
type Row = (&'static str, &'static str, [u32; 2], u32, u32, PathSettings);

const ROWS: [Row; 9] = [
    ("1 sample", "cornell", [24, 24], 1, 1, PLAIN),
    ("a later block", "cornell", [17, 11], 12, 7, JITTER),
    ("roulette", "cornell", [16, 16], 2, 3, PathSettings { max_depth: 32, roulette: true, ..JITTER }),
    ("one pixel", "cornell-mitsuba", [1, 1], 8, u32::MAX, PLAIN),
    ("many lights", "furnace", [16, 9], 5, 2, PathSettings { max_depth: 5, ..JITTER }),
    ("depth 1", "cornell", [16, 16], 1, 1, PathSettings { max_depth: 1, ..PLAIN }),
    ("all materials", "glass", [20, 14], 2, 4, PathSettings { max_depth: 12, ..JITTER }),
    ("rough metal and plastic", "glossy", [20, 14], 2, 5, JITTER),
    ("environment", "tower", [20, 14], 2, 6, PathSettings { max_depth: 6, ..JITTER }),
];

pub(super) fn cases() -> Result<Vec<Case>, Error> {
    let mut cases = Vec::new();
    for (name, scene_name, [width, height], samples, seed, path) in ROWS {
        let scene = scene(scene_name)?;
        let settings = RenderSettings { width, height, samples, seed, path, dispatch_samples: None };
        cases.extend(of_row(&format!("{name}, {scene_name}"), true, [path_plan(&scene, &settings)])?);
    }
    Ok(cases)
}
