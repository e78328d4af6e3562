//! Samples whose shift has a Jacobian, through the library's own temporal and spatial reuse and exchange.
//!
//! Six pixels lie in a row, in two frames. A sample is a number in [0, 1], and each pixel bends it in its own way to a common
//! coordinate `s (x + c x (1 - x))`: a shift goes there and back again, and fails where the other pixel does not reach. What a
//! pixel integrates, `1 + b x` up to an edge, from where on the sample is occluded, has a closed form; the target is another
//! function.

use crate::random::SplitMix;
use restir_shared::glam::Vec3;
use restir_shared::num;
use restir_shared::resample::domain::{Domain, Pixels, Reservoirs, Shifted, Source};
use restir_shared::resample::exchange::{self, Neighbours, Offer, Offers, PAIRS, PairTargets};
use restir_shared::resample::merge::{self, Draws, Others, Rules};
use restir_shared::resample::mis::Mis;
use restir_shared::resample::packed::Stored;
use restir_shared::resample::reproject::{Grid, Place};
use restir_shared::resample::reservoir::Reservoir;
use restir_shared::resample::similar::{GBufferSurface, Similarity};
use restir_shared::rng::{Rng, Sampler};

/// Pixels of a row.
pub const WIDTH: usize = 6;
/// Candidates of a pixel.
const CANDIDATES: u32 = 3;
const GRID: Grid = Grid { width: WIDTH as u32, height: 1 };
const SIMILARITY: Similarity = Similarity { max_plane_distance: 0.1, min_normal_cos: 0.9 };
/// A pixel whose surface is like no other's.
const STRANGER: u32 = 4;

/// The Jacobian that shifts report.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Jacobian {
    /// The right one.
    Right,
    /// 1.
    LeftOut,
    /// That of the inverse shift.
    Inverted,
}

/// How the row is resampled.
#[derive(Clone, Copy, Debug)]
pub struct Setting {
    /// The form of MIS.
    pub form: Mis,
    /// Targets have visibility, wherever they are asked for, and reservoirs lack what is occluded.
    pub visible: bool,
    /// What shifts report.
    pub jacobian: Jacobian,
}

/// A pixel of a frame.
#[derive(Clone, Copy, Debug, Default)]
pub struct Pixel {
    scale: f32,
    bend: f32,
    slope: f32,
    edge: f32,
}

impl Pixel {
    /// Of this frame or of the last one.
    fn new(index: u32, last: bool) -> Self {
        let i = index as f32;
        let sign = if index.is_multiple_of(2) == last { 1.0 } else { -1.0 };
        Self {
            scale: 1.0 + 0.1 * ((index * 5 + u32::from(last)) % 4) as f32,
            bend: sign * (0.3 + 0.1 * i),
            slope: 0.5 * i - if last { 0.5 } else { 0.3 },
            edge: if index % 3 == 1 { 0.8 } else { 1.0 },
        }
    }

    fn bent(&self, x: f32) -> f32 {
        self.scale * (x + self.bend * x * (1.0 - x))
    }

    /// The derivative of [`Self::bent`].
    fn stretch(&self, x: f32) -> f32 {
        self.scale * (1.0 + self.bend * (1.0 - 2.0 * x))
    }

    /// The inverse of [`Self::bent`]; more than 1 where there is none.
    fn unbent(&self, u: f32) -> f32 {
        let (v, b) = (u / self.scale, 1.0 + self.bend);
        if v > 1.0 { 2.0 } else { 2.0 * v / (b + num::sqrt(b * b - 4.0 * self.bend * v)) }
    }

    fn value(&self, x: f32) -> f32 {
        1.0 + self.slope * x
    }

    fn target(&self, x: f32) -> f32 {
        self.value(x) * (1.5 - x)
    }

    fn sees(&self, x: f32) -> f32 {
        if x < self.edge { 1.0 } else { 0.0 }
    }

