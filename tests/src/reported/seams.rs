//! Bodies whose surface begins and ends at a seam, where vertices differ by a rounding, beside bodies that are open.

use super::{Reported, Right, stage};
use serde_json::json;
use std::f32::consts::TAU;

/// Radii and heights of a profile from one end to the other, which turns around an axis.
type Profile = fn(u32) -> [f32; 2];

const SEGMENTS: u32 = 24;

const BODIES: [(&str, Profile, u32); 4] = [
    ("cylinder", |i| [[0.0, 0.0], [0.3, 0.0], [0.3, 0.7], [0.0, 0.7]][i as usize], 4),
    ("cone", |i| [[0.0, 0.1], [0.37, 0.1], [0.0, 0.9]][i as usize], 3),
    ("sphere", |i| turned(i as f32 / 24.0, 0.35, [0.0, 0.5]), 13),
    ("torus", |i| turned(i as f32 / 12.0, 0.13, [0.31, 0.4]), 13),
];

/// A point of a circle, from its lowest one on.
fn turned(turns: f32, radius: f32, [x, y]: [f32; 2]) -> [f32; 2] {
    let [sin, cos] = sin_cos(turns);
    [x + radius * sin, y - radius * cos]
}

/// After a whole turn a rounding beside those of none.
fn sin_cos(turns: f32) -> [f32; 2] {
    let angle = f64::from(turns * TAU);
    [angle.sin() as f32, angle.cos() as f32]
}

pub(super) fn files() -> Vec<Reported> {
    let of = |(name, profile, points): (&str, Profile, u32)| {
        let seam =
            Reported { name: format!("{name} with a seam"), file: file(profile, points, 1.0), right: Right::Silence };
        let gap = Right::Warning("is not closed".to_owned());
        [seam, Reported { name: format!("{name} with a gap"), file: file(profile, points, 0.97), right: gap }]
    };
    BODIES.into_iter().flat_map(of).collect()
}

/// A body of glass, which reaches so far around its axis.
fn file(profile: Profile, points: u32, around: f32) -> Vec<u8> {
    let glass = json!({ "extensions": { "KHR_materials_transmission": { "transmissionFactor": 1.0 },
        "KHR_materials_volume": { "thicknessFactor": 0.5 } } });
    let mut file = stage(json!({}));
    let material = file.add("materials", glass);
    let mut corners = Vec::new();
    for k in 0..=SEGMENTS {
        let [sin, cos] = sin_cos(around * k as f32 / SEGMENTS as f32);
        corners.extend((0..points).map(profile).map(|[r, y]| [r * cos, y, -r * sin]));
    }
    let at = |k: u32, i: u32| k * points + i;
    let quads = (0..SEGMENTS).flat_map(|k| (1..points).map(move |i| (k, i)));
    let indices: Vec<u32> = quads
        .flat_map(|(k, i)| [at(k, i - 1), at(k + 1, i - 1), at(k + 1, i), at(k, i - 1), at(k + 1, i), at(k, i)])
        .collect();
    let positions = file.floats(corners.as_flattened(), 3);
    let indices = file.indices(&indices);
    let body = json!({ "attributes": { "POSITION": positions }, "indices": indices, "material": material });
    file.body("body", vec![body]);
    file.glb()
}
