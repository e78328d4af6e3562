//! How different two pictures look: ꟻLIP (Andersson et al. 2020, "FLIP: A Difference Evaluator for Alternating Images"), by its authors' own code.

use nv_flip::{FlipImageRgb8, FlipPool, flip};
use restir_host::image::Image;
use restir_host::tonemap::Tone;
use restir_shared::color::srgb_encode;

/// How many pixels lie in a degree of the field of view: of a display 0.7 m away that has 3840 of them on 0.7 m, as the paper proposes.
pub const PIXELS_PER_DEGREE: f32 = 67.0;

/// The mean over all pixels of the difference between two pictures that are shown in turns: 0 if they are the same, 1 at most. Both are shown by
/// the same tone mapping, in 8 bits a channel.
///
/// # Panics
/// If one has another size.
pub fn mean(tone: Tone, reference: &Image, image: &Image) -> f64 {
    let [reference, image] = [reference, image].map(|image| shown(tone, image));
    FlipPool::from_image(&flip(reference, image, PIXELS_PER_DEGREE)).mean().into()
}

/// As a display has it.
fn shown(tone: Tone, image: &Image) -> FlipImageRgb8 {
    let Image { width, height, pixels } = tone.of(image);
    let byte = |value: &f32| (255.0 * f64::from(srgb_encode(*value))).clamp(0.0, 255.0).round() as u8;
    let bytes: Vec<u8> = pixels.as_flattened().iter().map(byte).collect();
    FlipImageRgb8::with_data(width, height, &bytes)
}

#[cfg(test)]
mod tests {
    use super::*;
    use restir_host::tonemap::Operator;
    use restir_shared::color::srgb_decode;

    const AS_IT_IS: Tone = Tone { exposure: 0.0, operator: Operator::Clamp };

    /// Of one colour, in steps of 255.
    fn plain(color: [u8; 3]) -> Image {
        Image { width: 32, height: 24, pixels: vec![color.map(|step| srgb_decode(f32::from(step) / 255.0)); 32 * 24] }
    }

    /// Of plain pictures only colours count, and the published equations are quickly worked out: HyAB distances in L*a*b* of D65, colours by Hunt's
    /// rule, to the power of 0.7; what is beyond 0.4 of that of green and blue, 41.2761, is pressed into the last 0.05.
    #[test]
    fn plain_pictures_differ_by_the_published_equations() {
        let (black, white) = (plain([0; 3]), plain([255; 3]));
        let (green, blue) = (plain([0, 255, 0]), plain([0, 0, 255]));
        let rows = [
            (&black, &black, 0.0),
            (&black, &white, 0.967_380),
            (&white, &black, 0.967_380),
            (&black, &plain([50; 3]), 0.481_316),
            (&plain([200, 0, 0]), &plain([0, 0, 200]), 0.953_786),
            (&green, &blue, 1.0),
        ];
        for (reference, image, expected) in rows {
            let found = mean(AS_IT_IS, reference, image);
            // colours are `f32` between two conversions
            assert!((found - expected).abs() < 1.0e-4, "{found} in place of {expected}");
        }
    }

    #[test]
    fn what_is_shown_counts() {
        let gray = plain([100; 3]);
        let mut dot = gray.clone();
        dot.pixels[32 * 12 + 16] = [1.0; 3];
        let brighter = Image { pixels: dot.pixels.iter().map(|pixel| pixel.map(|x| 4.0 * x)).collect(), ..gray };
        let [one, other] = [mean(AS_IT_IS, &gray, &dot), mean(AS_IT_IS, &dot, &gray)];
        assert!(one > 0.0 && one < 0.1 && (one - other).abs() < 1.0e-6, "a dot: {one}, {other}");
        // what is brighter than white cannot be told from it
        let twice = Image { pixels: brighter.pixels.iter().map(|pixel| pixel.map(|x| 100.0 * x)).collect(), ..gray };
        let thrice = Image { pixels: twice.pixels.iter().map(|pixel| pixel.map(|x| 3.0 * x)).collect(), ..gray };
        assert_eq!(mean(AS_IT_IS, &twice, &thrice), 0.0);
        let darker = Tone { exposure: -2.0, ..AS_IT_IS };
        assert_eq!(mean(darker, &brighter, &brighter), 0.0);
        assert!((mean(AS_IT_IS, &gray, &brighter) - mean(darker, &gray, &brighter)).abs() > 0.01);
    }
}
