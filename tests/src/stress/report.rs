//! The result as a document.

use super::{Finding, Function, Group};

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

Made by `cargo lab stress --write`; `cargo test` runs the same rows on fewer random inputs.
";

/// The findings as a Markdown document.
pub fn markdown(groups: &[Group]) -> String {
    let mut text = HEAD.to_owned();
    for (group, rows) in groups {
        text += &format!(
            "\n## {group}\n\n| function | parameters | inputs | max error | allowed | worst at | explained | failures |\n\
             |---|---|---:|---:|---:|---|---:|---:|\n"
        );
        text.extend(rows.iter().map(|(Finding { inputs, near, failures, worst, worst_at }, row)| {
            let Function { name, axes, .. } = &row.function;
            let domain: Vec<_> = axes.iter().map(|(name, axis)| format!("{name}: {axis}")).collect();
            let at: Vec<_> = worst_at.iter().filter(|_| *worst > 0.0).map(|x| format!("{x:e}")).collect();
            let (domain, at, allowed) = (domain.join("; "), at.join(", "), row.tolerance);
            format!("| `{name}` | {domain} | {inputs} | {worst:.1e} | {allowed:.0e} | {at} | {near} | {failures} |\n")
        }));
    }
    text
}
