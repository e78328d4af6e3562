//! The result as a document.

use super::Group;
use std::fmt::Write;

const HEAD: &str = "# Stress

Every function at all combinations of the ends of its parameters' ranges, and at random inputs, against an independent
implementation in `f64` on the same inputs. The error of a number is relative to the number, that of a vector's
component to the vector's length, that of a position in a range to the range; what is below 2⁻¹⁰⁰ counts as zero. A result
that is not finite is a failure.

Made by `cargo xtask stress --write`; `cargo test` runs the same rows on fewer random inputs.
";

/// The findings as a Markdown document.
pub fn markdown(groups: &[Group]) -> String {
    let mut text = HEAD.to_owned();
    let mut line = |line: String| writeln!(text, "{line}").expect("a String takes all text");
    for (group, rows) in groups {
        line(format!("\n## {group}\n"));
        line("| function | parameters | inputs | max error | allowed | worst at | failures |".to_owned());
        line("|---|---|---:|---:|---:|---|---:|".to_owned());
        for (row, finding) in rows {
            let domain: Vec<String> = row.axes.iter().map(|(name, axis)| format!("{name}: {axis}")).collect();
            let worst: Vec<String> = finding.worst_at.iter().map(|x| format!("{x:e}")).collect();
            line(format!(
                "| `{}` | {} | {} | {:.1e} | {:.0e} | {} | {} |",
                row.name,
                domain.join("; "),
                finding.inputs,
                finding.worst,
                row.tolerance,
                if finding.worst > 0.0 { worst.join(", ") } else { String::new() },
                finding.failures
            ));
        }
    }
    text
}
