//! One channel, over the distance.

use super::exact;
use libtest_mimic::Failed;
use restir_shared::diffusion::{REACH, TAIL, ccdf, cdf, invert_radius, radial_profile, sample_radius};
use restir_shared::num;
use restir_tests::random::SplitMix;
use restir_tests::stats::{FAMILY_RATE, Family};
use restir_tests::suite::ensure;

fn off(found: f32, exact: f64) -> f64 {
    (f64::from(found) - exact).abs() / exact.abs()
}

/// Numbers in [0, 1) as random ones are: multiples of 2^-24, the ends among them.
fn lattice() -> impl Iterator<Item = f32> {
    let ends = (0..24).flat_map(|bit| [(1_u32 << bit) - 1, 1 << bit, (1 << 24) - (1 << bit)]);
    let mut random = SplitMix::new(3);
    ends.chain((0..100_000).map(move |_| random.below(1 << 24) as u32)).map(|word| word as f32 / 16_777_216.0)
}

pub(crate) fn profiles_have_their_values() -> Result<(), Failed> {
    let values =
        [(0.01, 7.904_915_87), (0.1, 0.744_866_43), (1.0, 0.043_147_33), (3.0, 0.005_539_47), (10.0, 0.000_142_12)];
    for (r, value) in values {
        let found = radial_profile(r, 1.0);
        // printed to eight places
        let printed = (f64::from(found) - value).abs();
        ensure(printed < 6.0e-9 + 2.0e-7 * value && off(found, exact::profile(r.into(), 1.0)) < 5.0e-7, || {
            format!("Rd({r}) = {found}, not {value}")
        })?;
    }
    // at the centre it is as high as at 1e-5 d, at any scale
    for d in [1.0e-6_f32, 1.0, 1.0e4] {
        let [centre, near] = [0.0, 1.0e-5 * d].map(|r| radial_profile(r, d));
        ensure(centre.is_finite() && (centre / near - 1.0).abs() < 1.0e-5, || format!("{centre} at 0, {near} beside"))?;
    }
    Ok(())
}

/// Also the moments: the mean distance is 2.5 d, that of its square 14 d^2.
pub(crate) fn profiles_integrate_to_one() -> Result<(), Failed> {
    for d in [1.0e-3_f32, 1.0, 50.0] {
        let f = |r: f64| f64::from(radial_profile(r as f32, d));
        let scale = f64::from(d);
        let moment = |to: f64, power: i32| exact::ring(0.0, to * scale, |r| f(r) * (r / scale).powi(power));
        let found = [moment(200.0, 0), moment(REACH.into(), 0), moment(200.0, 1), moment(200.0, 2)];
        let expected = [1.0, 1.0 - f64::from(TAIL), 2.5, 14.0];
        let worst = found.iter().zip(expected).map(|(a, b)| (a / b - 1.0).abs()).fold(0.0, f64::max);
        println!("d {d}: {found:?}");
        ensure(worst < 1.0e-5, || format!("{found:?} instead of {expected:?}"))?;
    }
    Ok(())
}

pub(crate) fn distribution_functions_keep_their_digits() -> Result<(), Failed> {
    let table = [
        (0.1, 0.048_379),
        (0.5, 0.213_506),
        (1.0, 0.370_632),
        (2.0, 0.581_103),
        (3.0, 0.711_644),
        (5.0, 0.856_659),
        (10.0, 0.973_233),
        (16.0, 0.996_379),
        (19.999_999, 0.999_046),
    ];
    for (x, value) in table {
        let found = [f64::from(cdf(x)), 1.0 - f64::from(ccdf(x))];
        ensure(found.iter().all(|found| (found - value).abs() < 1.0e-6), || {
            format!("P({x}) = {found:?}, not {value}")
        })?;
    }
    let (mut worst, mut naive) = ([0.0_f64; 2], 0.0_f64);
    for i in 0..40_000 {
        let x = (10.0_f64.powi(-(i % 9)) * (1.0 + 18.0 * (f64::from(i) / 40_000.0))) as f32;
        let exact = [exact::cdf(x.into()), exact::ccdf(x.into())];
        worst = [worst[0].max(off(cdf(x), exact[0])), worst[1].max(off(ccdf(x), exact[1]))];
        // as it is printed
        let difference = 1.0 - 0.25 * num::exp(-x) - 0.75 * num::exp(-x / 3.0);
        naive = naive.max(off(difference, exact[0]));
    }
    println!(
        "distribution function off by {:.1e}, its complement by {:.1e}; as printed by {naive:.1e}",
        worst[0], worst[1]
    );
    // a few roundings; of the complement the exponent's, too, which is up to 6.6
    ensure(worst[0] < 6.0e-7 && worst[1] < 1.5e-6 && naive > 1.0e-2, || format!("{worst:?}, {naive}"))
}

