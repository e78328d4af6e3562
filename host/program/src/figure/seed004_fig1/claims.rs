//! The claims of the figure and of its discussion, and what became of them.

use restir::bootstrap::{Interval, mean};

use super::ratio::{Per, judged};
use super::{CANDIDATES, FORMS, Findings, PROPOSED, Pair, Stripes, TALBOT};
use crate::bench::error::Truth;
use crate::bench::fit;
use crate::bench::report::REFUSED;
use crate::figure::claim::Claim;

const RESAMPLES: u32 = 300;
/// Of single tests, 3 in 1000 are further off if the standard error is known.
const STANDARD_ERRORS: f64 = 3.0;

/// As many standard errors that were estimated from so many chains.
pub(super) fn standard_errors(chains: usize) -> f64 {
    fit::student_of_normal(STANDARD_ERRORS, chains - 1)
}

/// What C1 says of rays, and C2 of the error of a frame.
const TIMES_THE_RAYS: f64 = 3.0;
const SLIGHTLY: f64 = 0.05;

/// All of them.
pub(super) fn claims(findings: &[Findings], stripes: &Stripes) -> Vec<Claim> {
    let mut claims = Vec::new();
    for each in [c1, c2, c3, b7, checks] {
        claims.extend(findings.iter().flat_map(each));
    }
    claims.extend(b6(stripes));
    claims
}

impl Findings {
    fn claim(&self, id: &'static str, text: impl Into<String>, found: Option<String>, holds: Option<bool>) -> Claim {
        let scene = self.subject.name.clone();
        Claim { id, text: text.into(), scene, found: found.unwrap_or_else(|| REFUSED.to_owned()), holds }
    }

    /// That a number lies between `low` and `high`.
    fn interval(
        &self,
        id: &'static str,
        text: impl Into<String>,
        found: Option<Interval>,
        [low, high]: [f64; 2],
    ) -> Claim {
        self.claim(id, text, found.map(|found| found.to_string()), found.and_then(|found| found.inside(low, high)))
    }

    fn at_equal_rmae(&self, pair: usize, per: Per) -> Option<Interval> {
        self.pairs[pair].at_equal_rmae(&self.subject.truth, per)
    }

    fn at_equal_mse(&self, pair: usize, per: Per) -> Option<Interval> {
        self.pairs[pair].at_equal_mse(&self.subject.truth, per)
    }
}

const MORE: [f64; 2] = [1.0, f64::INFINITY];

/// With reuse of visibility, Talbot's form needs many more rays.
fn c1(f: &Findings) -> Vec<Claim> {
    let rays = |text: &str, found| f.interval("B20, C1", text, found, [TIMES_THE_RAYS, f64::INFINITY]);
    vec![
        f.interval(
            "B20, C1",
            "with visibility reuse Talbot needs more shadow rays for equal RMAE",
            f.at_equal_rmae(0, Per::ShadowRay),
            MORE,
        ),
        rays(
            "with visibility reuse Talbot needs 3 times the shadow rays, or more, for equal RMAE",
            f.at_equal_rmae(0, Per::ShadowRay),
        ),
        rays("the same for equal relMSE", f.at_equal_mse(0, Per::ShadowRay)),
        rays("the same, RMAE, by the paper's count of rays", f.at_equal_rmae(0, Per::CountedRay)),
        rays("the same, RMAE, k = 6", f.at_equal_rmae(3, Per::ShadowRay)),
        f.interval(
            "B20, C1",
            "with visibility reuse Talbot needs more time for equal RMAE",
            f.at_equal_rmae(0, Per::Second),
            MORE,
        ),
    ]
}

