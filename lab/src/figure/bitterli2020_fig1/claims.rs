//! The claims of the figure and of its discussion, and what became of them.

use crate::bootstrap::Interval;

use super::ratio::{FEW_RESAMPLES, Per};
use super::{FORMS, Findings, Measured, PROPOSED, Stripes, TALBOT};
use crate::bench::{fit, report::known};
use crate::figure::claim::Claim;

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
    let of_scenes = [c1, c2, c3, b7, checks].into_iter().flat_map(|claims| findings.iter().flat_map(claims));
    of_scenes.chain(b6(stripes)).collect()
}

const MORE: [f64; 2] = [1.0, f64::INFINITY];

impl Findings {
    fn claim(&self, id: &'static str, text: &str, found: Option<String>, holds: Option<bool>) -> Claim {
        Claim { id, text: text.to_owned(), scene: self.subject.name.clone(), found: known(found), holds }
    }

    /// That a number lies in a range.
    fn within(&self, id: &'static str, text: &str, found: Option<Interval>, range: [f64; 2]) -> Claim {
        Claim::of_interval(id, text, &self.subject.name, found, range)
    }

    /// That Talbot's form needs more of something for equal RMAE.
    fn more(&self, id: &'static str, text: &str, setting: usize, per: Per) -> Claim {
        self.within(id, text, self.at_equal_rmae(setting, per), MORE)
    }

    fn at_equal_rmae(&self, setting: usize, per: Per) -> Option<Interval> {
        self.pairs[setting].at_equal_rmae(&self.subject.truth, per)
    }
}

/// With reuse of visibility, Talbot's form needs many more rays.
fn c1(f: &Findings) -> Vec<Claim> {
    const ID: &str = "B20, C1";
    let thrice = "with visibility reuse Talbot needs 3 times the shadow rays, or more, for equal RMAE";
    let rays = |text, found| f.within(ID, text, found, [TIMES_THE_RAYS, f64::INFINITY]);
    vec![
        f.more(ID, "with visibility reuse Talbot needs more shadow rays for equal RMAE", 0, Per::ShadowRay),
        rays(thrice, f.at_equal_rmae(0, Per::ShadowRay)),
        rays("the same for equal relMSE", f.pairs[0].at_equal_mse(&f.subject.truth, Per::ShadowRay)),
        rays("the same, RMAE, by the paper's count of rays", f.at_equal_rmae(0, Per::CountedRay)),
        rays("the same, RMAE, k = 6", f.at_equal_rmae(3, Per::ShadowRay)),
        f.more(ID, "with visibility reuse Talbot needs more time for equal RMAE", 0, Per::Second),
    ]
}

/// Without, what it gains does not pay.
fn c2(f: &Findings) -> Vec<Claim> {
    const ID: &str = "B21, C2";
    let little = "without visibility reuse Talbot's RMAE of a frame is at most 5 % smaller";
    vec![
        f.within(ID, little, f.pairs[1].gain_a_frame(&f.subject.truth), [f64::NEG_INFINITY, SLIGHTLY]),
        f.more(ID, "without it Talbot needs more evaluations for equal RMAE", 1, Per::Evaluation),
        f.more(ID, "without it Talbot needs more time for equal RMAE", 1, Per::Second),
    ]
}

/// The proposed form is as good or better in all settings.
fn c3(f: &Findings) -> Vec<Claim> {
    const ID: &str = "B22, C3";
    let [with, without] = [0, 1].map(|setting| f.at_equal_rmae(setting, Per::Second));
    let more = |found: Option<Interval>| found.and_then(|found| found.inside(MORE[0], MORE[1]));
    let holds = more(with).zip(more(without)).map(|(a, b)| a && b);
    let found = with.zip(without).map(|(a, b)| format!("{a} with, {b} without"));
    let text =
        "Talbot needs more time for equal RMAE with and without visibility reuse, visibility not in the selection";
    let ranks = [(Per::Frame, "frames"), (Per::ShadowRay, "shadow rays"), (Per::Second, "time")].map(|(per, what)| {
        let text = format!("with visibility in the selection Talbot needs more {what} for equal RMAE");
        f.more(ID, &text, 2, per)
    });
    [f.claim(ID, text, found, holds)].into_iter().chain(ranks).collect()
}

