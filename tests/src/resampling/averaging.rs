//! Visibility averaged over what competed (Tokuyoshi, "Averaging visibility"): one combine, and chains of merges over
//! frames, on small tables.

use super::forms::{Form, Input};
use super::trials::Kept;
use crate::random::SplitMix;
use restir_shared::resample::mis::Mis;

/// Pixels of a chain, in a ring.
pub const RING: usize = 4;
/// Lights of a chain.
pub const LAMPS: usize = 6;
/// History counts for at most this many frames.
const CAP: f64 = 20.0;

/// Who shines where in a chain.
#[derive(Clone, Debug)]
pub struct Room {
    /// The target of each pixel for each light, which is what it receives from it where it is visible.
    pub target: [[f64; LAMPS]; RING],
    /// What each pixel sees.
    pub visible: [[bool; LAMPS]; RING],
}

impl Room {
    /// A room whose pixels' targets differ from a common one by log-normal factors of the given deviation. Every pixel
    /// sees something, and not all.
    pub fn random(seed: u64, deviation: f64) -> Self {
        let mut random = SplitMix::new(seed);
        let common: [f64; LAMPS] = std::array::from_fn(|_| random.unit().powi(2) + 0.02);
        let mut normal = {
            let mut random = random;
            move || (-2.0 * (1.0 - random.unit()).ln()).sqrt() * (std::f64::consts::TAU * random.unit()).cos()
        };
        let mut room = Self { target: [common; RING], visible: [[true; LAMPS]; RING] };
        room.target.as_flattened_mut().iter_mut().for_each(|target| *target *= (deviation * normal()).exp());
        for (pixel, row) in room.visible.iter_mut().enumerate() {
            let mut hidden = SplitMix::new((seed << 8) + pixel as u64);
            *row = std::array::from_fn(|light| light == pixel || (light != pixel + 1 && hidden.unit() < 0.7));
        }
        room
    }

    /// What a pixel receives of a light with a given radiance relative to its target.
    pub fn truth(&self, pixel: usize, radiance: impl Fn(usize) -> f64) -> f64 {
        let lit = (0..LAMPS).filter(|&light| self.visible[pixel][light]);
        lit.map(|light| self.target[pixel][light] * radiance(light)).sum()
    }

    fn sees(&self, pixel: usize, light: usize) -> f64 {
        self.visible[pixel][light].into()
    }
}

/// The visibility by which a sample is shaded.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Visibility {
    /// The selected sample's own (Wyman and Panteleev 2021).
    Selected,
    /// The mean over what competed, by the weights of the selection.
    Averaged,
    /// The mean over what competed in the last merge, the chain carrying the selected sample's own.
    AveragedLast,
}

/// A chain of merges: each frame every pixel merges its candidates with its history, then perhaps with its neighbour.
#[derive(Clone, Copy, Debug)]
pub struct Chain {
    /// Frames from an empty history.
    pub frames: u32,
    /// Candidates of a pixel and frame.
    pub candidates: u32,
    /// Whether there is a spatial merge.
    pub spatial: bool,
    /// How merges are weighed.
    pub form: Mis,
    /// What is carried along.
    pub visibility: Visibility,
}

/// A reservoir of a chain.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Carried {
    /// The light.
    pub light: usize,
    /// Its contribution weight.
    pub weight: f64,
    /// Confidence.
    pub confidence: f64,
    /// The visibility that goes with it.
    pub visibility: f64,
}

impl Chain {
    /// The reservoirs of all pixels after the last frame.
    pub fn run(&self, room: &Room, random: &mut SplitMix) -> [Carried; RING] {
        let mut history = [Carried::default(); RING];
        for frame in 1..=self.frames {
            let is_last = frame == self.frames;
            let temporal: [Carried; RING] = std::array::from_fn(|pixel| {
                let target = |light: usize| room.target[pixel][light];
                let Kept { light, weight } = Kept::draw(random, LAMPS, self.candidates, target);
                let fresh = Carried { light, weight, confidence: 1.0, visibility: room.sees(pixel, light) };
                let old = Carried { confidence: history[pixel].confidence.min(CAP), ..history[pixel] };
                self.merge(room, [pixel, pixel], [fresh, old], is_last & !self.spatial, random)
            });
            history = std::array::from_fn(|pixel| {
                if !self.spatial {
                    return temporal[pixel];
                }
                let other = (pixel + 1) % RING;
                let neighbour = Carried { visibility: room.sees(pixel, temporal[other].light), ..temporal[other] };
                self.merge(room, [pixel, other], [temporal[pixel], neighbour], is_last, random)
            });
        }
        history
    }

    fn merge(
        &self,
        room: &Room,
        pixels: [usize; 2],
        carried: [Carried; 2],
        is_last: bool,
        random: &mut SplitMix,
    ) -> Carried {
        let at = |pixel: usize, sample: usize| room.target[pixel][carried[sample].light];
        let contribution = |i: usize| at(pixels[0], i) * carried[i].weight;
        let inputs = [0, 1].map(|i| Input { confidence: carried[i].confidence, contribution: contribution(i) });
        let a = |receiver: usize, sample: usize| at(pixels[receiver], sample);
        let combined = Form::Library(self.form).combine(&inputs, a, || random.unit());
        let selected = combined.reservoir.sample;
        let visibility = match self.visibility {
            Visibility::AveragedLast if !is_last => carried[selected].visibility,
            Visibility::Selected => carried[selected].visibility,
            _ => combined.average(2, |i| carried[i].visibility),
        };
        Carried {
            light: carried[selected].light,
            weight: combined.reservoir.contribution_weight(combined.share, at(pixels[0], selected)),
            confidence: combined.reservoir.confidence,
            visibility,
        }
    }
}

/// The mean over pixels of what they receive, relative to the truth.
pub fn shade(room: &Room, carried: &[Carried; RING], radiance: impl Fn(usize) -> f64 + Copy) -> f64 {
    let pixel = |(pixel, carried): (usize, &Carried)| {
        let f = room.target[pixel][carried.light] * radiance(carried.light);
        f * carried.visibility * carried.weight / room.truth(pixel, radiance)
    };
    carried.iter().enumerate().map(pixel).sum::<f64>() / RING as f64
}
