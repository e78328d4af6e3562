//! What the figures of averaged visibility (Tokuyoshi, supplement) have in common.

use restir::technique::restir_di::{DiSettings, Visibility};

/// The visibility that is compared: that of the selected sample (Wyman and Panteleev 2021), and the mean over all that
/// competed.
pub(crate) const METHODS: [(&str, Visibility); 2] = [("prev", Visibility::Selected), ("ours", Visibility::Averaged)];

/// Settings of algorithm 1 for an image of the given height, by method. Neighbours are as near as 30 of 1080 pixels, but at
/// least 1.5 pixels, within which there are eight.
pub(crate) fn settings(height: u32) -> [DiSettings; 2] {
    let radius = (30.0 / 1080.0 * height as f32).max(1.5);
    let preset = DiSettings::preset("wis").unwrap_or_default();
    METHODS.map(|(_, visibility)| DiSettings { visibility, radius, still: false, ..preset.clone() })
}
