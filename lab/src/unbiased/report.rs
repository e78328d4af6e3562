//! What tested cells tell: a row each, and the report on a technique.

use std::collections::BTreeSet;
use std::fmt;

use restir_host::technique::Repeats;
use restir_tests::stats::{Moments, TileTest, Verdict, ZTest, sidak};
use restir_tests::technique::Trials;

use super::side::Side;
use super::stage::FRAMES;
use super::{Cell, Expected, FAMILY_RATE, GRID, Goal, MOST_RESTARTS, SIZE, TILE, WRONG_RADIANCE};
use crate::Error;

/// A biased setting has to differ by this many standard errors.
const BIASED: f64 = 3.0;

/// A tested cell.
pub(super) struct Row {
    scene: String,
    cell: Cell,
    goal: Option<Goal>,
    restarts: u32,
    pub(super) verdict: Verdict,
    /// Of each tile's channels, then of the image's.
    tests: Vec<ZTest>,
    /// The relative bias that is detectable in half of the tiles and channels.
    detectable_in_half: f64,
    /// Relative difference of the image's mean in green, and its standard error.
    bias: [f64; 2],
}

impl Row {
    pub(super) fn new(
        scene: &str,
        cell: Cell,
        goal: Option<Goal>,
        family_rate: f64,
        tested: &Side,
        reference: &[Moments],
    ) -> Self {
        let moments = tested.moments();
        let tests: Vec<ZTest> = moments.iter().zip(reference).map(|(a, b)| ZTest::new(*a, *b)).collect();
        let rate = sidak(family_rate, tests.len());
        let mut detectable: Vec<f64> =
            tests.iter().zip(reference).map(|(test, b)| test.detectable_bias(rate) / b.mean()).collect();
        detectable.sort_by(f64::total_cmp);
        // the image's numbers are the last three
        let green = tests.len() - 2;
        let bias = [tests[green].difference, tests[green].standard_error].map(|x| x / reference[green].mean());
        Self {
            scene: scene.to_owned(),
            cell,
            goal,
            restarts: tested.restarts,
            verdict: TileTest { grid: GRID, family_rate }.compare(&moments, reference),
            detectable_in_half: detectable[detectable.len() / 2],
            tests,
            bias,
        }
    }

    /// The biases that would be noticed, over those which are to be, whichever is larger; without a goal any will do.
    pub(super) fn detectable_over_goal(&self) -> f64 {
        let [image, tiles] = [self.verdict.detectable_in_image, self.detectable_in_half].map(|bias| 100.0 * bias);
        self.goal.map_or(0.0, |goal| f64::max(image / goal.image, tiles / goal.tiles))
    }

    /// What it would cost to reach the goal, where it is missed: what is detectable falls with the root of the restarts.
    fn missing(&self) -> String {
        let over = self.detectable_over_goal();
        let Some(Goal { image, tiles }) = self.goal.filter(|_| over > 1.0) else { return String::new() };
        let of_tiles = if tiles.is_finite() { format!(", {tiles} % of tiles") } else { String::new() };
        format!("; **{image} %{of_tiles} asked for**, which {:.1} times as many restarts would reach", over * over)
    }

    /// Whether the outcome is what is known; nothing if the test cannot tell.
    fn agrees(&self) -> Option<bool> {
        let [bias, error] = self.bias;
        match self.cell.expected {
            Expected::Unbiased => Some(self.verdict.passed()),
            Expected::Biased if bias.abs() <= BIASED * error => None,
            Expected::Biased => Some(bias < 0.0),
            Expected::Wrong if self.verdict.detectable_in_image > f64::from(WRONG_RADIANCE) - 1.0 => None,
            Expected::Wrong => Some(!self.verdict.passed()),
        }
    }

    /// The verdict, and the largest |z| of each tile's channels.
    pub(super) fn in_detail(&self) -> String {
        let z = |channels: &[ZTest]| channels.iter().map(|test| test.z.abs()).fold(0.0, f64::max);
        let tiles: Vec<String> = self.tests.chunks(3).map(|channels| format!("{:6.2}", z(channels))).collect();
        let rows: Vec<String> = tiles.chunks_exact((SIZE / TILE) as usize).map(<[_]>::concat).collect();
        format!("{HEAD}{self}\n\n{}; largest |z| of each tile:\n{}", self.verdict, rows.join("\n"))
    }
}

