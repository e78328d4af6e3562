//! The report in Markdown.

use std::fmt::Display;

use restir::technique::{Integral, PixelFilter};

use super::against::{Change, Ratio};
use super::equal_time::{self, Comparison};
use super::error::{LARGEST_DOUBT, LARGEST_SHARE, SMALL_SHARE, Truth};
use super::table::{Row, Setup};
use super::{Cell, SceneResult, Series, estimator::PerSample, fit, timed::PassTime};

/// What stands instead of a figure that the reference cannot give.
pub(crate) const REFUSED: &str = "reference too noisy";
/// The relMSE to which times are given, where they were measured.
const TARGETS: [f64; 5] = [10.0, 1.0, 0.1, 0.01, 0.001];

/// All of a report.
pub(crate) struct Report<'a> {
    pub(crate) setup: &'a Setup,
    pub(crate) results: &'a [SceneResult],
    /// Restarts that were asked for.
    pub(crate) restarts: u32,
    /// The table to compare with, and what has changed.
    pub(crate) against: Option<(String, Vec<Change>)>,
}

/// The report as Markdown.
pub(crate) fn markdown(report: &Report<'_>) -> String {
    let mut text = heading(report.setup);
    report.results.iter().for_each(|result| text += &scene(result, report.restarts));
    if let Some((name, changes)) = &report.against {
        text += &comparison(name, changes);
    }
    text
}

fn heading(setup: &Setup) -> String {
    let Integral { max_depth, jitter, filter, multiscatter } = setup.picture.integral;
    let pixel = match filter {
        _ if !jitter => "through the pixel's centre",
        PixelFilter::Box => "spread over the pixel",
        PixelFilter::BlackmanHarris => "spread by the Blackman-Harris filter",
        _ => "spread by a filter",
    };
    let scattering = if multiscatter { "" } else { ", specular lobes of single scattering" };
    format!(
        "# Error against run time\n\n{}\n\
         Errors are over all values (three a pixel), against a reference whose own noise was subtracted from MSE and \
         relMSE (denominator ref² + 0.01 mean²); where that noise is more than {:.0} % of what was measured, or two standard errors of it \
         more than {:.0} % of what is left, the figure is refused: *{REFUSED}*. MAPE (denominator ref + 0.01 mean) is as \
         measured, and refused from {:.0} % of noise on, as is the slope. Restarts are \
         interleaved; each makes as many images of every number of samples as together have the samples of the largest, all \
         with seeds of their own. Times are medians; `±` is half of a 95 % interval.\n",
        setup.markdown(&format!(", paths of up to {max_depth} segments, {pixel}{scattering}")),
        100.0 * LARGEST_SHARE,
        100.0 * LARGEST_DOUBT,
        100.0 * SMALL_SHARE,
    )
}

/// What does not end a cell of a table.
pub(super) fn one_line(text: &str) -> String {
    text.replace(['\n', '\r', '`', '|'], " ")
}

fn scene(result: &SceneResult, restarts: u32) -> String {
    let SceneResult { scene, plot, truth, reference_samples, .. } = result;
    let rows = |row: fn(&Truth, &Series) -> String| -> String {
        result.series.iter().map(|series| row(truth, series)).collect()
    };
    format!(
        "\n## {}\n\n![relMSE against time]({plot})\n\n\
         Reference: {reference_samples} samples a pixel in two halves, mean {:.6} ± {:.6}, its noise adds {:.2e} to an MSE and \
         {:.2e} to a relMSE. Restarts: {} of {restarts}.\n\n\
         | technique | spp | time, ms | RMSE | relMSE | MAPE | bias of the mean |\n|---|---:|---:|---:|---:|---:|---:|\n{}\n\
         | technique | slope of log RMSE over log spp | closest rays | shadow rays | surfaces | light samples | dropped |\n\
         |---|---:|---:|---:|---:|---:|---:|\n{}\n\
         Rays and evaluations are a sample's mean. Time in seconds to a relMSE of:\n\n\
         | technique |{}\n|---|---:|---:|---:|---:|---:|\n{}{}\n\
         | technique | pass | dispatches | ms a dispatch | share of the time | Mrays/s |\n|---|---|---:|---:|---:|---:|\n{}",
        one_line(scene),
        truth.mean,
        fit::NORMAL * truth.mean_error,
        truth.noise,
        truth.relative_noise,
        result.restarts,
        rows(cells),
        rows(costs),
        TARGETS.map(|target| format!(" {target} |")).concat(),
        rows(times_to_error),
        equal_time(result),
        rows(passes),
    )
}

fn cells(truth: &Truth, series: &Series) -> String {
    let row = |cell: &Cell| {
        let bias = cell.bias(truth);
        format!(
            "| {} | {} | {:.2} | {} | {} | {} | {:+.3} % ± {:.3} % |\n",
            series.technique.name,
            cell.samples,
            1e3 * cell.seconds(),
            known(cell.mse(truth).corrected().map(|mse| format!("{:.4e}", mse.sqrt()))),
            known(cell.rel_mse(truth).corrected().map(|rel_mse| format!("{rel_mse:.4e}"))),
            known(cell.mape(truth).map(|mape| format!("{mape:.4}"))),
            100.0 * bias.value,
            100.0 * bias.half_width,
        )
    };
    series.cells.iter().map(row).collect()
}

