//! The figures as a document.

use super::forms::Form;
use super::setting::Setting;
use super::toys::{Claim, Toy};
use super::trials::Row;
use crate::stats::{POWER, detectable_bias, two_sided_p};
use restir_shared::resample::mis::Mis;
use std::fmt::Write;

/// Standard errors that a row may be off.
pub const LIMIT: f64 = 3.0;

impl Row {
    /// Whether the mean is within [`LIMIT`] standard errors of the expectation.
    pub fn passed(&self) -> bool {
        self.z().abs() <= LIMIT
    }
}

impl Toy {
    /// Deviation of the selected and of the averaged estimate from 1, in standard errors.
    pub fn z(&self) -> [f64; 2] {
        [self.selected, self.averaged].map(|moments| (moments.mean() - 1.0) / moments.standard_error())
    }

    /// Whether the selected estimate is unbiased and the averaged one as claimed, by [`LIMIT`] standard errors.
    pub fn passed(&self) -> bool {
        let [selected, averaged] = self.z();
        let slack = LIMIT * self.averaged.standard_error();
        let claim = match self.claim {
            Claim::Unbiased => averaged.abs() <= LIMIT,
            Claim::Biased(low, high) | Claim::Near(low, high) => {
                (low - slack..=high + slack).contains(&self.averaged.mean())
            }
        };
        (selected.abs() <= LIMIT) & claim
    }
}

/// Mean and relative standard deviation of the toy whose table is not published, over 4 * 10^5 trials: rows as in
/// [`Form::ALL`], for visibility reuse with equal and with unequal confidence, and for equal confidence without reuse.
const PUBLISHED: [(Form, [[f64; 2]; 3]); 10] = {
    [
        (Form::Library(Mis::ONE_OVER_M), [[0.638, 1.07], [0.698, 2.45], [0.825, 1.16]]),
        (Form::Library(Mis::ONE_OVER_Z), [[1.001, 1.77], [0.993, 3.47], [0.997, 1.78]]),
        (Form::LiteralContribution, [[4.008, 5.70], [5.121, 7.64], [4.012, 6.15]]),
        (Form::Library(Mis::CONTRIBUTION), [[1.002, 1.43], [0.998, 1.81], [1.003, 1.54]]),
        (Form::LiteralTalbot, [[1.001, 1.05], [0.824, 0.94], [1.002, 1.00]]),
        (Form::Library(Mis::TALBOT), [[1.002, 1.05], [0.998, 1.12], [1.003, 1.00]]),
        (Form::Library(Mis::PAIRWISE_COUNTED), [[1.001, 0.978], [1.001, 1.02], [1.000, 0.988]]),
        (Form::Library(Mis::PAIRWISE), [[1.000, 0.980], [0.998, 1.09], [1.002, 0.987]]),
        (Form::Library(Mis::PAIRWISE_DEFENSIVE), [[1.002, 0.951], [0.998, 1.04], [1.002, 0.949]]),
        (Form::Library(Mis::PAIRWISE_COUNTED_DEFENSIVE), [[1.001, 0.949], [0.999, 0.98], [1.001, 0.949]]),
    ]
};

/// Mean and relative standard deviation of the published toy in a row, if it has the row.
pub fn published(row: &Row) -> Option<[f64; 2]> {
    let column = Setting::PUBLISHED.iter().position(|setting| *setting == row.setting)?;
    PUBLISHED.iter().find(|(form, _)| *form == row.form).map(|(_, columns)| columns[column])
}

const HEAD: &str = "# Resampling

The library's reservoirs and forms of MIS without a renderer, in `f64`, on a table of five pixels and twelve lights
(`tests/src/resampling/table.rs`): each pixel resamples its candidates, chosen uniformly among the lights, by its target, then
the canonical pixel combines all five. *Mean* is that of the shaded estimate relative to the truth, with its standard
error; *expected* is computed in closed form by independent formulas; a row passes within 3 standard errors of it. *Deviation*
is the standard deviation of one estimate. *Toy* has mean and deviation that an independent program had of
4 * 10^5 trials (+-0.003 and more) on another table of the same kind: the expectations of its biased rows were the
criterion by which the table's seed was chosen, so only the other figures of that column say something.

*Alg. 1 literal* and *Alg. 2 literal* are the algorithms as the supplement of Bitterli et al. 2020 prints them, which live in
the tests only. Their rows pass if they are as wrong as computed: too bright by the mean M, or biased for unequal M.

