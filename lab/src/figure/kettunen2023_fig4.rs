//! Kettunen et al. 2023, figure 4: error by the number of integration prefixes, with a canonical suffix for each or for some of them.

use restir::Error;

use super::chains::Protocol;
use super::claim::{self, Claim};
use super::prefixes::{Measured, SCENE, files, measured};
use super::{Environs, Files};
use crate::bench::table::Setup;

/// Numbers of integration prefixes.
const PREFIXES: [u32; 5] = [1, 2, 4, 8, 16];
/// One of so many of them has a canonical suffix: of each, of four by default, and of all as published.
const CANONICAL: [u32; 3] = [1, 4, 128];
/// The part of the rays that is saved, at least, and how much the error grows, at most: what the specification takes the claim for.
const SAVED: f64 = 0.6;
const LOST: f64 = 1.1;

/// The files of the figure.
///
/// # Errors
/// As of [`measured`].
pub(crate) fn make(environs: &mut impl Environs, protocol: Protocol, setup: &Setup) -> Result<Files, Error> {
    let of = |canonical: u32| PREFIXES.map(|prefixes| format!("prefixes={prefixes},canonical={canonical}")).to_vec();
    let rows = measured(environs, protocol, &CANONICAL.map(of).concat())?;
    let text = "# Error by the number of integration prefixes\n\nFigure 4 of Kettunen et al. 2023, *Conditional Resampled Importance Sampling and \
                ReSTIR*: of `prefixes` integration prefixes one of `canonical` has a suffix of its own, which counts for the others, too; 128 is one a pixel.\n";
    Ok(files(text, protocol, &claims(&rows), &rows, setup))
}

fn claims(rows: &[Measured]) -> Vec<Claim> {
    let curves: Vec<&[Measured]> = rows.chunks_exact(PREFIXES.len()).collect();
    let names = ["one for each", "one for four", "one a pixel"];
    let falls = names.iter().zip(&curves).map(|(name, curve)| falls(name, curve));
    let savings = names.iter().zip(&curves).skip(1).flat_map(|(name, curve)| saves(name, curve, curves[0]));
    falls.chain(savings).collect()
}

/// That the error falls with each doubling.
fn falls(name: &str, curve: &[Measured]) -> Claim {
    let steps: Vec<_> = curve.windows(2).map(|pair| pair[1].over(&pair[0])).collect();
    let holds = claim::all(steps.iter().map(|step| step.inside(f64::NEG_INFINITY, 1.0)));
    let found = steps.iter().map(ToString::to_string).collect::<Vec<_>>().join("; ");
    let text = format!("with {name}, error falls with every doubling of prefixes: quotients of relMSE");
    Claim::new("K4", text, SCENE, found, holds)
}

/// That most prefixes can do without, beside `each` of them having one: of rays and of error, for the most prefixes.
fn saves(name: &str, curve: &[Measured], each: &[Measured]) -> Vec<Claim> {
    let (Some(some), Some(each)) = (curve.last(), each.last()) else { return Vec::new() };
    let saved = 1.0 - some.rays / each.rays;
    let most = PREFIXES[PREFIXES.len() - 1];
    let rays = format!("with {name}, at least 60 % of the rays of {most} prefixes are saved");
    let error = format!("with {name}, {most} prefixes have at most 1.1 times the error");
    vec![
        Claim::new("K4", rays, SCENE, format!("{:.0} %", 100.0 * saved), Some(saved >= SAVED)),
        Claim::of_interval("K4", error, SCENE, Some(some.over(each)), [f64::NEG_INFINITY, LOST]),
    ]
}
