//! The rows of `cargo lab stress`, on fewer random inputs.

use restir_tests::stress::{Axis, Effort, Expected, Finding, Function, Row, frames, profiles, run, scenes};

pub(crate) fn ends_of_ranges_hold() {
    let mut wrong = Vec::new();
    for (finding, Row { function, tolerance, .. }) in run(Effort::Reduced).into_iter().flat_map(|(_, rows)| rows) {
        let (name, Finding { inputs, near, worst, worst_at, .. }) = (function.name, &finding);
        println!("{name}: {worst:.1e} of {tolerance:.0e} on {inputs} inputs, but for {near} explained");
        if !finding.passed() {
            wrong.push(format!("{name}: {worst:.1e} at {worst_at:?}, allowed {tolerance:e}; {near} explained"));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

pub(crate) fn scenes_hold_at_their_ends() {
    let comparisons = scenes::run(Effort::Reduced);
    println!("{}", scenes::markdown(&comparisons));
    let wrong: Vec<_> = comparisons.iter().filter(|c| !c.passed()).map(|c| format!("{c:?}")).collect();
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// So few samples bound no bias of half a percent, but none is lost, and they are off by no more than noise: 6 standard errors of 16
/// pictures, beyond which nothing is that is right but in one run of 20 000.
pub(crate) fn profiles_hold_at_their_ends() {
    let tiles = profiles::run(Effort::Reduced);
    println!("{}", profiles::markdown(&tiles));
    for tile in &tiles {
        assert!(tile.broken == 0, "{tile}");
        let off = (tile.found.mean() - tile.expected).abs();
        assert!(tile.is_too_long() || off <= 6.0 * tile.found.standard_error(), "{tile}");
    }
}

pub(crate) fn frames_hold_at_their_ends() {
    let findings = frames::run(Effort::Reduced);
    println!("{}", frames::markdown(&findings));
    // few restarts bound nothing, but light in another unit must give the same choices
    let exposed = findings.comparisons.iter().filter(|c| c.name.contains("light"));
    let same = exposed.map(|c| c.difference).fold(0.0, f64::max);
    assert!(same == 0.0, "light in another unit changes pictures by {same:e}");
    let broken: u64 = findings.comparisons.iter().map(|c| c.broken).sum::<u64>() + findings.broken;
    assert!(broken == 0, "{broken} broken pixels");
}

/// The textbook's forms, which cancel.
pub(crate) fn forms_that_cancel_are_seen() {
    let depth = [("u", Axis::Unit), ("optical depth", Axis::Log(1.0e-12, 1.0e6))];
    let bounded = |p: &[f64]| [Expected::relative(-(p[0] * (-p[1]).exp_m1()).ln_1p() / p[1])];
    let naive = Function::new("bounded exponential by 1 - exp(-x)", &depth, |p| {
        let (u, depth) = (p[0], p[1]);
        [-restir_shared::num::ln(1.0 - u * (1.0 - restir_shared::num::exp(-depth))) / depth]
    });
    let end = Function::new("bounded exponential without care for its end", &depth, |p| {
        // the product is rounded, the logarithm is not
        let product = p[0] * f64::from(-p[1]).exp_m1() as f32;
        [(-f64::from(product).ln_1p() / f64::from(p[1])) as f32]
    });
    let cone = [("u", Axis::Unit), ("versine", Axis::Log(1.0e-12, 2.0))];
    let narrow = Function::new("depth of a cone by its cosine", &cone, |p| [1.0 - (1.0 - p[0] * p[1])]);
    let narrow = narrow.against(|p| [Expected::relative(p[0] * p[1])]);
    for row in [naive.against(bounded), end.against(bounded), narrow] {
        assert!(!row.run(Effort::Reduced).passed(), "passes: {}", row.function.name);
    }
}
