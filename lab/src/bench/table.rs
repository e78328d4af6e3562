//! The restarts as a table, and as CSV: one row for each and every number of samples.

use restir::advanced::reference::Picture;
use serde::{Deserialize, Serialize};

use super::{Cell, SceneResult, Series};

/// What all rows have in common.
pub(crate) struct Setup {
    /// The program with its arguments.
    pub(crate) command: String,
    pub(crate) machine: String,
    /// Executor, adapter and flavour.
    pub(crate) device: String,
    pub(crate) commit: String,
    pub(crate) picture: Picture,
}

impl Setup {
    /// As a table of a report; of the images `more` is said than their size.
    pub(crate) fn markdown(&self, more: &str) -> String {
        let Self { command, machine, device, commit, picture: Picture { size: [width, height], .. } } = self;
        let command = super::report::one_line(command);
        format!(
            "| | |\n|---|---|\n| command | `{command}` |\n| machine | {machine} |\n| device | {device} |\n\
             | commit | {commit} |\n| images | {width} x {height} pixels{more} |\n",
        )
    }
}

/// One restart: the median time and the mean errors of its images. Errors are those of the images alone, and `None`
/// where the reference is too noisy; their columns must be there.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct Row {
    pub(crate) scene: String,
    pub(crate) technique: String,
    pub(crate) width: u32,
    pub(crate) height: u32,
    pub(crate) max_depth: u32,
    pub(crate) jitter: bool,
    pub(crate) spp: u32,
    pub(crate) restart: u32,
    pub(crate) seed: u32,
    pub(crate) images: u32,
    pub(crate) seconds: f64,
    #[serde(deserialize_with = "Option::deserialize")]
    pub(crate) mse: Option<f64>,
    #[serde(deserialize_with = "Option::deserialize")]
    pub(crate) rel_mse: Option<f64>,
    #[serde(deserialize_with = "Option::deserialize")]
    pub(crate) mape: Option<f64>,
    pub(crate) measured_mse: f64,
    pub(crate) mean: f64,
    pub(crate) reference_mean: f64,
    pub(crate) reference_mean_error: f64,
    pub(crate) reference_spp: u64,
    pub(crate) reference_mse: f64,
    pub(crate) closest_rays: f64,
    pub(crate) shadow_rays: f64,
    pub(crate) surface_evaluations: f64,
    pub(crate) light_samples: f64,
    pub(crate) dropped_samples: u64,
    pub(crate) device: String,
    pub(crate) machine: String,
    pub(crate) commit: String,
    pub(crate) note: String,
}

/// The rows of a scene.
pub(crate) fn rows(setup: &Setup, result: &SceneResult) -> Vec<Row> {
    let cells = result.series.iter().flat_map(|series| series.cells.iter().map(move |cell| (series, cell)));
    let restarts = cells.flat_map(|(series, cell)| (0..cell.runs.len()).map(move |restart| (series, cell, restart)));
    restarts.map(|(series, cell, restart)| row(setup, result, series, cell, restart)).collect()
}

fn row(setup: &Setup, result: &SceneResult, series: &Series, cell: &Cell, restart: usize) -> Row {
    let run = &cell.runs[restart];
    let truth = &result.truth;
    // a cell is refused as a whole: single restarts scatter
    let known = cell.mse(truth).corrected().is_some();
    let known_relative = cell.rel_mse(truth).corrected().is_some();
    let asked = series.per_sample();
    Row {
        scene: result.scene.clone(),
        technique: series.technique.name.clone(),
        width: setup.picture.size[0],
        height: setup.picture.size[1],
        max_depth: setup.picture.integral.max_depth,
        jitter: setup.picture.integral.jitter,
        spp: cell.samples,
        restart: restart as u32,
        seed: run.seed,
        images: run.images,
        seconds: run.seconds,
        mse: known.then_some(run.errors.mse - truth.noise),
        rel_mse: known_relative.then_some(run.errors.rel_mse - truth.relative_noise),
        mape: cell.mape(truth).map(|_| run.errors.mape),
        measured_mse: run.errors.mse,
        mean: run.errors.mean,
        reference_mean: truth.mean,
        reference_mean_error: truth.mean_error,
        reference_spp: result.reference_samples,
        reference_mse: truth.noise,
        closest_rays: asked.closest,
        shadow_rays: asked.shadow,
        surface_evaluations: asked.surfaces,
        light_samples: asked.light_samples,
        dropped_samples: run.dropped_samples,
        device: setup.device.clone(),
        machine: setup.machine.clone(),
        commit: setup.commit.clone(),
        note: if known && known_relative { "" } else { super::report::REFUSED }.to_owned(),
    }
}

/// The table as CSV, after RFC 4180, with a line of names.
pub(crate) fn to_csv(rows: &[Row]) -> String {
    let mut writer = csv::Writer::from_writer(Vec::new());
    rows.iter().try_for_each(|row| writer.serialize(row)).expect("a row is a record");
    String::from_utf8(writer.into_inner().expect("memory takes all text")).expect("text of texts")
}

/// Reads a table; further columns are ignored.
///
/// # Errors
/// A clause that says what is wrong in which line.
pub(crate) fn from_csv(text: &str) -> Result<Vec<Row>, String> {
    let rows = csv::Reader::from_reader(text.as_bytes()).into_deserialize();
    rows.collect::<Result<_, csv::Error>>().map_err(|error| error.to_string())
}

#[cfg(test)]
mod tests {
    use super::super::tests::{furnace, setup};
    use super::*;

    fn row() -> Row {
        Row {
            scene: "a \"scene\", with\neverything".to_owned(),
            technique: "path".to_owned(),
            spp: 4,
            seconds: 0.1 + 0.2,
            mse: Some(1.0 / 3.0),
            jitter: true,
            dropped_samples: u64::MAX,
            ..Row::default()
        }
    }

    #[test]
    fn a_table_survives_its_csv() {
        let rows = vec![row(), Row { mse: None, ..row() }];
        let text = to_csv(&rows);
        assert_eq!(from_csv(&text).unwrap(), rows);
        assert_eq!(from_csv(&text.replace('\n', "\r\n")).unwrap().len(), 2);
    }

    #[test]
    fn columns_are_found_by_name_and_missing_ones_are_named() {
        let text = to_csv(&[row()]);
        for (name, other) in [("seconds", "minutes"), ("mape", "map")] {
            let problem = from_csv(&text.replacen(name, other, 1)).unwrap_err();
            assert!(problem.contains("line: 2") && problem.contains(name), "{problem}");
        }
        assert_eq!(from_csv("").unwrap(), []);
        from_csv("nothing\nof this\n").unwrap_err();
        let more = text.replacen("scene,", "further,scene,", 1).replacen("\n\"a", "\n7,\"a", 1);
        assert_eq!(from_csv(&more).unwrap(), [row()]);
    }

    #[test]
    fn a_benchmark_has_a_row_a_restart() {
        let rows = rows(&setup(), &furnace());
        assert_eq!(rows.len(), 2 * 5 * 6);
        assert!(rows.iter().all(|row| row.mse.is_some() && row.note.is_empty()));
        assert_eq!(from_csv(&to_csv(&rows)).unwrap(), rows);
    }
}
