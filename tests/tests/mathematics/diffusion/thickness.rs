//! What bodies that end keep of a profile: against slabs of which it is known what they reflect and transmit after more than one collision.

use super::exact;
use libtest_mimic::Failed;
use restir_shared::diffusion::{Depth, Remainder, Thickness, thickness};
use restir_shared::glam::Vec3;
use restir_shared::vec::normalize;
use restir_tests::random::SplitMix;
use restir_tests::slab_exact::Slab;
use restir_tests::suite::ensure;
use restir_tests::walk_f64::{Border, unscattered};

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

/// As known to 0.035 of what a half space sends back; one distance for all directions, or a half space, is off by more.
pub(crate) fn slabs_send_back_what_they_keep() -> Result<(), Failed> {
    let (mut worst, mut of_one_distance, mut of_half_spaces) = (0.0_f64, 0.0_f64, 0.0_f64);
    for alpha in ALBEDOS {
        let whole = known(alpha, DEEP)[0];
        for depth in DEPTHS {
            let share = known(alpha, depth)[0] / whole;
            let at = |x: f64| f64::from(of(alpha).kept(x as f32));
            worst = worst.max((kept(|cos| at(depth / cos)) - share).abs());
            of_one_distance = of_one_distance.max((at(depth) - share).abs());
            of_half_spaces = of_half_spaces.max((1.0 - share).abs());
        }
    }
    println!("off by {worst:.4}; by one distance {of_one_distance:.4}, as half spaces {of_half_spaces:.4}");
    ensure(worst < 0.035, || format!("{worst}"))?;
    ensure(of_one_distance > 0.2 && of_half_spaces > 0.98, || "not seen".to_owned())
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
    ensure(thickness(3.0, -1.0) == 3.0 && thickness(3.0, 0.0) == 12.0, || "thickness".to_owned())
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