const HEAD: &str = "| scene | settings | known bias | restarts | max \\|z\\| | detectable in tiles, % | \
                    bias, % | outcome |\n|---|---|---|---:|---:|---:|---:|---|\n";

impl fmt::Display for Row {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let known = match self.cell.expected {
            Expected::Unbiased => "none",
            Expected::Biased => "darker",
            Expected::Wrong => "x 1.01",
        };
        let excluded = 100.0 * self.verdict.detectable_in_image;
        let outcome = match (self.agrees(), self.cell.expected) {
            (Some(true), Expected::Unbiased) => format!("excludes > {excluded:.2} % of the image{}", self.missing()),
            (Some(true), _) => "seen, as known".to_owned(),
            (Some(false), _) => "**not as known**".to_owned(),
            (None, Expected::Wrong) => "too few restarts to tell".to_owned(),
            (None, _) => "not seen here".to_owned(),
        };
        let settings = if self.cell.settings.is_empty() { "defaults" } else { &self.cell.settings };
        let Verdict { max_z, .. } = self.verdict;
        let [half, bias, error] = [self.detectable_in_half, self.bias[0], self.bias[1]].map(|x| 100.0 * x);
        write!(
            f,
            "| {} | {settings} | {known} | {} | {max_z:.2} | {half:.2} | {bias:+.3} +- {error:.3} | {outcome} |",
            self.scene, self.restarts
        )
    }
}

/// What is not as it should be: a cell that says otherwise, or, where `all` scenes are there, one whose bias is seen on none.
pub(super) fn findings(rows: &[Row], all: bool) -> Vec<String> {
    let wrong = rows.iter().filter(|row| row.agrees() == Some(false));
    let wrong = wrong.map(|row| format!("{}/{}: {}", row.cell.name(), row.scene, row.verdict));
    let names: BTreeSet<_> = rows.iter().map(|row| row.cell.name()).collect();
    let seen: BTreeSet<_> = rows.iter().filter(|row| row.agrees().is_some()).map(|row| row.cell.name()).collect();
    let unseen = names.difference(&seen).filter(|_| all);
    wrong
        .chain(unseen.map(|name| format!("{name}: its bias is not seen on any scene; give it more restarts")))
        .collect()
}

/// A committed report in which rows are replaced by those that were made anew; the words above its table are the new ones. Rows of a scene that
/// the report has not come last, as a scene does that is added.
///
/// # Errors
/// [`Error::Failed`] for a row of another scene that the report does not have.
pub(super) fn replaced(committed: &str, made: &str) -> Result<String, Error> {
    let row = |line: &str| line.starts_with("| ").then(|| line.split(" | ").take(2).collect::<Vec<_>>().join(" | "));
    let table = |text: &str| text.find(HEAD).map(|at| at + HEAD.len());
    let problem = |what: &str| Error::Failed(format!("the committed report has no {what}; make the whole report"));
    let (old, new) = (table(committed).ok_or_else(|| problem("table"))?, table(made).ok_or_else(|| problem("table"))?);
    let mut lines: Vec<&str> = committed[old..].lines().collect();
    let mut free: Vec<bool> = vec![true; lines.len()];
    let scene = |line: &str| line.split(" | ").next().map(str::to_owned);
    let scenes: BTreeSet<_> = lines.iter().map(|line| scene(line)).collect();
    for line in made[new..].lines() {
        if !scenes.contains(&scene(line)) {
            lines.push(line);
            free.push(false);
            continue;
        }
        let at = (0..lines.len()).find(|&at| free[at] && row(lines[at]) == row(line));
        let at = at.ok_or_else(|| problem(line))?;
        (lines[at], free[at]) = (line, false);
    }
    let lines: String = lines.into_iter().map(|line| format!("{line}\n")).collect();
    Ok(made[..new].to_owned() + &lines)
}

