//! The report in Markdown.

use std::fmt::Write;

use super::against::{Change, Ratio};
use super::equal_time::{self, Comparison};
use super::error::{Figure, LARGEST_DOUBT, LARGEST_SHARE, SMALL_SHARE};
use super::estimator::PerSample;
use super::fit::{self, Estimate};
use super::table::Setup;
use super::{SceneResult, Series};
use restir::reference::Picture;

/// What stands instead of a figure that the reference cannot give.
pub(crate) const REFUSED: &str = "reference too noisy";
/// The relMSE to which times are given, where they were measured.
const TARGETS: [f64; 5] = [10.0, 1.0, 0.1, 0.01, 0.001];

/// All of a report.
pub(crate) struct Report<'a> {
    pub(crate) setup: &'a Setup,
    pub(crate) command: &'a str,
    pub(crate) results: &'a [SceneResult],
    /// Restarts that were asked for.
    pub(crate) restarts: u32,
    /// The table to compare with, and what has changed.
    pub(crate) against: Option<(String, Vec<Change>)>,
}

/// The report as Markdown; `plot` names the plot of a scene.
pub(crate) fn markdown(report: &Report<'_>, plot: impl Fn(&str) -> String) -> String {
    let mut text = heading(report);
    for result in report.results {
        text += &scene(report, result, &plot(&result.scene));
    }
    if let Some((name, changes)) = &report.against {
        text += &comparison(name, changes);
    }
    text
}

fn heading(report: &Report<'_>) -> String {
    let Setup { machine, device, commit, picture: Picture { size: [width, height], integral } } = report.setup;
    let pixel = if integral.jitter { "spread over the pixel" } else { "through the pixel's centre" };
    format!(
        "# Error against run time\n\n\
         | | |\n|---|---|\n\
         | command | `{}` |\n\
         | machine | {machine} |\n\
         | device | {device} |\n\
         | commit | {commit} |\n\
         | images | {width} x {height} pixels, paths of up to {} segments, {pixel} |\n\n\
         Errors are over all values (three a pixel), against a reference whose own noise was subtracted from MSE and \
         relMSE (denominator ref² + 0.01 mean²); where that noise is more than {:.0} % of what was measured, or two standard errors of it \
         more than {:.0} % of what is left, the figure is refused: *{REFUSED}*. MAPE (denominator ref + 0.01 mean) is as \
         measured, and refused from {:.0} % of noise on, as is the slope. Restarts are \
         interleaved; each makes as many images of every number of samples as together have the samples of the largest, all \
         with seeds of their own. Times are medians; `±` is half of a 95 % interval.\n",
        one_line(report.command),
        integral.max_depth,
        100.0 * LARGEST_SHARE,
        100.0 * LARGEST_DOUBT,
        100.0 * SMALL_SHARE,
    )
}

fn one_line(text: &str) -> String {
    text.replace(['\n', '\r', '`', '|'], " ")
}

fn scene(report: &Report<'_>, result: &SceneResult, plot: &str) -> String {
    let truth = &result.truth;
    let mut text = format!("\n## {}\n\n![relMSE against time]({plot})\n\n", one_line(&result.scene));
    let _ = writeln!(
        text,
        "Reference: {} samples a pixel in two halves, mean {:.6} ± {:.6}, its noise adds {:.2e} to an MSE and {:.2e} to a \
         relMSE. Restarts: {} of {}.\n",
        result.reference_samples,
        truth.mean,
        fit::NORMAL * truth.mean_error,
        truth.noise,
        truth.relative_noise,
        result.restarts,
        report.restarts
    );
    text += "| technique | spp | time, ms | RMSE | relMSE | MAPE | bias of the mean |\n|---|---:|---:|---:|---:|---:|---:|\n";
    result.series.iter().for_each(|series| text += &cells(result, series));
    text += "\n| technique | slope of log RMSE over log spp | closest rays | shadow rays | surfaces | light samples | dropped |\n\
             |---|---:|---:|---:|---:|---:|---:|\n";
    result.series.iter().for_each(|series| text += &costs(result, series));
    text += "\nRays and evaluations are a sample's mean. Time in seconds to a relMSE of:\n\n| technique |";
    TARGETS.iter().for_each(|target| text += &format!(" {target} |"));
    text += "\n|---|---:|---:|---:|---:|---:|\n";
    result.series.iter().for_each(|series| text += &times_to_error(result, series));
    text += &equal_time(result);
    text += "\n| technique | pass | dispatches | ms a dispatch | share of the time | Mrays/s |\n|---|---|---:|---:|---:|---:|\n";
    result.series.iter().for_each(|series| text += &passes(series));
    text
}

fn cells(result: &SceneResult, series: &Series) -> String {
    let row = |cell: &super::Cell| {
        let bias = cell.bias(&result.truth);
        format!(
            "| {} | {} | {:.2} | {} | {} | {} | {:+.3} % ± {:.3} % |\n",
            series.technique.name,
            cell.samples,
            1e3 * cell.seconds(),
            figure(cell.mse(&result.truth), f64::sqrt),
            figure(cell.rel_mse(&result.truth), |error| error),
            cell.mape(&result.truth).map_or_else(|| REFUSED.to_owned(), |mape| format!("{mape:.4}")),
            100.0 * bias.value,
            100.0 * bias.half_width,
        )
    };
    series.cells.iter().map(row).collect()
}