    /// The integral of what is not occluded.
    fn truth(&self) -> f32 {
        self.edge + 0.5 * self.slope * self.edge * self.edge
    }
}

/// Samples of a row, and whether other pixels are of the last frame.
#[derive(Clone, Copy)]
struct Line {
    jacobian: Jacobian,
    in_time: bool,
}

/// A sample at a pixel.
#[derive(Clone, Copy, Default)]
struct Evaluation {
    pixel: Pixel,
    sample: f32,
}

impl Line {
    fn pixel(&self, source: Source) -> Pixel {
        Pixel::new(source.pixel, self.in_time && source.is_other)
    }
}

impl Domain for Line {
    type Sample = f32;
    type Receiver = Pixel;
    type Evaluation = Evaluation;

    fn shift(&self, x: f32, from: Source, to: Source, receiver: &Pixel) -> Shifted<f32> {
        let source = self.pixel(from);
        if from == to {
            return Shifted { sample: x, jacobian: 1.0, exists: true };
        }
        let sample = receiver.unbent(source.bent(x));
        let exists = sample <= 1.0;
        let right = source.stretch(x) / receiver.stretch(if exists { sample } else { 0.5 });
        let jacobian = match self.jacobian {
            Jacobian::Right => right,
            Jacobian::LeftOut => 1.0,
            Jacobian::Inverted => 1.0 / right,
        };
        Shifted { sample, jacobian, exists }
    }

    fn evaluate(&self, &pixel: &Pixel, sample: f32) -> Evaluation {
        Evaluation { pixel, sample }
    }

    fn target(&self, e: &Evaluation) -> f32 {
        e.pixel.target(e.sample)
    }

    fn value(&self, e: &Evaluation) -> Vec3 {
        Vec3::splat(e.pixel.value(e.sample))
    }

    fn visibility(&self, _: &Pixel, e: &Evaluation) -> Vec3 {
        Vec3::splat(e.pixel.sees(e.sample))
    }

    fn visible_target(&self, e: &Evaluation, visibility: Vec3) -> f32 {
        self.target(e) * visibility.x
    }
}

type Row = [Stored<f32>; WIDTH];

struct Reused<'a> {
    line: Line,
    own: u32,
    others: &'a Row,
}

/// The stranger's surface faces another way than those of the others.
fn surface(pixel: u32) -> GBufferSurface {
    let normal = if pixel == STRANGER { Vec3::X } else { Vec3::Z };
    GBufferSurface { position: Vec3::new(pixel as f32, 0.0, 0.0), normal, distance: 1.0 }
}

impl Reservoirs for Reused<'_> {
    type Domain = Line;
    type Packed = Stored<f32>;
    const NO_SAMPLE: f32 = 0.0;
    const NO_RESERVOIR: Stored<f32> =
        Stored { sample: 0.0, contribution_weight: 0.0, confidence: 0.0, visibility: Vec3::ZERO };

    fn domain(&self) -> &Line {
        &self.line
    }

    fn unpack(&self, packed: Stored<f32>) -> Stored<f32> {
        packed
    }

    fn pack(&self, stored: &Stored<f32>) -> Stored<f32> {
        *stored
    }

    fn receiver(&self, pixel: Source) -> Pixel {
        self.line.pixel(pixel)
    }
}

impl Pixels for Reused<'_> {
    fn grid(&self) -> Grid {
        GRID
    }

    fn other(&self, pixel: u32) -> Stored<f32> {
        self.others[pixel as usize]
    }

    fn own_surface(&self) -> GBufferSurface {
        surface(self.own)
    }

    fn sees(&self, _: [u32; 2]) -> bool {
        true
    }

    fn surface(&self, [x, _]: [u32; 2]) -> GBufferSurface {
        surface(x)
    }

    /// All surfaces move by one pixel.
    fn reproject(&self, here: &GBufferSurface) -> Place {
        let x = here.position.x as u32 + 1;
        Place { x, y: 0, inside: x < GRID.width }
    }
}

