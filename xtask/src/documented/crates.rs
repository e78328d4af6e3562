//! The table in README of how many crates each set of features pulls, beside what `cargo tree` counts.

use std::collections::BTreeSet;
use std::process::Command;

use crate::Error;
use crate::process::shell;

/// A row of the table: a crate, its features, and how many crates the page says that these are.
#[derive(Debug, PartialEq)]
struct Row {
    name: String,
    /// `None` stands for the features that are on by default.
    features: Option<Vec<String>>,
    count: usize,
}

/// Rows whose count is another one than the page's; also a page without rows.
pub(super) fn problems(page: &str) -> Result<Vec<String>, Error> {
    let rows = rows(page);
    if rows.is_empty() {
        return Ok(vec!["README has no table of the crates that a set of features pulls".to_owned()]);
    }
    let problem = |row: &Row| {
        let count = count(row)?;
        let differs = count != row.count;
        Ok(differs.then(|| format!("README says that {row:?}, and cargo tree counts {count}")))
    };
    rows.iter().filter_map(|row| problem(row).transpose()).collect()
}

/// Rows like ``| `restir` | `png`, `exr` | 7 |``, where "default" and "none" are features, too.
fn rows(page: &str) -> Vec<Row> {
    let spans = |cell: &str| cell.split('`').skip(1).step_by(2).map(str::to_owned).collect::<Vec<_>>();
    let row = |line: &str| {
        let cells: Vec<&str> = line.split('|').map(str::trim).collect();
        let [_, name, features, count, _] = cells[..] else { return None };
        let features = (!features.contains("default")).then(|| spans(features));
        Some(Row { name: spans(name).into_iter().next()?, features, count: count.parse().ok()? })
    };
    page.lines().filter_map(row).collect()
}

/// How many crates it pulls, its own among them.
fn count(Row { name, features, .. }: &Row) -> Result<usize, Error> {
    let mut tree = Command::new(env!("CARGO"));
    tree.args(["tree", "--locked", "--edges", "normal", "--prefix", "none", "--package", name]);
    if let Some(features) = features {
        tree.args(["--no-default-features", "--features", &features.join(",")]);
    }
    let output =
        tree.output().map_err(|error| Error::Environment(format!("cannot run `{}`: {error}", shell(&tree))))?;
    if !output.status.success() {
        return Err(Error::Failed(format!("`{}`: {}", shell(&tree), String::from_utf8_lossy(&output.stderr))));
    }
    let text = String::from_utf8_lossy(&output.stdout);
    let names: BTreeSet<&str> =
        text.lines().filter_map(|line| line.split(' ').next()).filter(|name| !name.is_empty()).collect();
    Ok(names.len())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_are_read() {
        let page = "| what | features | crates |\n|---|---|---:|\n| `a`, small (`s`) | none | 9 |\n| `a` | `x`, `y` | 11 |\n| `b` | all, the default | 12 |";
        let row = |name: &str, features: Option<&[&str]>, count| {
            let features = features.map(|features| features.iter().map(|&feature| feature.to_owned()).collect());
            Row { name: name.to_owned(), features, count }
        };
        assert_eq!(rows(page), [row("a", Some(&[]), 9), row("a", Some(&["x", "y"]), 11), row("b", None, 12)]);
    }
}