fn figure(figure: Figure, of: impl Fn(f64) -> f64) -> String {
    figure.corrected().map_or_else(|| REFUSED.to_owned(), |error| format!("{:.4e}", of(error)))
}

fn costs(result: &SceneResult, series: &Series) -> String {
    let slope = series.convergence(&result.truth);
    let slope =
        slope.map_or_else(|| "-".to_owned(), |Estimate { value, half_width }| format!("{value:.3} ± {half_width:.3}"));
    let PerSample { closest, shadow, surfaces, light_samples } = series.per_sample();
    let dropped: u64 = series.cells.iter().flat_map(|cell| &cell.runs).map(|run| run.dropped_samples).sum();
    let name = &series.technique.name;
    format!("| {name} | {slope} | {closest:.3} | {shadow:.3} | {surfaces:.3} | {light_samples:.3} | {dropped} |\n")
}

fn times_to_error(result: &SceneResult, series: &Series) -> String {
    let points = series.error_over_time(&result.truth);
    let time = |&target: &f64| {
        let seconds = fit::time_to_error(&points, target);
        format!(" {} |", seconds.map_or_else(|| "-".to_owned(), |seconds| format!("{seconds:.4}")))
    };
    format!("| {} |{}\n", series.technique.name, TARGETS.iter().map(time).collect::<String>())
}

/// What reuse gains, if there is any, over the best technique without.
fn equal_time(result: &SceneResult) -> String {
    let Some((baseline, comparisons)) = equal_time::compare(result) else { return String::new() };
    let name = |i: usize| &result.series[i].technique.name;
    let mut text = format!(
        "\nEqual time: beside `{}`, whose squared error times run time is the smallest without reuse. Errors are of the largest \
         number of samples, over the baseline's after the same time; brackets are 95 % intervals over restarts.\n\n\
         | technique | time of a sample | relMSE at equal time | |\n|---|---:|---:|---|\n",
        name(baseline)
    );
    for (i, comparison) in comparisons.iter().enumerate() {
        let figures = comparison.as_ref().map_or_else(|| format!("{REFUSED} | - | "), compared);
        let _ = writeln!(text, "| {} | {figures} |", name(i));
    }
    text
}

fn compared(comparison: &Comparison) -> String {
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

fn passes(series: &Series) -> String {
    let total: f64 = series.passes.values().map(|pass| pass.seconds).sum();
    let row = |(kernel, pass): (&&str, &super::timed::PassTime)| {
        format!(
            "| {} | {kernel} | {} | {:.3} | {:.1} % | {} |\n",
            series.technique.name,
            pass.dispatches,
            1e3 * pass.seconds / pass.dispatches as f64,
            100.0 * pass.seconds / total,
            series.mega_rays(kernel).map_or_else(|| "-".to_owned(), |rays| format!("{rays:.2}"))
        )
    };
    series.passes.iter().map(row).collect()
}

/// The changes as a section of the report.
pub(crate) fn comparison(name: &str, changes: &[Change]) -> String {
    let mut text = format!("\n## Against {}\n\n", one_line(name));
    if changes.is_empty() {
        return text + "The tables have no scene, size, technique and number of samples in common.\n";
    }
    text += "New over old at equal samples, and the ratio from which on it counts as worse.\n\n\
             | scene | technique | spp | time | squared error | |\n|---|---|---:|---:|---:|---|\n";
    let ratio = |ratio: Option<Ratio>| {
        ratio.map_or_else(|| "not judged".to_owned(), |ratio| format!("{:.3} of {:.3}", ratio.value, ratio.limit))
    };
    for change in changes {
        let verdict = if change.worse() { "**worse**" } else { "" };
        let (time, error) = (ratio(change.time), ratio(change.error));
        let key = &change.key;
        let _ = writeln!(text, "| {} | {} | {} | {time} | {error} | {verdict} |", key.scene, key.technique, key.spp);
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use restir::technique::Integral;

    fn setup() -> Setup {
        Setup {
            machine: "a machine".to_owned(),
            device: "cpu".to_owned(),
            commit: "c0ffee".to_owned(),
            picture: Picture { size: [12; 2], integral: Integral { max_depth: 8, jitter: false } },
        }
    }

    #[test]
    fn a_report_has_every_table_complete() {
        let results = [super::super::tests::furnace()];
        let setup = setup();
        let report = Report { setup: &setup, command: "restir bench", results: &results, restarts: 6, against: None };
        let text = markdown(&report, |scene| format!("{scene}.svg"));
        for word in ["a machine", "c0ffee", "`restir bench`", "(furnace.svg)", "2048 samples", "film_resolve", "6 of 6"]
        {
            assert!(text.contains(word), "{word} is not in\n{text}");
        }
        let columns = |line: &str| line.matches('|').count();
        let tables = text.split("\n\n").filter(|part| part.starts_with('|'));
        for table in tables {
            let first = table.lines().next().map(columns);
            assert!(table.lines().all(|line| Some(columns(line)) == first), "a ragged table:\n{table}");
        }
    }

    #[test]
    fn refused_figures_are_named_so() {
        let mut results = [super::super::tests::furnace()];
        results[0].truth.noise = 1.0;
        let setup = setup();
        let report = Report { setup: &setup, command: "", results: &results, restarts: 6, against: None };
        let text = markdown(&report, |_| String::new());
        // both techniques, five budgets, RMSE and MAPE; and the sentence that explains it
        assert_eq!(text.matches(REFUSED).count(), 2 * 5 * 2 + 1, "{text}");
    }
}