/// The report on cells of a technique, of which none has more restarts than `most`.
pub(super) fn report(trials: &Trials, rows: &[Row], most: u32) -> String {
    let (name, matrix) = (trials.name(), trials.known.matrix);
    let picture = match trials.technique.about().repeats {
        Repeats::Samples => "one sample a pixel".to_owned(),
        Repeats::Frames => format!("the last of {FRAMES} frames, or their mean where none knows another"),
    };
    let threshold = rows.first().map_or(f64::NAN, |row| row.verdict.threshold);
    let tiles = (SIZE / TILE).pow(2);
    let common = [("all scenes", matrix.common)];
    let beside = common.iter().chain(matrix.scenes).filter(|(_, settings)| !settings.is_empty());
    let beside: Vec<String> = beside.map(|(place, settings)| format!("`{settings}` in {place}")).collect();
    let beside = if beside.is_empty() { "none".to_owned() } else { beside.join("; ") };
    let goals: Vec<String> =
        matrix.scenes.iter().map(|(scene, _)| format!("{} % in {scene}", matrix.goal(scene))).collect();
    let of_tiles = Some(matrix.tile_goal).filter(|goal| goal.is_finite());
    let of_tiles = of_tiles.map_or(String::new(), |goal| format!(", and {goal} % in half of the tiles,"));
    let goals = goals.join(", ") + &of_tiles;
    let most = if most == MOST_RESTARTS { String::new() } else { format!(" --most-restarts {most}") };
    let mut text = format!(
        "# Bias of `{name}`\n\nEach row compares {picture}, over independent restarts, with path tracing of the same light, \
         and path tracing itself with an independent path tracer or walk in `f64`, or where these do not know the scene with light that \
         path tracing finds in another way: {SIZE} x {SIZE} pixels, the three channels of \
         {tiles} tiles of {TILE} x {TILE} and of the image. A row passes if no |z| exceeds {threshold:.2}; the whole table \
         has a false alarm with probability {FAMILY_RATE}. The detectable bias is noticed with 99 % probability in half of \
         the tiles and channels; what a row excludes is a bias of the image, in its worst channel, that would have been \
         noticed with that probability: {goals} are asked for, and a row without a known bias that misses this says what reaching it \
         would cost. The last figures are the bias of the image's mean \
         in green and its standard error, in percent. Where camera rays are spread over pixels, light that they see directly is taken off both \
         sides, which find it in the same points; percents are then of the rest.\n\n\
         What settings mean is printed by `restir settings {name}`. Settings beside those of a row: {beside}. Of settings \
         known to be darker a row tells where the bias exceeds {BIASED} standard errors; of radiance x {WRONG_RADIANCE}, \
         where that is detectable. A tile that light reaches rarely has no variance yet in few restarts, and z says \
         nothing: such rows need more of them.\n\n\
         Made by `cargo lab unbiased --technique {name}{most} --write`; `--only TEXT` makes those rows anew that have the text in \
         SCENE/SETTINGS.\n\n{HEAD}"
    );
    text.extend(rows.iter().map(|row| format!("{row}\n")));
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_are_replaced_where_they_are() {
        let report = |head: &str, rows: &[&str]| format!("{head}\n{HEAD}{}\n", rows.join("\n"));
        let old = report(
            "old",
            &["| a | x | none | 1 |", "| a |  | none | 2 |", "| a |  | x 1.01 | 3 |", "| b | x | none | 4 |"],
        );
        let made = report("new", &["| a | x | none | 9 |", "| b | x | none | 8 |"]);
        let right = report(
            "new",
            &["| a | x | none | 9 |", "| a |  | none | 2 |", "| a |  | x 1.01 | 3 |", "| b | x | none | 8 |"],
        );
        assert_eq!(replaced(&old, &made).unwrap(), right);
        let twice = report("new", &["| a |  | none | 7 |", "| a |  | x 1.01 | 6 |"]);
        let right = report(
            "new",
            &["| a | x | none | 1 |", "| a |  | none | 7 |", "| a |  | x 1.01 | 6 |", "| b | x | none | 4 |"],
        );
        assert_eq!(replaced(&old, &twice).unwrap(), right);
        let unknown = report("new", &["| b | y | none | 7 |"]);
        assert!(replaced(&old, &unknown).unwrap_err().to_string().contains("| b | y |"));
        let added = replaced(&old, &report("new", &["| c | x | none | 7 |", "| c | y | none | 6 |"])).unwrap();
        assert!(added.ends_with("| b | x | none | 4 |\n| c | x | none | 7 |\n| c | y | none | 6 |\n"), "{added}");
    }
}
