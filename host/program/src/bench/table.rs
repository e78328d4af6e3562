//! The restarts as a table, and as CSV: one row for each and every number of samples.

use std::collections::BTreeMap;

use restir::reference::Picture;

use super::{Cell, SceneResult, Series};

/// What all rows have in common.
pub(crate) struct Setup {
    pub(crate) machine: String,
    /// Executor, adapter and flavour.
    pub(crate) device: String,
    pub(crate) commit: String,
    pub(crate) picture: Picture,
}

/// One restart: the median time and the mean errors of its images. Errors are those of the images alone, and `None`
/// where the reference is too noisy.
#[derive(Clone, Debug, Default, PartialEq)]
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
    pub(crate) mse: Option<f64>,
    pub(crate) rel_mse: Option<f64>,
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

/// A value in a field; [`Field::parse`] undoes [`Field::text`].
trait Field: Sized {
    fn text(&self) -> String;
    fn parse(text: &str) -> Option<Self>;
}

macro_rules! plain_fields {
    ($($type:ty),*) => {
        $(impl Field for $type {
            fn text(&self) -> String {
                self.to_string()
            }
            fn parse(text: &str) -> Option<Self> {
                text.parse().ok()
            }
        })*
    };
}

plain_fields!(u32, u64, bool, String);

impl Field for f64 {
    fn text(&self) -> String {
        format!("{self:e}")
    }

    fn parse(text: &str) -> Option<Self> {
        text.parse().ok()
    }
}

impl Field for Option<f64> {
    fn text(&self) -> String {
        self.map_or_else(String::new, |value| value.text())
    }

    fn parse(text: &str) -> Option<Self> {
        if text.is_empty() { Some(None) } else { f64::parse(text).map(Some) }
    }
}

/// The columns, in the order of the file.
macro_rules! columns {
    ($($name:ident)*) => {
        const COLUMNS: &[&str] = &[$(stringify!($name)),*];

        impl Row {
            fn fields(&self) -> Vec<String> {
                vec![$(self.$name.text()),*]
            }

            /// From fields by their names; the name of one that is missing or has no such value.
            fn from_fields(fields: &BTreeMap<&str, String>) -> Result<Self, &'static str> {
                Ok(Self { $($name: fields.get(stringify!($name)).and_then(|text| Field::parse(text)).ok_or(stringify!($name))?),* })
            }
        }
    };
}

columns! {
    scene technique width height max_depth jitter spp restart seed images seconds mse rel_mse mape measured_mse
    mean reference_mean reference_mean_error reference_spp reference_mse closest_rays shadow_rays surface_evaluations
    light_samples dropped_samples device machine commit note
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
    let names = COLUMNS.iter().map(|name| (*name).to_owned()).collect();
    let lines = std::iter::once(names).chain(rows.iter().map(Row::fields));
    lines
        .map(|fields: Vec<String>| fields.iter().map(|field| quoted(field)).collect::<Vec<_>>().join(",") + "\n")
        .collect()
}

fn quoted(field: &str) -> String {
    if field.contains([',', '"', '\n', '\r']) {
        format!("\"{}\"", field.replace('"', "\"\""))
    } else {
        field.to_owned()
    }
}

/// Reads a table; further columns are ignored.
///
/// # Errors
/// A clause that says what is wrong in which line.
pub(crate) fn from_csv(text: &str) -> Result<Vec<Row>, String> {
    let mut records = records(text).into_iter();
    let names = records.next().unwrap_or_default();
    let read = |(line, fields): (usize, Vec<String>)| {
        let fields = names.iter().map(String::as_str).zip(fields).collect();
        Row::from_fields(&fields).map_err(|column| format!("line {line} has no valid {column}"))
    };
    (2..).zip(records).map(read).collect()
}

/// The fields of every line. A quoted field may hold commas, line ends and doubled quotes.
fn records(text: &str) -> Vec<Vec<String>> {
    let mut records = Vec::new();
    let (mut record, mut field, mut inside) = (Vec::new(), String::new(), false);
    let mut characters = text.chars().peekable();
    while let Some(character) = characters.next() {
        match character {
            '"' if inside && characters.peek() == Some(&'"') => field.extend(characters.next()),
            '"' => inside = !inside,
            ',' if !inside => record.push(std::mem::take(&mut field)),
            '\n' if !inside => {
                record.push(std::mem::take(&mut field));
                records.push(std::mem::take(&mut record));
            }
            '\r' if !inside => {}
            other => field.push(other),
        }
    }
    if !field.is_empty() || !record.is_empty() {
        record.push(field);
        records.push(record);
    }
    records
}

#[cfg(test)]
mod tests {
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
        let renamed = text.replacen("seconds", "minutes", 1);
        assert_eq!(from_csv(&renamed).unwrap_err(), "line 2 has no valid seconds");
        assert_eq!(from_csv("").unwrap(), []);
        from_csv("nothing\nof this\n").unwrap_err();
        let more = text.replacen("scene,", "further,scene,", 1).replacen("\n\"a", "\n7,\"a", 1);
        assert_eq!(from_csv(&more).unwrap(), [row()]);
    }

    #[test]
    fn a_benchmark_has_a_row_a_restart() {
        let result = super::super::tests::furnace();
        let picture = Picture { size: [12; 2], integral: restir::technique::Integral { max_depth: 8, jitter: false } };
        let text = String::new;
        let setup = Setup { machine: text(), device: text(), commit: text(), picture };
        let rows = rows(&setup, &result);
        assert_eq!(rows.len(), 2 * 5 * 6);
        assert!(rows.iter().all(|row| row.mse.is_some() && row.note.is_empty()));
        let again = from_csv(&to_csv(&rows)).unwrap();
        assert_eq!(again, rows);
    }
}
