//! Colours in double precision, of which tables are made.

/// Relative luminance of linear RGB (Rec. 709).
pub(super) fn luminance([r, g, b]: [f32; 3]) -> f64 {
    0.2126 * f64::from(r) + 0.7152 * f64::from(g) + 0.0722 * f64::from(b)
}

/// The linear value of an sRGB code (IEC 61966-2-1).
pub(super) fn linear(code: u8) -> f64 {
    decoded(f64::from(code) / 255.0)
}

/// The same of a code of 16 bits.
pub(super) fn fine_linear(code: u16) -> f64 {
    decoded(f64::from(code) / 65_535.0)
}

fn decoded(s: f64) -> f64 {
    if s <= 0.040_45 { s / 12.92 } else { ((s + 0.055) / 1.055).powf(2.4) }
}