/// The exact distance of a number, as [`sample_radius`] means it.
fn exact_radius(u: f32) -> f64 {
    let (u, tail) = (f64::from(u), f64::from(TAIL));
    if u >= 0.5 { exact::quantile((1.0 - tail) * (1.0 - u)) } else { exact::beyond(tail + (1.0 - tail) * u) }
}

/// In single precision as Golubev has it, for all numbers.
fn golubev(xi: f32) -> f32 {
    let u = 1.0 - xi;
    let g = 1.0 + 4.0 * u * (2.0 * u + num::sqrt(1.0 + 4.0 * u * u));
    let root = num::cbrt(g);
    3.0 * num::ln((1.0 + 1.0 / root + root) / (4.0 * u))
}

pub(crate) fn radii_keep_their_digits() -> Result<(), Failed> {
    let (mut worst, mut at) = (0.0_f64, 0.0);
    for u in lattice() {
        let found = sample_radius(u);
        let error = off(found, exact_radius(u));
        if error > worst {
            (worst, at) = (error, u);
        }
        ensure((0.0..=REACH).contains(&found) && found > 0.0, || format!("{u} gives {found}"))?;
    }
    let tiny = 1.0e-6_f32;
    let naive = off(golubev(tiny), exact::quantile(tiny.into()));
    println!("radii off by {worst:.1e} at {at}; by a single form {naive:.1e} at 1e-6");
    ensure(worst < 8.0e-7, || format!("off by {worst:e} at {at}"))?;
    ensure(naive > 1.0e-2, || "a form that cancels goes unnoticed".to_owned())
}

/// Three published inversions, quantiles and the series for small numbers.
pub(crate) fn published_inversions_agree() -> Result<(), Failed> {
    let golubev = |xi: f64| {
        let u = 1.0 - xi;
        let g = 1.0 + 4.0 * u * (2.0 * u + (1.0 + 4.0 * u * u).sqrt());
        3.0 * ((1.0 + g.cbrt().recip() + g.cbrt()) / (4.0 * u)).ln()
    };
    let christensen = |xi: f64| {
        let h = 9.0 - 16.0 * xi + 8.0 * xi * xi + 4.0 * (1.0 - xi) * (5.0 - 8.0 * xi + 4.0 * xi * xi).sqrt();
        3.0 * ((1.0 + h.cbrt().recip() + h.cbrt()) / (4.0 * (1.0 - xi))).ln()
    };
    let quantiles = [
        (0.5, 1.552_183),
        (0.9, 6.062_229),
        (0.99, 12.952_642),
        (0.995, 15.031_950),
        (0.999, 19.860_221),
        (0.9999, 26.767_975),
    ];
    for (xi, value) in quantiles {
        let found = [exact::quantile(xi), exact::beyond(1.0 - xi), golubev(xi), christensen(xi)];
        ensure(found.iter().all(|found| (found - value).abs() < 6.0e-7), || format!("{xi}: {found:?}, not {value}"))?;
        let u = ((1.0 - xi - f64::from(TAIL)) / (1.0 - f64::from(TAIL))) as f32;
        let sampled = f64::from(sample_radius(u.max(0.0)));
        ensure(xi > 0.999 || (sampled - value).abs() < 1.0e-5, || format!("{xi}: {sampled}, not {value}"))?;
    }
    for xi in [1.0e-2_f64, 1.0e-3] {
        let series = 2.0 * xi + 4.0 / 3.0 * xi * xi + 28.0 / 27.0 * xi.powi(3);
        ensure((series / exact::quantile(xi) - 1.0).abs() < xi.powi(3), || format!("{xi}: {series}"))?;
    }
    Ok(())
}

