//! From radiance to what an 8-bit picture can show.
//!
//! ```
//! use restir_host::image::Image;
//! use restir_host::tonemap::{Operator, Tone};
//!
//! let image = Image { width: 2, height: 1, pixels: vec![[0.25; 3], [40.0; 3]] };
//! // one stop brighter, and what is brighter than white brought below it: L becomes L / (1 + L)
//! let shown = Tone { exposure: 1.0, operator: Operator::Reinhard }.of(&image);
//! assert!((shown.pixels[0][0] - 0.5 / 1.5).abs() < 1e-5);
//! assert!((shown.pixels[1][1] - 80.0 / 81.0).abs() < 1e-5);
//! ```

use crate::choices;
use crate::image::Image;
use glam::Vec3;
use restir_shared::vec::luminance;

choices! {
    /// A curve from radiance to display values. All keep black at 0; grey stays grey.
    pub enum Operator {
        /// None: what is brighter than 1 is cut off.
        "clamp" => Clamp,
        /// Luminance L becomes L / (1 + L), in the same hue (Reinhard et al. 2002, eq. 3).
        "reinhard" => Reinhard,
        /// The curve of ACES by channel, as fitted by Narkowicz (2015).
        "aces" => Aces,
        /// Khronos' PBR Neutral (2024): base colours up to 0.8 stay as they are but for a small offset, highlights lose
        /// their saturation.
        "neutral" => Neutral,
    }
}

/// How a picture is shown.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tone {
    /// Stops: radiance is multiplied by 2 to this power.
    pub exposure: f64,
    /// What follows.
    pub operator: Operator,
}

impl Tone {
    /// Values in [0, 1], linear, ready for [`crate::image::write_png`], or for [`restir_shared::color::srgb_encode`] and another encoder; for [`Operator::Clamp`] what lies above 1 is left to it.
    #[must_use]
    pub fn of(&self, image: &Image) -> Image {
        let scale = 2_f64.powf(self.exposure);
        let pixels = image.pixels.iter().map(|pixel| self.operator.of(pixel.map(|value| f64::from(value) * scale)));
        Image { pixels: pixels.map(|pixel| pixel.map(|value| value as f32)).collect(), ..*image }
    }
}

impl Operator {
    fn of(self, rgb: [f64; 3]) -> [f64; 3] {
        match self {
            Self::Clamp => rgb,
            Self::Reinhard => {
                let luminance = luminance(Vec3::from_array(rgb.map(|value| value as f32)));
                rgb.map(|value| value / (1.0 + f64::from(luminance)))
            }
            Self::Aces => rgb.map(|x| x * (2.51 * x + 0.03) / (x * (2.43 * x + 0.59) + 0.14)),
            Self::Neutral => neutral(rgb),
        }
    }
}

fn neutral(rgb: [f64; 3]) -> [f64; 3] {
    const FRESNEL: f64 = 0.04;
    const START: f64 = 0.8 - FRESNEL;
    const DESATURATION: f64 = 0.15;
    let least = rgb.into_iter().fold(f64::INFINITY, f64::min);
    let offset = if least < 2.0 * FRESNEL { least - least * least / (4.0 * FRESNEL) } else { FRESNEL };
    let rgb = rgb.map(|value| value - offset);
    let peak = rgb.into_iter().fold(0.0, f64::max);
    if peak < START {
        return rgb;
    }
    let room = 1.0 - START;
    let shown = 1.0 - room * room / (peak + room - START);
    let grey = 1.0 - 1.0 / (DESATURATION * (peak - shown) + 1.0);
    rgb.map(|value| value * (shown / peak) * (1.0 - grey) + shown * grey)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::settings::Choice;

    /// Values of the published formulas, worked out by hand.
    #[test]
    fn operators_have_the_published_values() {
        let near = |a: [f64; 3], b: [f64; 3]| a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1.0e-6);
        assert_eq!(Operator::Clamp.of([0.5, 2.0, 7.0]), [0.5, 2.0, 7.0]);
        assert!(near(Operator::Reinhard.of([1.0; 3]), [0.5; 3]));
        assert!(near(Operator::Reinhard.of([1.0, 0.0, 0.0]), [1.0 / 1.2126, 0.0, 0.0]));
        assert!(near(Operator::Aces.of([1.0; 3]), [2.54 / 3.16; 3]));
        assert!(near(Operator::Neutral.of([0.5, 0.2, 0.3]), [0.46, 0.16, 0.26]));
        // the offset's smooth part: 0.04 becomes 0.04^2 / 0.16
        assert!(near(Operator::Neutral.of([0.04; 3]), [0.01; 3]));
        let shown = 1.0 - 0.24 * 0.24 / (3.96 + 0.24 - 0.76);
        assert!(near(Operator::Neutral.of([4.0; 3]), [shown; 3]));
    }

    #[test]
    fn brighter_stays_brighter_and_a_stop_doubles() {
        for &operator in Operator::ALL {
            let mut last = -1.0;
            for step in 0..2000 {
                let [shown, ..] = operator.of([f64::from(step) * 0.01; 3]);
                let bounded = operator == Operator::Clamp || shown <= 1.04;
                assert!(shown > last && bounded, "{operator:?} at {step}");
                last = shown;
            }
        }
        let image = Image { width: 1, height: 1, pixels: vec![[0.25, 0.5, 1.0]] };
        let tone = Tone { exposure: 1.0, operator: Operator::Clamp };
        assert_eq!(tone.of(&image).pixels, [[0.5, 1.0, 2.0]]);
    }
}
