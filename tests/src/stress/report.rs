//! The result as a document.

use super::Group;
use std::fmt::Write;

const HEAD: &str = "# Stress

Every function at all combinations of the ends of its parameters' ranges, and at random inputs, against an independent
implementation in `f64` on the same inputs. The error of a number is relative to the number, that of a vector's
component to the vector's length, that of a position in a range to the range; what is below 2⁻¹⁰⁰ counts as zero. A result
that is not finite is a failure.

An error beyond what is allowed is no failure if rounding of the inputs explains it. The two directions of a scattering
function are unit vectors only to within rounding. Near total reflection and at facets seen edge-on, and in what a coat
of an index of almost 1 reflects (Schlick's (1 - cos)⁵ near cosine 1: a reflectance of 10⁻⁵ at most), roundings move
the exact answer by more than 10⁻⁵ of itself. There the result must lie, but for the allowed error, between the exact
values for directions each of whose components is moved by 4 roundings of 2⁻²⁴, up or down, as the same implementation
in `f64` computes them. The column `explained` counts these inputs, of which one in 500 may need it; the largest error
is that of all others.

Made by `cargo xtask stress --write`; `cargo test` runs the same rows on fewer random inputs.
";

/// The findings as a Markdown document.
pub fn markdown(groups: &[Group]) -> String {
    let mut text = HEAD.to_owned();
    let mut line = |line: String| writeln!(text, "{line}").expect("a String takes all text");
    for (group, rows) in groups {
        line(format!("\n## {group}\n"));
        line("| function | parameters | inputs | max error | allowed | worst at | explained | failures |".to_owned());
        line("|---|---|---:|---:|---:|---|---:|---:|".to_owned());
        for (row, finding) in rows {
            let domain: Vec<String> = row.axes.iter().map(|(name, axis)| format!("{name}: {axis}")).collect();
            let worst: Vec<String> = finding.worst_at.iter().map(|x| format!("{x:e}")).collect();
            line(format!(
                "| `{}` | {} | {} | {:.1e} | {:.0e} | {} | {} | {} |",
                row.name,
                domain.join("; "),
                finding.inputs,
                finding.worst,
                row.tolerance,
                if finding.worst > 0.0 { worst.join(", ") } else { String::new() },
                finding.near,
                finding.failures
            ));
        }
    }
    text
}
