//! What the checks share.

use glam::{UVec4, Vec2, Vec3};
use libtest_mimic::Failed;
use restir_shared::rng::{self, pcg4d};
use restir_tests::stats::Family;

/// How often a check fails that should not.
pub(crate) const FAMILY_RATE: f64 = 1.0e-3;
/// Samples of a test.
pub(crate) const DRAWS: u64 = 1 << 20;
/// Half the distance between 1 and its neighbour, the error of one rounding.
pub(crate) const ROUNDING: f64 = 1.0 / 16_777_216.0;

/// Random words for the samplers.
pub(crate) fn words(i: u64, stream: u32) -> [u32; 4] {
    pcg4d(UVec4::new(i as u32, stream, 11, 13)).to_array()
}

/// Uniform numbers for the samplers.
pub(crate) fn numbers(i: u64, stream: u32) -> Vec2 {
    let words = words(i, stream);
    Vec2::new(rng::unit(words[0]), rng::unit(words[1]))
}

pub(crate) fn family(what: &str) -> Family {
    Family::new(what, FAMILY_RATE)
}

/// Prints the verdict of a family that passes.
pub(crate) fn report(family: &Family) -> Result<(), Failed> {
    println!("{}", family.verdict()?);
    Ok(())
}

pub(crate) fn wide3(v: Vec3) -> [f64; 3] {
    v.to_array().map(f64::from)
}

pub(crate) fn wide2(v: Vec2) -> [f64; 2] {
    v.to_array().map(f64::from)
}