/// What was found, unless the reference is too noisy for it.
pub(crate) fn known(found: Option<impl Display>) -> String {
    found.map_or_else(|| REFUSED.to_owned(), |found| found.to_string())
}

/// What was found, if anything was.
pub(crate) fn if_any(found: Option<impl Display>) -> String {
    found.map_or_else(|| "-".to_owned(), |found| found.to_string())
}

fn costs(truth: &Truth, series: &Series) -> String {
    let slope = if_any(series.convergence(truth));
    let PerSample { closest, shadow, surfaces, light_samples } = series.per_sample();
    let dropped: u64 = series.cells.iter().flat_map(|cell| &cell.runs).map(|run| run.dropped_samples).sum();
    let name = &series.technique.name;
    format!("| {name} | {slope} | {closest:.3} | {shadow:.3} | {surfaces:.3} | {light_samples:.3} | {dropped} |\n")
}

fn times_to_error(truth: &Truth, series: &Series) -> String {
    let points = series.error_over_time(truth);
    let time = |target| if_any(fit::time_to_error(&points, target).map(|seconds| format!("{seconds:.4}")));
    format!("| {} |{}\n", series.technique.name, TARGETS.map(|target| format!(" {} |", time(target))).concat())
}

/// What reuse gains, if there is any, over the best technique without.
fn equal_time(result: &SceneResult) -> String {
    let Some((baseline, comparisons)) = equal_time::compare(result) else { return String::new() };
    let row = |(series, comparison): (&Series, Option<Comparison>)| {
        let figures = comparison.map_or_else(|| format!("{REFUSED} | - | "), compared);
        format!("| {} | {figures} |\n", series.technique.name)
    };
    format!(
        "\nEqual time: beside `{}`, whose squared error times run time is the smallest without reuse. Errors are of the largest \
         number of samples, over the baseline's after the same time; brackets are 95 % intervals over restarts.\n\n\
         | technique | time of a sample | relMSE at equal time | |\n|---|---:|---:|---|\n{}",
        result.series[baseline].technique.name,
        result.series.iter().zip(comparisons).map(row).collect::<String>(),
    )
}

fn compared(comparison: Comparison) -> String {
    let Comparison { time, error, reuses } = comparison;
    let verdict = match comparison.pays() {
        _ if !reuses => "",
        Some(true) => "reuse pays",
        Some(false) => "**reuse does not pay**",
        None => "undecided",
    };
    let [low, high] = [-error.half_width, error.half_width].map(|by| error.value * by.exp());
    format!("{time:.2} | {:.3} [{low:.3}, {high:.3}] | {verdict}", error.value)
}

fn passes(_: &Truth, series: &Series) -> String {
    let total: f64 = series.passes.values().map(|pass| pass.seconds).sum();
    let row = |(kernel, pass): (&&str, &PassTime)| {
        format!(
            "| {} | {kernel} | {} | {:.3} | {:.1} % | {} |\n",
            series.technique.name,
            pass.dispatches,
            1e3 * pass.seconds / pass.dispatches as f64,
            100.0 * pass.seconds / total,
            if_any(series.mega_rays(kernel).map(|rays| format!("{rays:.2}"))),
        )
    };
    series.passes.iter().map(row).collect()
}

/// The changes as a section of the report.
fn comparison(name: &str, changes: &[Change]) -> String {
    let ratio = |ratio: Option<Ratio>| {
        ratio.map_or_else(|| "not judged".to_owned(), |ratio| format!("{:.3} of {:.3}", ratio.value, ratio.limit))
    };
    let row = |change: &Change| {
        let Row { scene, technique, spp, .. } = &change.row;
        let verdict = if change.worse() { "**worse**" } else { "" };
        format!("| {scene} | {technique} | {spp} | {} | {} | {verdict} |\n", ratio(change.time), ratio(change.error))
    };
    let found = match changes {
        [] => "The tables have no scene, size, technique and number of samples in common.\n".to_owned(),
        _ => format!(
            "New over old at equal samples, and the ratio from which on it counts as worse.\n\n\
             | scene | technique | spp | time | squared error | |\n|---|---|---:|---:|---:|---|\n{}",
            changes.iter().map(row).collect::<String>()
        ),
    };
    format!("\n## Against {}\n\n{found}", one_line(name))
}

#[cfg(test)]
mod tests {
    use super::super::tests::{furnace, setup};
    use super::*;

    /// The report of one scene.
    fn report(result: SceneResult) -> String {
        markdown(&Report { setup: &setup(), results: &[result], restarts: 6, against: None })
    }

    #[test]
    fn a_report_has_every_table_complete() {
        let text = report(furnace());
        for word in
            ["a machine", "c0ffee", "`cargo lab bench`", "(furnace.svg)", "2048 samples", "film_resolve", "6 of 6"]
        {
            assert!(text.contains(word), "{word} is not in\n{text}");
        }
        let columns = |line: &str| line.matches('|').count();
        for table in text.split("\n\n").filter(|part| part.starts_with('|')) {
            let first = table.lines().next().map(columns);
            assert!(table.lines().all(|line| Some(columns(line)) == first), "a ragged table:\n{table}");
        }
    }

    #[test]
    fn refused_figures_are_named_so() {
        let mut result = furnace();
        result.truth.noise = 1.0;
        let text = report(result);
        // both techniques, five budgets, RMSE and MAPE; and the sentence that explains it
        assert_eq!(text.matches(REFUSED).count(), 2 * 5 * 2 + 1, "{text}");
    }
}
