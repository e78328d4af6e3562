//! What is rendered, and what is asked of an H100.

use restir_host::render::Render;
use restir_host::technique;

use super::rows::Row;
use super::{Extent, Part};
use crate::Error;

/// A technique with its settings in a scene.
#[derive(Clone, Copy)]
pub(super) struct Subject {
    pub(super) scene: &'static str,
    technique: &'static str,
    /// A preset, if not the defaults.
    preset: Option<&'static str>,
}

impl Subject {
    const fn new(scene: &'static str, technique: &'static str, preset: Option<&'static str>) -> Self {
        Self { scene, technique, preset }
    }

    /// As tables have it.
    pub(super) fn name(&self) -> String {
        let preset = self.preset.map_or_else(String::new, |preset| format!(" `{preset}`"));
        format!("{}{preset} in `{}`", self.technique, self.scene)
    }

    /// One sample or frame of it.
    pub(super) fn render(&self, size: [u32; 2]) -> Result<Render, Error> {
        let mut technique = technique::named(self.technique)?;
        technique::configure(
            &mut *technique,
            &self.preset.map(|preset| format!("preset={preset}")).into_iter().collect::<Vec<_>>(),
        )?;
        Ok(Render::new(size, technique))
    }
}

/// Of each technique the one that is measured in any case.
pub(super) const MAIN: [Subject; 3] = [
    Subject::new("cornell", "path", None),
    Subject::new("many-lights", "restir-di", Some("quality")),
    Subject::new("ajar", "restir-pt", Some("quality")),
];

/// What else path tracing is measured in.
const PATHS: [Subject; 2] = [Subject::new("many-lights", "path", None), Subject::new("ajar", "path", None)];
/// What is measured by its presets alone.
const BY_PRESETS: [Subject; 2] =
    [Subject::new("candles", "restir-sss", None), Subject::new("ajar", "restir-suffix", None)];

/// All subjects, those first that matter most: where the time is up, the rest is left out.
pub(super) fn subjects(extent: Extent) -> Vec<Subject> {
    let mut subjects = MAIN.to_vec();
    if extent != Extent::Full {
        return subjects;
    }
    subjects.extend(PATHS);
    for main in MAIN.into_iter().chain(BY_PRESETS) {
        let presets = technique::named(main.technique).map_or_else(|_| Vec::new(), |technique| technique.presets());
        let others = presets.into_iter().map(|(name, _)| name).filter(|name| main.preset != Some(name));
        subjects.extend(others.map(|name| Subject { preset: Some(name), ..main }));
    }
    subjects
}

/// Something that is asked of an H100 at 1920 x 1080.
struct Goal {
    what: &'static str,
    asked: f64,
    is_least: bool,
    figure: fn(&[Row]) -> Option<f64>,
}

fn value(rows: &[Row], part: Part, subject: &str, column: &str) -> Option<f64> {
    rows.iter().find(|row| row.part == part && row.subject == subject && row.column == column).map(|row| row.value)
}

/// Of ReSTIR DI with many lights.
fn frame_of_many_lights(rows: &[Row], column: &str) -> Option<f64> {
    value(rows, Part::Frames, &MAIN[1].name(), column)
}

const GOALS: [Goal; 4] = [
    Goal {
        what: "primary rays by traversal alone, Mrays/s, in the slower scene, exact",
        asked: 1500.0,
        is_least: true,
        figure: |rows| {
            let primary = rows.iter().filter(|row| row.part == Part::Traversal && row.subject.starts_with("primary"));
            primary.filter(|row| row.column == "exact, Mrays/s").map(|row| row.value).reduce(f64::min)
        },
    },
    Goal {
        what: "path in `cornell`, Mrays/s, exact: three times the 552 of before",
        asked: 3.0 * 552.0,
        is_least: true,
        figure: |rows| value(rows, Part::Frames, &MAIN[0].name(), "exact, Mrays/s"),
    },
    Goal {
        what: "restir-di `quality` in `many-lights`, ms a frame, fast",
        asked: 8.0,
        is_least: false,
        figure: |rows| frame_of_many_lights(rows, "fast, ms"),
    },
    Goal {
        what: "the same, exact over fast",
        asked: 1.4,
        is_least: false,
        figure: |rows| Some(frame_of_many_lights(rows, "exact, ms")? / frame_of_many_lights(rows, "fast, ms")?),
    },
];

/// The goals that have figures, as lines of a table.
pub(super) fn goals(rows: &[Row]) -> Vec<String> {
    let line = |goal: &Goal| {
        let figure = (goal.figure)(rows)?;
        let is_met = if goal.is_least { figure >= goal.asked } else { figure <= goal.asked };
        let (bound, met) = (if goal.is_least { "at least" } else { "at most" }, if is_met { "yes" } else { "no" });
        let [asked, figure] = [goal.asked, figure].map(super::rows::number);
        Some(format!("| {} | {bound} {asked} | {figure} | {met} |\n", goal.what))
    };
    GOALS.iter().filter_map(line).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The presets that the techniques have today are all measured, each once, and can be rendered.
    #[test]
    fn all_presets_are_measured() {
        let names: Vec<String> = subjects(Extent::Full).iter().map(Subject::name).collect();
        for technique in technique::all() {
            for (preset, _) in technique.presets() {
                let name = format!("{} `{preset}`", technique.about().name);
                assert_eq!(names.iter().filter(|found| found.starts_with(&name)).count(), 1, "{name}");
            }
        }
        for subject in subjects(Extent::Full) {
            subject.render([16, 16]).unwrap().technique.check_ranges().unwrap();
        }
    }

    #[test]
    fn a_goal_is_met_or_not() {
        let frame = |column: &str, value| Row::new(Part::Frames, MAIN[1].name(), column, value);
        assert!(goals(&[]).is_empty());
        let met = goals(&[frame("fast, ms", 7.0), frame("exact, ms", 9.0)]);
        assert!(met.len() == 2 && met.iter().all(|line| line.ends_with("| yes |\n")), "{met:?}");
        let missed = goals(&[frame("fast, ms", 8.5), frame("exact, ms", 20.0)]);
        assert!(missed.iter().all(|line| line.ends_with("| no |\n")), "{missed:?}");
    }
}