/// Without, what it gains does not pay.
fn c2(f: &Findings) -> Vec<Claim> {
    let gain = f.pairs[1].gain_a_frame(&f.subject.truth);
    vec![
        f.interval(
            "B21, C2",
            "without visibility reuse Talbot's RMAE of a frame is at most 5 % smaller",
            gain,
            [f64::NEG_INFINITY, SLIGHTLY],
        ),
        f.interval(
            "B21, C2",
            "without it Talbot needs more evaluations for equal RMAE",
            f.at_equal_rmae(1, Per::Evaluation),
            MORE,
        ),
        f.interval(
            "B21, C2",
            "without it Talbot needs more time for equal RMAE",
            f.at_equal_rmae(1, Per::Second),
            MORE,
        ),
    ]
}

/// The proposed form is as good or better in all settings.
fn c3(f: &Findings) -> Vec<Claim> {
    let all = [0, 1].map(|pair| f.at_equal_rmae(pair, Per::Second));
    let holds =
        all[0].and_then(|a| a.inside(1.0, f64::INFINITY)).zip(all[1].and_then(|b| b.inside(1.0, f64::INFINITY)));
    let both = all[0].zip(all[1]).map(|(a, b)| format!("{a} with, {b} without"));
    let ranks = [(Per::Frame, "frames"), (Per::ShadowRay, "shadow rays"), (Per::Second, "time")];
    let mut claims = vec![f.claim(
        "B22, C3",
        "Talbot needs more time for equal RMAE with and without visibility reuse, visibility not in the selection",
        both,
        holds.map(|(a, b)| a && b),
    )];
    claims.extend(ranks.map(|(per, what)| {
        let text = format!("with visibility in the selection Talbot needs more {what} for equal RMAE");
        f.interval("B22, C3", text, f.at_equal_rmae(2, per), MORE)
    }));
    claims
}

/// How much better Talbot's form is, a frame, in squared error.
fn gap(pair: &Pair, truth: &Truth) -> Option<Interval> {
    let errors = [PROPOSED, TALBOT].map(|form| pair.of[form].chains.errors(truth, 1));
    let [proposed, talbot] = errors.each_ref().map(|errors| errors.iter().map(|e| e.rel_mse).collect::<Vec<_>>());
    let ratio =
        |times: &[f64]| (mean(&proposed, times) - truth.relative_noise) / (mean(&talbot, times) - truth.relative_noise);
    errors.iter().all(|errors| judged(errors, truth)).then(|| Interval::of_positive(proposed.len(), RESAMPLES, ratio))
}

/// The gap for each number of candidates.
pub(super) fn gaps(f: &Findings) -> Vec<(u32, Option<Interval>)> {
    CANDIDATES.into_iter().zip(f.candidates.iter().map(|pair| gap(pair, &f.subject.truth))).collect()
}

/// With few candidates, the approximate density is a poor one.
fn b7(f: &Findings) -> Vec<Claim> {
    let gaps: Option<Vec<Interval>> = gaps(f).into_iter().map(|(_, gap)| gap).collect();
    let found =
        gaps.as_ref().map(|gaps| gaps.iter().map(|gap| format!("{:.3}", gap.value)).collect::<Vec<_>>().join(", "));
    // a step up that the intervals exclude refutes it, steps down that they exclude confirm it
    let holds = gaps.and_then(|gaps| {
        let steps = || gaps.windows(2).map(|pair| (pair[0].ends, pair[1].ends));
        if steps().any(|(a, b)| b[0] > a[1]) { Some(false) } else { steps().all(|(a, b)| b[1] < a[0]).then_some(true) }
    });
    let text = "the proposed form's squared error over Talbot's falls from 1 by way of 4 and 16 to 64 candidates";
    vec![f.claim("B7", text, found, holds)]
}

