//! Kettunen et al. 2023, figure 3: error by the number of borrowed suffixes, of reused and of new ones.

use restir::Error;
use restir_shared::technique::restir_suffix::MAX_BORROWED;

use super::chains::Protocol;
use super::claim::{self, Claim};
use super::prefixes::{Measured, SCENE, files, measured};
use super::{Environs, Files};
use crate::bench::table::Setup;
use crate::bootstrap::Interval;

/// What "nearly as good" is taken for.
const NEARLY: f64 = 1.25;
/// How far the rays may be from k² + k.
const NEAR: f64 = 0.1;

/// The files of the figure.
///
/// # Errors
/// As of [`measured`].
pub(crate) fn make(environs: &mut impl Environs, protocol: Protocol, setup: &Setup) -> Result<Files, Error> {
    let with =
        |preset: &str| (1..=MAX_BORROWED).map(move |k| format!("preset={preset},borrowed={k}")).collect::<Vec<_>>();
    let rows = measured(environs, protocol, &[with("quality"), with("mmis")].concat())?;
    let text = "# Error by the number of borrowed suffixes\n\nFigure 3 of Kettunen et al. 2023, *Conditional Resampled Importance Sampling and \
                ReSTIR*: each integration prefix borrows k suffixes, which are reused (`quality`) or new in every frame (`mmis`).\n";
    Ok(files(text, protocol, &claims(&rows), &rows, setup))
}

fn claims(rows: &[Measured]) -> Vec<Claim> {
    let (ours, new) = rows.split_at(rows.len() / 2);
    let ([one, .., most], Some(of_new)) = (ours, new.last()) else { return Vec::new() };
    let below = |high: f64| [f64::NEG_INFINITY, high];
    let claim = |text: &str, found: Interval, high| Claim::of_interval("K3", text, SCENE, Some(found), below(high));
    vec![
        claim("one reused suffix has less error than four new ones: quotient of relMSE", one.over(of_new), 1.0),
        claim("one is nearly as good as four: quotient of relMSE, at most 1.25", one.over(most), NEARLY),
        quadratic(ours),
    ]
}

/// That rays grow as k² + k, which is how many shifts there are: as they do from one suffix to the most.
fn quadratic(ours: &[Measured]) -> Claim {
    let shifts = |k: usize| (k * k + k) as f64;
    let slope = |k: usize| (ours[k - 1].rays - ours[0].rays) / (shifts(k) - shifts(1));
    let slopes: Vec<f64> = (2..=ours.len()).map(slope).collect();
    let last = slopes[slopes.len() - 1];
    let holds = claim::all(slopes.iter().map(|slope| Some((slope / last - 1.0).abs() < NEAR)));
    let found = slopes.iter().map(|slope| format!("{slope:.3}")).collect::<Vec<_>>().join(", ");
    let text = "rays grow as k² + k: rays a pixel for each, from one suffix to two, three, ... within 10 %";
    Claim::new("K3", text, SCENE, found, holds)
}