/// What pixels show each other.
struct Shown<'a> {
    row: &'a Row,
    offers: &'a [Offer; WIDTH],
}

impl Offers for Shown<'_> {
    type Sample = f32;

    fn reservoir(&self, pixel: u32) -> Stored<f32> {
        self.row[pixel as usize]
    }

    fn surface(&self, pixel: u32) -> GBufferSurface {
        surface(pixel)
    }

    fn target(&self, pixel: u32) -> f32 {
        self.offers[pixel as usize].target
    }
}

/// The stages of [`Setting::estimate`].
pub const STAGES: [&str; 3] = ["in time", "in space", "exchanged"];
/// Values of a stage: each pixel, and the sum of the row.
pub const VALUES: usize = WIDTH + 1;
/// What [`Setting::estimate`] gives: the values of the first stage, of the second, of the third.
pub const ESTIMATES: usize = STAGES.len() * VALUES;

impl Setting {
    /// A pixel's candidates, resampled.
    fn draw(&self, pixel: Pixel, random: &mut SplitMix) -> Stored<f32> {
        let mut reservoir = Reservoir::empty(0.0);
        for _ in 0..CANDIDATES {
            let x = random.unit() as f32;
            let occluded = self.visible & (pixel.sees(x) == 0.0);
            let weight = if occluded { 0.0 } else { pixel.target(x) / CANDIDATES as f32 };
            reservoir.update(x, weight, 1.0, random.unit() as f32);
        }
        let sample: f32 = reservoir.sample;
        Stored {
            sample,
            contribution_weight: reservoir.contribution_weight(1.0, pixel.target(sample)),
            confidence: 1.0,
            visibility: Vec3::splat(pixel.sees(sample)),
        }
    }

    fn rules(&self, others: Others, neighbours: u32) -> Rules {
        let visibility =
            merge::Uses { selection: self.visible, mis: self.visible, forgotten: false, shading: false, mean: false };
        let (radius, near_radius, confidence_cap) = (2.5, 0.0, 20.0);
        let (form, similarity) = (self.form, SIMILARITY);
        Rules { form, others, neighbours, radius, near_radius, similarity, confidence_cap, visibility }
    }

    /// Each pixel's reservoir, combined with `others`: in time with those of the last frame.
    fn combined(&self, own: &Row, others: &Row, kind: Others, neighbours: u32, random: &mut SplitMix) -> Row {
        let line = Line { jacobian: self.jacobian, in_time: kind == Others::OtherFrame };
        let rules = self.rules(kind, neighbours);
        std::array::from_fn(|x| {
            let at = [x as u32, 0];
            let word = random.word();
            let draws =
                Draws { rng: Rng::new(at[0], 0, word as u32, (word >> 32) as u32, Sampler::Independent), dimension: 0 };
            merge::combine(&Reused { line, own: at[0], others }, &rules, own[x], at, &draws).reservoir
        })
    }

    /// What each pixel receives as all are shaded together.
    fn exchanged(&self, row: &Row) -> [f32; WIDTH] {
        let line = Line { jacobian: self.jacobian, in_time: false };
        let neighbours =
            Neighbours { grid: GRID, count: 4, pairs: [1, 2, 0, 0], near_radius: 0.0, similarity: SIMILARITY };
        assert!(neighbours.count <= 2 * PAIRS as u32);
        let receiver = |x: usize| Pixel::new(x as u32, false);
        let offers = std::array::from_fn(|x| exchange::offer(&line, &receiver(x), &row[x], self.visible, true));
        let shown = Shown { row, offers: &offers };
        let uses = exchange::Uses { mis: self.visible, traced: true };
        let received: [(PairTargets, Vec3); WIDTH] =
            std::array::from_fn(|x| exchange::receive(&line, &shown, &neighbours, uses, &receiver(x), [x as u32, 0]));
        let pairs = received.map(|(pairs, _)| pairs);
        std::array::from_fn(|x| {
            let share = exchange::own_share(&shown, &neighbours, &pairs, [x as u32, 0]);
            received[x].1.x + offers[x].radiance.x * share
        })
    }