/// A distance of which numbers are made again moves by no more than their rounding, in units of `d`.
pub(crate) fn radii_come_back() -> Result<(), Failed> {
    let mut worst = 0.0_f64;
    for u in lattice() {
        let x = sample_radius(u);
        let again = invert_radius(x);
        ensure((0.0..1.0).contains(&again), || format!("{u} gives {x}, that gives {again}"))?;
        worst = worst.max((f64::from(sample_radius(again)) - f64::from(x)).abs());
    }
    println!("radii come back within {worst:.1e} d");
    // a number kept by what comes out nearer has 2^-24 of 1, which is 1.8e-4 d far out
    ensure(worst < 5.0e-6, || format!("{worst:e}"))
}

pub(crate) fn radii_have_their_density() -> Result<(), Failed> {
    const CELLS: usize = 256;
    const DRAWS: u64 = 1 << 20;
    let mut family = Family::new("radii", FAMILY_RATE);
    let cell = |index: u64| {
        let u = SplitMix::new(index).below(1 << 24) as f32 / 16_777_216.0;
        let below = exact::cdf(sample_radius(u).into()) / (1.0 - f64::from(TAIL));
        ((below * CELLS as f64) as usize).min(CELLS - 1)
    };
    family.uniform("by the exact distribution function", CELLS, DRAWS, cell);
    println!("{}", family.verdict()?);
    let mut wrong = Family::new("radii of another density", FAMILY_RATE);
    wrong.uniform("off by one percent", CELLS, DRAWS, |index| {
        let u = SplitMix::new(index).below(1 << 24) as f32 / 16_777_216.0;
        let below = exact::cdf(1.01 * f64::from(sample_radius(u))) / (1.0 - f64::from(TAIL));
        ((below * CELLS as f64) as usize).min(CELLS - 1)
    });
    ensure(!wrong.passed(), || "radii that are one percent too large go unnoticed".to_owned())
}

/// Halley's steps on the distribution function, in double precision, as they are published for want of an inverse.
fn halley(xi: f64) -> f64 {
    let mut x = 2.0 * xi;
    for _ in 0..64 {
        let [fast, slow] = [(-x).exp(), (-x / 3.0).exp()];
        let (off, slope, bend) = (exact::cdf(x) - xi, 0.25 * (fast + slow), -0.25 * (fast + slow / 3.0));
        x = (x - 2.0 * off * slope / (2.0 * slope * slope - off * bend)).max(0.5 * x);
    }
    x
}

/// The inverse in closed form is what a numeric one finds.
pub(crate) fn halleys_steps_agree() -> Result<(), Failed> {
    let (mut worst, mut sampled) = (0.0_f64, 0.0_f64);
    for u in lattice().filter(|&u| (0.0..0.9999).contains(&u)) {
        // what comes out nearer than the radius of that number
        let xi = (1.0 - f64::from(TAIL)) * (1.0 - f64::from(u));
        worst = worst.max((halley(xi) / exact::quantile(xi) - 1.0).abs());
        sampled = sampled.max(off(sample_radius(u), halley(xi)));
    }
    println!("Halley's steps are off by {worst:.1e} from a cubic's root, and radii by {sampled:.1e} from them");
    ensure(worst < 1.0e-12 && sampled < 8.0e-7, || format!("{worst:e}, {sampled:e}"))
}

/// A profile is a mixture of two exponential distributions, the wider one three times as probable. Radii that are drawn by choosing one of
/// them have the density of those by the inverse.
pub(crate) fn mixtures_of_exponentials_agree() -> Result<(), Failed> {
    const CELLS: usize = 256;
    const DRAWS: u64 = 1 << 20;
    let radius = |index: u64, wide: f64| {
        let mut random = SplitMix::new(index);
        let d = if random.unit() < wide { 3.0 } else { 1.0 };
        -d * (-random.unit()).ln_1p()
    };
    let cell = |wide: f64| move |index| ((exact::cdf(radius(index, wide)) * CELLS as f64) as usize).min(CELLS - 1);
    let mut family = Family::new("mixtures", FAMILY_RATE);
    family.uniform("by the exact distribution function", CELLS, DRAWS, cell(0.75));
    println!("{}", family.verdict()?);
    let mut wrong = Family::new("mixtures of other shares", FAMILY_RATE);
    wrong.uniform("0.7 instead of 0.75", CELLS, DRAWS, cell(0.7));
    ensure(!wrong.passed(), || "other shares go unnoticed".to_owned())
}
