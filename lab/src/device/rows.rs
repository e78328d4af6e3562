//! Figures as rows, which one program prints and another reads, and as tables.

use std::fmt::Write as _;

use serde::{Deserialize, Serialize};

use super::Part;

/// One figure.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Row {
    /// The part that measured it.
    pub(super) part: Part,
    /// Of what it is: the first cell of a table's row.
    pub(super) subject: String,
    /// What it is, with its unit: the head of a table's column.
    pub(super) column: String,
    pub(super) value: f64,
}

impl Row {
    pub(super) fn new(part: Part, subject: impl Into<String>, column: impl Into<String>, value: f64) -> Self {
        Self { part, subject: subject.into(), column: column.into(), value }
    }
}

/// Rows as lines of JSON.
pub(super) fn to_lines(rows: &[Row]) -> Result<String, serde_json::Error> {
    rows.iter().map(|row| Ok(serde_json::to_string(row)? + "\n")).collect()
}

/// Reads what [`to_lines`] has written.
///
/// # Errors
/// A clause that says what is no row, in which line.
pub(super) fn from_lines(text: &str) -> Result<Vec<Row>, String> {
    let row = |(line, text): (usize, &str)| serde_json::from_str(text).map_err(|error| format!("line {line}: {error}"));
    (1..).zip(text.lines()).map(row).collect()
}

/// The different values of all rows, as they first appear.
fn in_order<'a>(rows: &'a [Row], of: impl Fn(&'a Row) -> &'a str) -> Vec<&'a str> {
    let mut found = Vec::new();
    for name in rows.iter().map(of) {
        if !found.contains(&name) {
            found.push(name);
        }
    }
    found
}

/// Rows as a table, a line a subject and a column for each of theirs; nothing without rows. A dash is what was not measured.
pub(super) fn table(rows: &[Row]) -> String {
    let columns = in_order(rows, |row| &row.column);
    if columns.is_empty() {
        return String::new();
    }
    let mut text = format!("| |{}\n|---|", columns.iter().map(|name| format!(" {name} |")).collect::<String>());
    text += &"---:|".repeat(columns.len());
    for subject in in_order(rows, |row| &row.subject) {
        let value = |column: &&str| rows.iter().find(|row| row.subject == subject && row.column == *column);
        let cells = columns.iter().map(|column| value(column).map_or_else(|| "-".to_owned(), |row| number(row.value)));
        let _ = write!(text, "\n| {subject} | {} |", cells.collect::<Vec<_>>().join(" | "));
    }
    text + "\n"
}

/// With three digits, or all of those before the point.
pub(super) fn number(value: f64) -> String {
    match value.abs() {
        size if size >= 100.0 || size == 0.0 => format!("{value:.0}"),
        size if size >= 10.0 => format!("{value:.1}"),
        size if size >= 1.0 => format!("{value:.2}"),
        size if size >= 0.01 => format!("{value:.3}"),
        _ => format!("{value:.2e}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rows() -> Vec<Row> {
        let row = |subject: &str, column: &str, value| Row::new(Part::Frames, subject, column, value);
        vec![row("path", "exact, ms", 1.25), row("path", "fast, ms", 0.5), row("two \"words\"", "fast, ms", 1234.5)]
    }

    #[test]
    fn rows_survive_their_lines() {
        let text = to_lines(&rows()).unwrap();
        assert_eq!(from_lines(&text), Ok(rows()));
        assert_eq!(from_lines(""), Ok(Vec::new()));
        for broken in
            ["what is this\n".to_owned(), text.replacen("value", "worth", 1), text[..text.len() - 4].to_owned()]
        {
            from_lines(&broken).unwrap_err();
        }
        assert!(from_lines(&(text + "no row")).unwrap_err().starts_with("line 4"));
    }

    #[test]
    fn a_table_has_what_there_is() {
        let expected =
            "| | exact, ms | fast, ms |\n|---|---:|---:|\n| path | 1.25 | 0.500 |\n| two \"words\" | - | 1234 |\n";
        assert_eq!(table(&rows()), expected);
    }

    #[test]
    fn numbers_keep_three_digits() {
        let written = [0.0, 0.0001234, 0.0456, 7.891, 45.67, 8912.3].map(number);
        assert_eq!(written, ["0", "1.23e-4", "0.046", "7.89", "45.7", "8912"]);
    }
}
