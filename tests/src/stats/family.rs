//! Tests that are judged together.

use super::sampler::histogram;
use super::{ZTest, chi_square, kolmogorov, sidak};
use std::fmt::Write as _;
use std::io::Write as _;
use std::path::PathBuf;

/// How often a family fails, in this project's suites, that should not.
pub const FAMILY_RATE: f64 = 1.0e-3;

/// A family of tests with one rate of false alarms: it fails if the smallest p-value is below its share (Šidák).
#[derive(Clone, Debug)]
pub struct Family {
    what: String,
    rate: f64,
    tests: Vec<Test>,
}

#[derive(Clone, Debug)]
struct Test {
    name: String,
    p: f64,
    columns: &'static str,
    rows: Vec<[f64; 3]>,
}

impl Family {
    /// A family without tests. `what` is tested, and `rate` is the probability that a right sampler fails.
    pub fn new(what: impl Into<String>, rate: f64) -> Self {
        Self { what: what.into(), rate, tests: Vec::new() }
    }

    /// Adds a chi-square test of counts and expected counts.
    pub fn chi_square(&mut self, name: impl Into<String>, cells: impl IntoIterator<Item = (u64, f64)>) {
        let cells: Vec<_> = cells.into_iter().collect();
        let rows = cells.iter().enumerate().map(|(i, &(count, expected))| [i as f64, count as f64, expected]).collect();
        self.add(name, chi_square(cells), "cell,count,expected", rows);
    }

    /// Adds a chi-square test of the cells into which draws fall: `cell(index)` is that of a draw, of which each cell has a
    /// share of `probability(cell)`.
    pub fn histogram(
        &mut self,
        name: impl Into<String>,
        cells: usize,
        draws: u64,
        cell: impl Fn(u64) -> usize + Sync,
        probability: impl Fn(usize) -> f64,
    ) {
        let counts = histogram(cells, draws, cell).into_iter().enumerate();
        self.chi_square(name, counts.map(|(i, count)| (count, probability(i) * draws as f64)));
    }

    /// The same for cells that are equally likely.
    pub fn uniform(&mut self, name: impl Into<String>, cells: usize, draws: u64, cell: impl Fn(u64) -> usize + Sync) {
        self.histogram(name, cells, draws, cell, |_| 1.0 / cells as f64);
    }

    /// Adds a Kolmogorov-Smirnov test of values against a continuous distribution function.
    pub fn kolmogorov(&mut self, name: impl Into<String>, mut values: Vec<f64>, cdf: impl Fn(f64) -> f64) {
        values.sort_by(f64::total_cmp);
        let n = values.len() as f64;
        let p = kolmogorov(&values, &cdf);
        let rows = values.iter().enumerate().map(|(i, &x)| [x, (i + 1) as f64 / n, cdf(x)]).collect();
        self.add(name, p, "value,empirical,expected", rows);
    }

    /// Adds a z-test.
    pub fn z_test(&mut self, name: impl Into<String>, test: ZTest) {
        let row = [test.difference, test.standard_error, test.z];
        self.add(name, test.p, "difference,standard error,z", vec![row]);
    }

    fn add(&mut self, name: impl Into<String>, p: f64, columns: &'static str, rows: Vec<[f64; 3]>) {
        // what is no number is no success
        let p = if p.is_nan() { 0.0 } else { p };
        self.tests.push(Test { name: name.into(), p, columns, rows });
    }

    /// The p-value below which a test of the family fails.
    pub fn share(&self) -> f64 {
        sidak(self.rate, self.tests.len())
    }

    /// Whether no test fails; a family without tests has shown nothing and does not pass.
    pub fn passed(&self) -> bool {
        self.worst().is_some_and(|test| test.p >= self.share())
    }

    fn worst(&self) -> Option<&Test> {
        self.tests.iter().min_by(|a, b| a.p.total_cmp(&b.p))
    }

    /// The test with the smallest p-value in one line. If it fails its table is written to a file for temporary things,
    /// which the text names.
    ///
    /// # Errors
    /// The same line, of a family that fails.
    pub fn verdict(&self) -> Result<String, String> {
        let Some(worst) = self.worst() else {
            return Err(format!("{}: no test was made", self.what));
        };
        let (Test { name, p, .. }, tests, share) = (worst, self.tests.len(), self.share());
        let text = format!("{}: smallest p {p:.2e} of {tests} ({name}), alarm below {share:.1e}", self.what);
        if self.passed() {
            return Ok(text);
        }
        Err(match self.dump(worst) {
            Ok(path) => format!("{text}; table in {}", path.display()),
            Err(error) => format!("{text}; its table could not be written: {error}"),
        })
    }

    /// Prints the verdict.
    ///
    /// # Panics
    /// If the family fails.
    pub fn assert(&self) {
        println!("{}", self.verdict().unwrap_or_else(|text| panic!("{text}")));
    }

    fn dump(&self, test: &Test) -> std::io::Result<PathBuf> {
        let mut text = format!("# {}: {}, p = {:e}\n{}\n", self.what, test.name, test.p, test.columns);
        for [a, b, c] in &test.rows {
            writeln!(text, "{a},{b},{c}").expect("a String takes all text");
        }
        let mut file = tempfile::Builder::new().prefix("restir-statistics-").suffix(".csv").tempfile()?;
        file.write_all(text.as_bytes())?;
        let (_, path) = file.keep().map_err(|error| error.error)?;
        Ok(path)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_failure_leaves_its_table() {
        let mut family = Family::new("a die", 1e-3);
        family.chi_square("fair", [(10, 10.0); 6]);
        assert!(family.passed() && family.verdict().is_ok());
        family.chi_square("loaded", [(60, 20.0), (0, 20.0), (0, 20.0)]);
        let message = family.verdict().expect_err("a loaded die");
        assert!(message.contains("(loaded)"), "{message}");
        let path = message.rsplit("table in ").next().expect("a path");
        let table = std::fs::read_to_string(path).expect("the table");
        std::fs::remove_file(path).expect("the file is ours");
        assert!(table.contains("cell,count,expected\n0,60,20\n1,0,20\n"), "{table}");
    }

    #[test]
    fn what_is_no_number_and_what_is_not_tested_does_not_pass() {
        let mut family = Family::new("nothing", 1e-3);
        assert!(!family.passed() && family.verdict().is_err());
        family.chi_square("no number", [(10, f64::NAN), (10, 10.0)]);
        assert!(!family.passed());
    }
}
