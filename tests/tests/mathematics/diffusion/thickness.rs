//! What bodies that end keep of a profile: against slabs of which it is known what they reflect and transmit after more than one collision.

use super::exact;
use libtest_mimic::Failed;
use restir_shared::diffusion::{Depth, Remainder, Thickness, thickness};
use restir_shared::glam::Vec3;
use restir_shared::vec::normalize;
use restir_tests::random::SplitMix;
use restir_tests::slab_exact::Slab;
use restir_tests::stats::moments;
use restir_tests::suite::ensure;
use restir_tests::walk_f64::{Border, unscattered};
use std::f64::consts::TAU;

use super::multiple::rest;

const ALBEDOS: [f64; 8] = [0.05, 0.5, 0.8, 0.9, 0.98, 0.99, 0.998, 0.9999];
const DEPTHS: [f64; 8] = [0.0625, 0.25, 0.5, 1.0, 2.0, 4.0, 8.0, 16.0];
/// As deep as half spaces are: deeper layers would begin with ones that are not thin.
const DEEP: f64 = 256.0;

fn of(alpha: f64) -> Thickness {
    Thickness::new((1.0 - alpha) as f32, 0.0)
}

/// What a slab sends back, and lets through, after more than one collision.
fn known(alpha: f64, depth: f64) -> [f64; 2] {
    let slab = Slab { depth, albedo: alpha, anisotropy: 0.0, border: Border::Open };
    let ([r, t], [once_r, once_t]) = (slab.radiance(1.0), slab.once(1.0));
    [r - once_r, t - once_t - unscattered(depth)]
}

/// The mean of what is kept, over the directions of Lambert's law.
fn kept(thickness: impl Fn(f64) -> f64) -> f64 {
    const STEPS: u32 = 512;
    let at = |step: u32| thickness(((f64::from(step) + 0.5) / f64::from(STEPS)).sqrt());
    (0..STEPS).map(at).sum::<f64>() / f64::from(STEPS)
}

/// As known to 0.035 of what a half space sends back; one distance for all directions is off by more.
pub(crate) fn slabs_send_back_what_they_keep() -> Result<(), Failed> {
    let (mut worst, mut of_one_distance) = (0.0_f64, 0.0_f64);
    for alpha in ALBEDOS {
        let whole = known(alpha, DEEP)[0];
        for depth in DEPTHS {
            let share = known(alpha, depth)[0] / whole;
            let at = |x: f64| f64::from(of(alpha).kept(x as f32));
            worst = worst.max((kept(|cos| at(depth / cos)) - share).abs());
            of_one_distance = of_one_distance.max((at(depth) - share).abs());
        }
    }
    println!("off by {worst:.4}; by one distance {of_one_distance:.4}");
    ensure(worst < 0.035, || format!("{worst}"))?;
    ensure(of_one_distance > 0.2, || "not seen".to_owned())
}

/// What comes out on the far side, of slabs up to four mean free paths deep: as known to 0.04 of the light that enters, and without gain not.
pub(crate) fn slabs_let_through_what_they_gain() -> Result<(), Failed> {
    let (mut worst, mut without) = (0.0_f64, 0.0_f64);
    for alpha in ALBEDOS {
        for depth in DEPTHS.into_iter().filter(|depth| *depth <= 4.0) {
            let share = kept(|cos| f64::from(of(alpha).kept((depth / cos) as f32)));
            let profile = share * exact::ring(depth, 60.0, |r| rest(r, alpha, Remainder::Diffuse));
            let pair = Depth::new(Vec3::NEG_Y * depth as f32, Vec3::Y, Vec3::NEG_Y);
            let through = known(alpha, depth)[1];
            worst = worst.max((profile * f64::from(of(alpha).gain(&pair, 1.0)) - through).abs());
            without = without.max((profile - through).abs());
        }
    }
    println!("off by {worst:.4}, without gain by {without:.4}");
    ensure(worst < 0.04, || format!("{worst}"))?;
    ensure(without > 0.1, || "not seen".to_owned())
}

/// Two planes that meet at a right angle, of which light enters at a distance of one mean free path from the edge: a corner, whose air is where x and y are
/// positive, or an edge, whose body is where both are negative.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Bend {
    Corner,
    Edge,
}

impl Bend {
    /// -1 where heights go down from the edge and light enters left of it.
    fn sign(self) -> f64 {
        if self == Self::Corner { 1.0 } else { -1.0 }
    }

    /// How far it is to a plane along which the other coordinate is that of the surface.
    fn distance(self, [across, along]: [f64; 2], [towards, beside]: [f64; 2]) -> f64 {
        let distance = if across < 0.0 && towards > 0.0 { -across / towards } else { f64::INFINITY };
        if self.sign() * (along + distance * beside) > 0.0 { distance } else { f64::INFINITY }
    }

    /// Whether light that collided more than once leaves through the plane in which it did not enter.
    fn crosses(self, index: u64, alpha: f64) -> bool {
        let mut random = SplitMix::new(1 << 42 | index);
        let (mut at, mut cos) = ([self.sign(), -1.0e-9], -random.unit().sqrt());
        let mut collisions = 0;
        loop {
            let (sine, turn) = ((1.0 - cos * cos).max(0.0).sqrt(), TAU * random.unit());
            let direction = [sine * turn.cos(), cos];
            let floor = self.distance([at[1], at[0]], [direction[1], direction[0]]);
            let wall = self.distance(at, direction);
            let distance = -(-random.unit()).ln_1p();
            if distance >= floor.min(wall) {
                return wall < floor && collisions > 1;
            }
            if random.unit() >= alpha {
                return false;
            }
            at = [0, 1].map(|axis| at[axis] + distance * direction[axis]);
            (cos, collisions) = (2.0 * random.unit() - 1.0, collisions + 1);
        }
    }