/// What has to be so for the rest to mean anything.
fn checks(f: &Findings) -> Vec<Claim> {
    let truth = &f.subject.truth;
    let measured = || f.pairs.iter().flat_map(|pair| &pair.of);
    let worst = measured().map(|m| m.chains.energy(truth).1.abs()).fold(0.0, f64::max);
    let limit = standard_errors(f.pairs[0].of[PROPOSED].chains.images.len());
    let rays: f64 = f.pairs[1].of.iter().map(|m| m.cost.combine_rays).sum();
    let slopes: Option<Vec<_>> = f.pairs[..2].iter().flat_map(|pair| &pair.of).map(|m| m.chains.slope(truth)).collect();
    let listed = slopes.as_ref().map(|slopes| {
        slopes.iter().map(|s| format!("{:.3} ± {:.3}", s.value, s.half_width)).collect::<Vec<_>>().join(", ")
    });
    let energy = format!("{worst:.2} standard errors at most");
    vec![
        f.claim(
            "B24",
            "the mean is the reference's within 3 standard errors, all eight configurations",
            Some(energy),
            Some(worst <= limit),
        ),
        f.claim("B23", "no ray is traced for MIS without visibility reuse", Some(format!("{rays}")), Some(rays == 0.0)),
        f.claim(
            "B19",
            "the RMSE falls with the number of chains to the power of -1/2, all four curves",
            listed,
            slopes.map(|slopes| slopes.iter().all(|s| (s.value + 0.5).abs() <= s.half_width)),
        ),
    ]
}

/// How much more the striped wall varies, of the bright stripes and of the dark ones, by form.
pub(super) fn unlike(stripes: &Stripes) -> [[Interval; 2]; FORMS.len()] {
    let [plain, striped] = stripes.walls.each_ref().map(|wall| &wall.truth.values);
    let is_dark: Vec<bool> = plain.iter().zip(striped).map(|(plain, striped)| *striped < 0.1 * plain).collect();
    [PROPOSED, TALBOT].map(|form| {
        [false, true].map(|dark| {
            let class: Vec<usize> = (0..is_dark.len()).filter(|&i| is_dark[i] == dark).collect();
            let images = stripes.of.each_ref().map(|pair| &pair.of[form].chains.images);
            Interval::of_positive(images[0].len(), RESAMPLES, |times| {
                relative_variance(images[1], striped, &class, times)
                    / relative_variance(images[0], plain, &class, times)
            })
        })
    })
}

/// Variance of the given values over that of their squared truth; images count `times` each.
fn relative_variance(images: &[Vec<f64>], truth: &[f64], class: &[usize], times: &[f64]) -> f64 {
    let count: f64 = times.iter().sum();
    let variance = |&i: &usize| {
        let (sum, squares) = images.iter().zip(times).fold((0.0, 0.0), |(sum, squares), (image, times)| {
            (sum + times * image[i], squares + times * image[i] * image[i])
        });
        (squares - sum * sum / count) / (count - 1.0)
    };
    class.iter().map(variance).sum::<f64>() / class.iter().map(|&i| truth[i] * truth[i]).sum::<f64>()
}

/// Targets of neighbours whose integrals differ a hundredfold.
fn b6(stripes: &Stripes) -> Vec<Claim> {
    let claim =
        |text: String, found: String, holds| Claim { id: "B6", text, scene: "striped wall".to_owned(), found, holds };
    let mut claims = Vec::new();
    for ((name, _), [bright, dark]) in FORMS.iter().zip(unlike(stripes)) {
        for (stripe, found) in [("bright", bright), ("dark", dark)] {
            let text =
                format!("{name}: the relative variance of the {stripe} stripes is larger than without the others");
            claims.push(claim(text, found.to_string(), found.inside(1.0, f64::INFINITY)));
        }
    }
    for (form, (name, _)) in FORMS.iter().enumerate() {
        let measured = &stripes.of[1].of[form];
        let off = measured.chains.energy(&stripes.walls[1].truth).1.abs();
        let text = format!("{name}: the mean is unchanged, within 3 standard errors");
        claims.push(claim(
            text,
            format!("{off:.2} standard errors"),
            Some(off <= standard_errors(measured.chains.images.len())),
        ));
    }
    claims
}
