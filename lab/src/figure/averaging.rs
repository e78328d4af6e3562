//! What the figures of averaged visibility (Tokuyoshi, supplement) have in common.

use restir::technique::restir_di::{DiSettings, Visibility};

/// The visibility that is compared: that of the selected sample (Wyman and Panteleev 2021), and the mean over all that
/// competed.
pub(crate) const METHODS: [(&str, Visibility); 2] = [("prev", Visibility::Selected), ("ours", Visibility::Averaged)];

/// Settings of algorithm 1 for an image of the given height, by method.
pub(crate) fn settings(height: u32) -> [DiSettings; 2] {
    let radius = super::radius(height);
    let preset = DiSettings::preset("wis").unwrap_or_default();
    METHODS.map(|(_, visibility)| DiSettings { visibility, radius, still: false, ..preset.clone() })
}