    /// Estimates relative to the truth, of each pixel and of the row: after reuse from the last frame, after reuse from
    /// neighbours, and shaded with neighbours.
    pub fn estimate(&self, random: &mut SplitMix) -> [f64; ESTIMATES] {
        let frame = |last, random: &mut SplitMix| -> Row {
            std::array::from_fn(|x| self.draw(Pixel::new(x as u32, last), random))
        };
        let (last, this) = (frame(true, random), frame(false, random));
        let temporal = self.combined(&this, &last, Others::OtherFrame, 1, random);
        let spatial = self.combined(&temporal, &temporal, Others::SameFrame, 3, random);
        let shaded = |row: &Row| std::array::from_fn(|x| shade(x, &row[x]));
        let stages = [shaded(&temporal), shaded(&spatial), self.exchanged(&spatial)].map(relative);
        std::array::from_fn(|i| stages[i / VALUES][i % VALUES])
    }

    /// How the weights of one sample sum up, relative to one. All pixels hold the same point of the common coordinate, with the
    /// contribution weight of the same density, so what comes of them is what each has: after reuse in time and in space by
    /// that many neighbours, and after the exchange. Worst of all pixels.
    pub fn weight_sums(&self, random: &mut SplitMix) -> [f64; 3] {
        let u = random.unit() as f32;
        let copies = |last, random: &mut SplitMix| -> Row {
            std::array::from_fn(|x| {
                let pixel = Pixel::new(x as u32, last);
                let sample = pixel.unbent(u);
                let confidence = if random.below(4) == 0 { 0.0 } else { 1.0 + random.below(20) as f32 };
                let contribution_weight = num::recip(pixel.stretch(sample));
                Stored {
                    sample,
                    contribution_weight,
                    confidence: confidence.max(1.0 - x as f32),
                    visibility: Vec3::ONE,
                }
            })
        };
        let (last, mut this) = (copies(true, random), copies(false, random));
        this.iter_mut().for_each(|stored| stored.confidence = stored.confidence.max(1.0));
        let neighbours = 1 + random.below(7) as u32;
        let temporal = self.combined(&this, &last, Others::OtherFrame, neighbours, random);
        let spatial = self.combined(&this, &this, Others::SameFrame, neighbours, random);
        let weights = |row: Row| std::array::from_fn(|x| row[x].contribution_weight / this[x].contribution_weight);
        let alone: [f32; WIDTH] = std::array::from_fn(|x| shade(x, &this[x]));
        let exchanged = self.exchanged(&this);
        let shaded = std::array::from_fn(|x| if alone[x] > 0.0 { exchanged[x] / alone[x] } else { 1.0 });
        let worst = |sums: [f32; WIDTH]| {
            sums.map(f64::from).into_iter().fold(1.0, |a: f64, b| if (b - 1.0).abs() > (a - 1.0).abs() { b } else { a })
        };
        [weights(temporal), weights(spatial), shaded].map(worst)
    }
}

/// What a pixel receives by way of its own reservoir.
fn shade(x: usize, stored: &Stored<f32>) -> f32 {
    let pixel = Pixel::new(x as u32, false);
    pixel.value(stored.sample) * pixel.sees(stored.sample) * stored.contribution_weight
}

/// Each pixel and the mean over the row, relative to the truth.
fn relative(row: [f32; WIDTH]) -> [f64; VALUES] {
    let of = |x: usize| f64::from(row[x]) / f64::from(Pixel::new(x as u32, false).truth());
    let mean = (0..WIDTH).map(of).sum::<f64>() / WIDTH as f64;
    std::array::from_fn(|x| if x < WIDTH { of(x) } else { mean })
}