Z: an occluded initial sample loses its weight. Q: the target by which samples are selected has visibility. D: the
targets in the MIS weights have it. The final shading always traces.

Made by `cargo lab resampling --write`; `cargo test` runs the same rows with 4 * 10^5 trials.
";

/// All figures as a Markdown document.
pub fn markdown(rows: &[Row], toys: &[Toy]) -> String {
    let mut text = HEAD.to_owned();
    let mut line = |line: String| writeln!(text, "{line}").expect("a String takes all text");
    line("\n## One combine of five inputs\n".to_owned());
    let worst = rows.iter().map(|row| row.z().abs()).fold(0.0, f64::max);
    let unbiased = rows.iter().filter(|row| !row.is_biased());
    let error = unbiased.map(|row| row.measured.standard_error()).fold(0.0, f64::max);
    let alarm = two_sided_p(LIMIT);
    let bias = detectable_bias(error, alarm, POWER);
    line(format!(
        "{} of {} rows pass; the largest deviation is {worst:.2} standard errors. A right row fails with probability \
         {alarm:.4}, some one of {} independent ones with {:.2} (those of a setting share their candidates). A bias of \
         {bias:.1e} would be noticed with probability {POWER} in any of the unbiased rows.",
        rows.iter().filter(|row| row.passed()).count(),
        rows.len(),
        rows.len(),
        1.0 - (1.0 - alarm).powi(rows.len() as i32),
    ));
    for setting in rows.chunk_by(|a, b| a.setting == b.setting) {
        line(format!("\n### {}\n", setting[0].setting.name()));
        line(format!("{:.0e} trials.\n", setting[0].measured.parts()[0]));
        line("| form | mean | expected | z | | deviation | toy |".to_owned());
        line("|---|---:|---:|---:|---|---:|---:|".to_owned());
        for row in setting {
            line(table_row(row));
        }
    }
    line("\n## Averaged visibility\n".to_owned());
    line(AVERAGED.to_owned());
    if let Some(toy) = toys.first() {
        line(format!("{:.0e} trials a row.\n", toy.averaged.parts()[0]));
    }
    line("| merges | selected | deviation | averaged | deviation | claim | |".to_owned());
    line("|---|---:|---:|---:|---:|---|---|".to_owned());
    for toy in toys {
        line(toy_row(toy));
    }
    text
}

const AVERAGED: &str = "Estimates relative to the truth, shaded by the visibility of the sample selected, and by the mean \
over what competed (Tokuyoshi). The combines are of the table above without its zeros, M = 4, 8, 2, 16, 1; the chains of \
four pixels in a ring and six lights, each frame a merge with the history and perhaps one with the neighbour by Talbot's \
weights, in which *pixels far apart* differ by log-normal factors of deviation 1, *nearly alike* of 0.1. The target is the \
unshadowed radiance; occluded samples keep their weight. A row holds if the first estimate is 1 within 3 standard errors and
the second is 1, or in its range, within as many.
";

fn verdict(row: &Row) -> &'static str {
    match (row.passed(), row.form.is_literal() & row.is_biased(), row.is_biased()) {
        (false, ..) => "**off**",
        (true, true, _) => "wrong, as computed",
        (true, false, true) => "biased, as computed",
        (true, false, false) => "unbiased",
    }
}

fn table_row(row: &Row) -> String {
    let published = published(row).map_or_else(String::new, |[mean, deviation]| format!("{mean:.3}, {deviation:.2}"));
    format!(
        "| {} | {:.5} +- {:.5} | {:.5} | {:+.2} | {} | {:.3} | {published} |",
        row.form.name(),
        row.measured.mean(),
        row.measured.standard_error(),
        row.expected,
        row.z(),
        verdict(row),
        row.relative_deviation(),
    )
}

fn toy_row(toy: &Toy) -> String {
    let cell = |moments: crate::stats::Moments| {
        format!("{:.4} +- {:.4} | {:.3}", moments.mean(), moments.standard_error(), moments.variance().sqrt())
    };
    let claim = match toy.claim {
        Claim::Unbiased => "unbiased".to_owned(),
        Claim::Biased(low, high) => format!("biased: {low} to {high}"),
        Claim::Near(low, high) => format!("hardly biased: {low} to {high}"),
    };
    let verdict = if toy.passed() { "holds" } else { "**off**" };
    format!("| {} | {} | {} | {claim} | {verdict} |", toy.name, cell(toy.selected), cell(toy.averaged))
}