/// With few candidates, the approximate density is a poor one.
fn b7(f: &Findings) -> Vec<Claim> {
    let gaps: Option<Vec<Interval>> = f.candidates.iter().map(|pair| pair.gap(&f.subject.truth)).collect();
    let found = gaps.as_ref().map(|gaps| listed(gaps.iter().map(|gap| format!("{:.3}", gap.value))));
    // a step up that the intervals exclude refutes it, steps down that they exclude confirm it
    let holds = gaps.and_then(|gaps| {
        let steps = || gaps.windows(2).map(|pair| (pair[0].ends, pair[1].ends));
        if steps().any(|(a, b)| b[0] > a[1]) { Some(false) } else { steps().all(|(a, b)| b[1] < a[0]).then_some(true) }
    });
    let text = "the proposed form's squared error over Talbot's falls from 1 by way of 4 and 16 to 64 candidates";
    vec![f.claim("B7", text, found, holds)]
}

fn listed(found: impl Iterator<Item = String>) -> String {
    found.collect::<Vec<_>>().join(", ")
}

/// What has to be so for the rest to mean anything.
fn checks(f: &Findings) -> Vec<Claim> {
    let truth = &f.subject.truth;
    let measured = || f.pairs.iter().flat_map(|pair| &pair.of);
    let worst = measured().map(|m| m.chains.energy(truth).1.abs()).fold(0.0, f64::max);
    let limit = standard_errors(f.pairs[0].of[PROPOSED].chains.images.len());
    let rays: f64 = f.pairs[1].of.iter().map(|m| m.cost.combine_rays).sum();
    let slopes: Option<Vec<_>> = f.pairs[..2].iter().flat_map(|pair| &pair.of).map(|m| m.chains.slope(truth)).collect();
    let all = slopes.as_ref().map(|slopes| listed(slopes.iter().map(ToString::to_string)));
    let hold = slopes.map(|slopes| slopes.iter().all(|s| (s.value + 0.5).abs() <= s.half_width));
    let energy = "the mean is the reference's within 3 standard errors, all eight configurations";
    let falls = "the RMSE falls with the number of chains to the power of -1/2, all four curves";
    vec![
        f.claim("B24", energy, Some(format!("{worst:.2} standard errors at most")), Some(worst <= limit)),
        f.claim("B23", "no ray is traced for MIS without visibility reuse", Some(rays.to_string()), Some(rays == 0.0)),
        f.claim("B19", falls, all, hold),
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
            Interval::of_positive(images[0].len(), FEW_RESAMPLES, |times| {
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
    const ID: &str = "B6";
    let [_, striped] = &stripes.walls;
    let varies = FORMS.iter().zip(unlike(stripes)).flat_map(|((name, _), found)| {
        ["bright", "dark"].into_iter().zip(found).map(move |(stripe, found)| {
            let text =
                format!("{name}: the relative variance of the {stripe} stripes is larger than without the others");
            Claim::of_interval(ID, text, &striped.name, Some(found), MORE)
        })
    });
    let unchanged = FORMS.iter().zip(&stripes.of[1].of).map(|((name, _), Measured { chains, .. })| {
        let off = chains.energy(&striped.truth).1.abs();
        Claim {
            id: ID,
            text: format!("{name}: the mean is unchanged, within 3 standard errors"),
            scene: striped.name.clone(),
            found: format!("{off:.2} standard errors"),
            holds: Some(off <= standard_errors(chains.images.len())),
        }
    });
    varies.chain(unchanged).collect()
}