    /// What a profile has there, with what pairs gain or without.
    fn fitted(self, alpha: f64, gains: bool) -> f64 {
        const STEPS: u32 = 240;
        // by logarithms, for all lies near the edge
        let nodes = |most: f64| {
            let at = move |step: f64| 1.0e-3 * (most / 1.0e-3).powf(step / f64::from(STEPS));
            (0..STEPS).map(move |step| (at(f64::from(step) + 0.5), at(f64::from(step) + 1.0) - at(f64::from(step))))
        };
        let mut sum = 0.0;
        for (height, strip) in nodes(30.0) {
            let way = Vec3::new(-self.sign() as f32, (self.sign() * height) as f32, 0.0);
            let pair = Depth::new(way, Vec3::Y, Vec3::X);
            let gain = if gains { f64::from(of(alpha).gain(&pair, 1.0)) } else { 1.0 };
            let of_strip = |(z, width): (f64, f64)| {
                2.0 * width * rest((1.0 + height * height + z * z).sqrt(), alpha, Remainder::Diffuse)
            };
            sum += gain * strip * nodes(60.0).map(of_strip).sum::<f64>();
        }
        sum
    }
}

/// Around a corner a profile has several times what light brings there, beside an edge too little. By what pairs gain the error is a third of that in a corner,
/// and three quarters beside an edge, where the rest is light of the plane in which it entered.
pub(crate) fn bends_are_nearer_to_walks() -> Result<(), Failed> {
    const WALKS: u64 = 1 << 17;
    for (bend, alpha, share) in
        [(Bend::Corner, 0.8, 0.33), (Bend::Corner, 0.95, 0.33), (Bend::Edge, 0.8, 0.75), (Bend::Edge, 0.95, 0.75)]
    {
        let found = moments(WALKS, 1 << 12, 1, |index| [f64::from(u8::from(bend.crosses(index, alpha)))])[0];
        let [with, without] = [true, false].map(|gains| bend.fitted(alpha, gains));
        let (walks, error) = (found.mean(), found.standard_error());
        println!("{bend:?}, albedo {alpha}: walks {walks:.4} +- {error:.4}, fit {with:.4}, without gain {without:.4}");
        let [off, of_half_spaces] = [with, without].map(|fit| (fit - walks).abs());
        ensure(off < share * of_half_spaces && of_half_spaces > 20.0 * error, || format!("{bend:?}, {alpha}: {with}"))?;
    }
    Ok(())
}

/// What is kept grows with the thickness from nothing to all, whatever the medium; and no less of gray media than of white ones.
pub(crate) fn more_is_kept_of_thicker_bodies() -> Result<(), Failed> {
    for absorbed in [0.0, 1.0e-12, 1.0e-6, 1.0e-3, 0.1, 0.5, 1.0] {
        for anisotropy in [-0.9, 0.0, 0.9] {
            let channel = Thickness::new(absorbed, anisotropy);
            let at = |step: i32| channel.kept(f32::from_bits(((127 + step) as u32) << 23));
            let grows = (-40..99).all(|step| at(step) <= at(step + 1));
            let ends = channel.kept(0.0) == 0.0 && (0.99..=1.0).contains(&at(99)) && at(-40) >= 0.0;
            ensure(grows && ends, || format!("absorbed {absorbed}, anisotropy {anisotropy}"))?;
        }
    }
    for x in [0.25, 1.0, 4.0, 16.0] {
        let kept = [1.0e-4, 1.0e-2, 0.1, 0.5, 0.95].map(|absorbed| Thickness::new(absorbed, 0.0).kept(x));
        ensure(kept.windows(2).all(|pair| pair[0] <= pair[1]), || format!("whiter media keep more: {kept:?}"))?;
    }
    let known = [(-1.0, 3.0), (0.0, 12.0), (1.0, 3072.0)];
    ensure(known.iter().all(|(cos, expected)| thickness(3.0, *cos) == *expected), || "thickness".to_owned())
}

/// A pair of points is the same from both ends; nothing is gained on a plane, or lost; what faces across air is lost.
pub(crate) fn pairs_have_no_first_point() -> Result<(), Failed> {
    let mut random = SplitMix::new(5);
    let mut vector = || Vec3::from_array([0, 1, 2].map(|_| 2.0 * random.unit() as f32 - 1.0));
    for _ in 0..10_000 {
        let (way, one, other) = (vector(), normalize(vector()), normalize(vector()));
        let gains = [Depth::new(way, one, other), Depth::new(-way, other, one)].map(|pair| of(0.9).gain(&pair, 2.0));
        ensure(gains[0] == gains[1] && gains[0] >= 0.0, || format!("{way} {one} {other}: {gains:?}"))?;
    }
    let gain = |way: Vec3, one, other| of(0.9).gain(&Depth::new(way, one, other), 1.0);
    ensure(gain(Vec3::X, Vec3::Y, Vec3::Y) == 1.0, || "a plane".to_owned())?;
    ensure(gain(Vec3::Y, Vec3::Y, Vec3::NEG_Y) == 0.0, || "a gap".to_owned())?;
    let corner = gain(Vec3::new(-1.0, 1.0, 0.0), Vec3::Y, Vec3::X);
    ensure(corner > 0.1 && corner < 0.5, || format!("a corner: {corner}"))?;
    ensure(gain(Vec3::NEG_Y, Vec3::Y, Vec3::NEG_Y) > 1.3, || "a slab".to_owned())
}
