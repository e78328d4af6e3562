//! How much the statistical checks draw.
//!
//! The counts and bounds that suites name are those of `RESTIR_THOROUGH=1 cargo test --release`. Every other run draws an eighth of
//! that: its standard errors, and the biases that it excludes, are 2.8 times as large.

use std::sync::LazyLock;

/// The draws of a thorough run over those of any other.
const DIVISOR: u32 = 8;

static IS_THOROUGH: LazyLock<bool> =
    LazyLock::new(|| std::env::var_os("RESTIR_THOROUGH").is_some_and(|value| value == "1"));

/// How many draws are made where a thorough run makes `thorough` of them.
pub fn draws(thorough: u32) -> u32 {
    if *IS_THOROUGH { thorough } else { thorough.div_ceil(DIVISOR) }
}

/// The bound of a standard error, or of a bias that is noticed, where that of a thorough run is `thorough`.
pub fn bound(thorough: f64) -> f64 {
    if *IS_THOROUGH { thorough } else { thorough * f64::from(DIVISOR).sqrt() }
}
